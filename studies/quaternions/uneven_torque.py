"""Whether motions of least torque are found where neighbours turn far at uneven times."""

from time import process_time

import numpy as np

import symmotion as sm
from studies.shares import interval, share
from symmotion.motions.quaternions import exp, product
from symmotion.report import Column, StudyOptions, Table

RATIOS = (1.0, 10.0, 100.0, 1000.0)
# The budget of every solve: iterations, and seconds.
ITERATIONS, PATIENCE = 1000, 30.0
# Of values that agree up to rounding neither is the lower one.
SAME = 1e-6


def uneven_torque(options: StudyOptions) -> tuple[Table, str]:
    """Shares of certified minima by ratio of intervals, and in a sentence.

    The long form has 300 programs a ratio in place of 2, and the ratio 1,000.
    """
    cases, rows, told = 300 if options.full else 2, [], []
    solvers = [make(max_iterations=ITERATIONS, time_limit=PATIENCE) for make in (sm.ExactNewton, sm.Ipopt)]
    for ratio in RATIOS if options.full else RATIOS[:3]:
        options.progress(f"least torque at intervals uneven by {ratio:g}")
        found, costs = list[list[sm.Solution]](), list[list[float]]()
        for seed in range(cases):
            found.append([])
            costs.append([])
            for solver in solvers:
                # Each has a program of its own, so that neither finds what the other made.
                program, began = uneven_program(seed, ratio), process_time()
                found[-1].append(solver.solve(program))
                costs[-1].append(1e3 * (process_time() - began))
        both = [(a.objective, b.objective) for a, b in found if a.certified and b.certified]
        lower = sum(a < b - SAME * abs(b) for a, b in both)
        higher = sum(a > b + SAME * abs(b) for a, b in both)
        certified = [sum(s.certified for s in each) for each in zip(*found, strict=True)]
        for name, count, solutions, spent in zip(
            ("ExactNewton", "IPOPT"), certified, zip(*found, strict=True), zip(*costs, strict=True), strict=True
        ):
            below = (lower, higher)[name == "IPOPT"]
            iterations = np.median([s.iterations for s in solutions])
            shares = (100 * count / cases, *interval(count, cases))
            rows.append((ratio, name, cases, *shares, below, iterations, np.median(spent)))
        told.append(
            f"{share(certified[0], cases)} at intervals uneven by {ratio:g} (IPOPT {share(certified[1], cases)})"
        )
    table = Table(
        "far turns at uneven times",
        (
            Column("intervals uneven by"),
            Column("solver"),
            Column("programs"),
            Column("certified", "%"),
            Column("from", "%", end=True),
            Column("to", "%", end=True),
            Column("lower than the other"),
            Column("iterations"),
            Column("CPU", "ms"),
        ),
        tuple(rows),
        "Least torque, moments of inertia up to 1 : 5 : 5, through 3 to 20 keyframes that turn by up to 179° about "
        f"random axes, from the program's own start, {ITERATIONS:,} iterations or {PATIENCE:g} s at most. Lower: how "
        "often the certified minimum is the lower one of two. Wilson's 95 % interval; medians.",
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
