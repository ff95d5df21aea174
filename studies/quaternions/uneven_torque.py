"""Whether motions of least torque are found where neighbours turn far at uneven times."""

from time import process_time

import numpy as np

import symmotion as sm
from studies.shares import interval, share
from symmotion.motions.quaternions import exp, product
from symmotion.report import Column, StudyOptions, Table

RATIOS = (1.0, 10.0, 100.0, 1000.0)
PATIENCE = 30.0  # seconds for a solve


def uneven_torque(options: StudyOptions) -> tuple[Table, str]:
    """Shares of certified minima by ratio of intervals, and in a sentence.

    The long form has 300 programs a ratio in place of 3, and the ratios 100 and 1,000.
    """
    cases, rows, told = 300 if options.full else 3, [], []
    for ratio in RATIOS if options.full else RATIOS[:2]:
        options.progress(f"least torque at intervals uneven by {ratio:g}")
        found, iterations, seconds = 0, [], []
        for seed in range(cases):
            program, began = uneven_program(seed, ratio), process_time()
            solution = sm.ExactNewton(time_limit=PATIENCE).solve(program)
            found += solution.certified
            iterations.append(solution.iterations)
            seconds.append(1e3 * (process_time() - began))
        rows.append(
            (ratio, cases, 100 * found / cases, *interval(found, cases), np.median(iterations), np.median(seconds))
        )
        told.append(f"{share(found, cases)} at intervals uneven by {ratio:g}")
    table = Table(
        "far turns at uneven times",
        (
            Column("intervals uneven by"),
            Column("programs"),
            Column("certified", "%"),
            Column("from", "%", end=True),
            Column("to", "%", end=True),
            Column("iterations"),
            Column("CPU", "ms"),
        ),
        tuple(rows),
        "ExactNewton from the program's own start: least torque, moments of inertia up to 1 : 5 : 5, through 3 to 20 "
        "keyframes that turn by up to 179° about random axes. Wilson's 95 % interval; medians.",
    )
    return table, f"Least torque through far turns is certified in {', '.join(told)}."


def uneven_program(seed: int, ratio: float) -> sm.program.Program:
    """Keyframes turned by up to 179°, at intervals that differ by up to a ratio, for a body of random inertia."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 21))
    steps = ratio ** rng.uniform(0, 1, count - 1)
    q = [np.array([1.0, 0.0, 0.0, 0.0])]
    for _ in range(count - 1):
        axis = rng.normal(size=3)
        q.append(product(q[-1], exp(np.radians(rng.uniform(0, 179)) / 2 * axis / np.linalg.norm(axis))))
    middle, last = np.sort(rng.uniform(1, 5, 2)).tolist()
    # No moment of a body exceeds the sum of the other two.
    inertia = (1.0, middle, min(last, 1 + middle))
    times = np.concatenate([[0.0], np.cumsum(steps / steps.min())])
    return sm.orientation_program(times, np.array(q), objective=sm.Torque(inertia))
