"""Whether C² quaternion curves are found where neighbours turn far at uneven times, and how far they overshoot."""

import numpy as np

import symmotion as sm
from studies.shares import interval, share, spread
from symmotion.motions.quaternions import angles_travelled, exp, interpolate_quaternions, product
from symmotion.report import Column, StudyOptions, Table

RATIOS = (10.0, 100.0)
ENDS = ("natural", "clamped", "periodic")


def far_turns(options: StudyOptions) -> tuple[Table, str]:
    """Shares of curves found by ratio of intervals, and in a sentence the one at the largest ratio.

    The long form has 300 cases a ratio in place of 3, one for each way to end, and the ratio 1,000.
    """
    cases, rows, told = (300, [], "") if options.full else (len(ENDS), [], "")
    for ratio in (*RATIOS, 1000.0) if options.full else RATIOS:
        options.progress(f"far turns at intervals uneven by {ratio:g}")
        found, over = 0, []
        for seed in range(cases):
            times, q, ends, rates, turns = far_keys(seed, ratio)
            try:
                curve = interpolate_quaternions(times, q, ends, rates, turns)
            except sm.SolveError:
                continue
            found += 1
            over.append(angles_travelled(curve).sum() / asked(q, turns))
        rows.append((ratio, found, cases, *interval(found, cases), spread(over)))
        told = f"far turns at intervals uneven by {ratio:g} are interpolated in {share(found, cases)}"
    table = Table(
        "far turns",
        (
            Column("intervals uneven by"),
            Column("found"),
            Column("of"),
            Column("share, at least", "%"),
            Column("at most", "%"),
            Column("travelled over asked"),
        ),
        tuple(rows),
        "C² curves through 4 to 12 keyframes, turns up to 179° about random axes, every second case with extra turns "
        "of −1, 0 or 1 in every interval; natural, clamped and periodic ends. Shares with Wilson's 95 % interval; "
        "turns as median (least–most): where intervals are uneven, C² curves overshoot.",
    )
    return table, told


def far_keys(seed: int, ratio: float) -> tuple[np.ndarray, np.ndarray, str, np.ndarray | None, np.ndarray | None]:
    """Times, quaternions, ends, end rates and extra turns of a case."""
    r = np.random.default_rng(seed)
    count, ends = int(r.integers(4, 13)), ENDS[seed % 3]
    axes = r.normal(size=(count - 1, 3))
    half = np.radians(r.uniform(0, 179, (count - 1, 1))) / 2
    q = [np.array([1.0, 0.0, 0.0, 0.0])]
    for way in exp(half * axes / np.linalg.norm(axes, axis=1, keepdims=True)):
        q.append(product(q[-1], way))
    if ends == "periodic":
        q[-1] = q[0]
    times = np.append(0.0, np.cumsum(ratio ** r.uniform(0, 1, count - 1)))
    turns = r.integers(-1, 2, count - 1) if seed // 3 % 2 else None
    rates = r.normal(size=(2, 3)) * np.radians(90) / np.diff(times).mean() if ends == "clamped" else None
    return times, np.array(q), ends, rates, turns


def asked(q: np.ndarray, turns: np.ndarray | None) -> float:
    """The sum of the turns from keyframe to keyframe, in rad."""
    between = 2 * np.arccos(np.minimum(1.0, np.abs(np.sum(q[1:] * q[:-1], axis=1))))
    return float(np.abs(between + 2 * np.pi * (0 if turns is None else turns)).sum())
