"""A recorded orientation faired: a quaternion curve in cumulative form, through its control polygon."""

from pathlib import Path

import numpy as np

import symmotion as sm
from studies.fairing.fairing_nets import AFTER, BEFORE, rms
from studies.recorded.recorded_poses import load
from symmotion.fairing import fair
from symmotion.report import Column, Figure, Table, to_figure
from symmotion.splines import BSplineBasis
from symmotion.views import new_figure

CONTROLS, STRETCHES = 120, 8
DISPLACEMENTS = (0.05, 0.1, 0.2)  # RMS, in degrees


def stretches(data: Path | None) -> tuple[list[sm.quaternions.QuaternionMotion], tuple[str, ...]]:
    """Stretches of a recording as curves whose control quaternions are recorded orientations, and what to say of it."""
    recording, notes = load(data)
    quaternions = recording.rotations().as_quat()[:, [3, 0, 1, 2]]
    count = min(CONTROLS, max(len(quaternions) // STRETCHES, 8))
    starts = np.unique(np.linspace(0, len(quaternions) - count, STRETCHES).astype(int))
    found = []
    for first in starts:
        part = quaternions[first : first + count].copy()
        signs = np.cumprod(np.where(np.sum(part[1:] * part[:-1], axis=1) < 0, -1.0, 1.0))
        part[1:] *= signs[:, None]
        step = float(np.median(np.diff(recording.times[first : first + count])))
        knots = recording.times[first] + step * (np.arange(count + 4) - 1.5)
        found.append(sm.quaternions.QuaternionMotion(BSplineBasis(knots, 3), part))
    return found, notes


def jerk(motion: sm.quaternions.QuaternionMotion) -> tuple[np.ndarray, np.ndarray]:
    """Times inside the spans and the size of the rate's second derivative there, in °/s³, by central differences."""
    edges = motion.basis.breakpoints
    h = 0.05 * float(np.diff(edges).min())
    t = (edges[:-1, None] + np.diff(edges)[:, None] * np.linspace(0.1, 0.9, 5)).ravel()
    a, b, c = (motion.rate(t + k * h, "world") for k in (-1, 0, 1))
    return t, np.rad2deg(np.linalg.norm(a - 2 * b + c, axis=-1)) / h**2


def turned(result) -> float:
    """RMS angle between the controls before and after, in degrees: the chord of unit quaternions is half of it."""
    return float(np.rad2deg(2 * rms(result.displacement)))


def faired_turns(motions: list[sm.quaternions.QuaternionMotion]) -> list[tuple]:
    """Of every stretch and displacement, by least squares: G and jerk before and after, and what greedy steps move."""
    rows = []
    for motion in motions:
        n = motion.basis.n
        before = rms(jerk(motion)[1])
        for wanted in DISPLACEMENTS:
            # The displacement of N = 4 (n − 2) coordinates, whose RMS over n controls is half the angle.
            noise = 0.5 * np.deg2rad(wanted) * np.sqrt(n / (4 * (n - 2)))
            least = fair(motion, noise=noise)
            greedy = fair(motion, target=least.final)
            reached = greedy.final <= least.final * (1 + 1e-9)
            ratio = rms(greedy.displacement) / rms(least.displacement) if reached else np.nan
            rows.append((wanted, turned(least), least.final / least.initial, before, rms(jerk(least.motion)[1]), ratio))
    return rows


def turns_table(rows: list[tuple]) -> Table:
    """By displacement, over the stretches."""
    found = []
    for wanted in DISPLACEMENTS:
        mine = np.array([r for r in rows if r[0] == wanted])
        lower = mine[:, 4] / mine[:, 3]
        had = mine[np.isfinite(mine[:, 5]), 5]
        steps = (len(had), float(np.median(had)) if len(had) else None)
        found.append(
            (wanted, len(mine), float(np.median(mine[:, 2])), *_middling(mine[:, 3]), *_middling(lower), *steps)
        )
    columns = (
        Column("displacement, RMS", "°"),
        Column("stretches"),
        Column("G over that before, median"),
        Column("jerk before, median", "°/s³"),
        Column("least", "°/s³", end=True),
        Column("largest", "°/s³", end=True),
        Column("jerk over that before, median"),
        Column("least ratio", end=True),
        Column("largest ratio", end=True),
        Column("greedy steps get there"),
        Column("and move further by, median"),
    )
    caption = (
        "Quaternion curves in cumulative form whose control quaternions are recorded orientations, faired through the "
        "control polygon, by least squares; jerk: RMS of the second derivative of the rate. Greedy: to the same G."
    )
    return Table("recorded orientation", columns, tuple(found), caption)


def _middling(values: np.ndarray) -> tuple[float, float, float]:
    return float(np.median(values)), float(np.min(values)), float(np.max(values))


def turns_told(table: Table) -> str:
    """What was found, in a sentence."""
    wanted, count, _, before, _, _, lower, least, largest, *_ = table.rows[1]
    return (
        f"A recorded orientation, {count} stretches of it, has a jerk of {before:.3g} °/s³ (RMS) when its orientations "
        f"are control quaternions; moved by {wanted:g}° it has {lower:.2g} ({least:.2g}–{largest:.2g}) times that."
    )


def turns_figure(motion: sm.quaternions.QuaternionMotion) -> Figure:
    """The jerk of a recorded orientation over time."""
    wanted = DISPLACEMENTS[1]
    n = motion.basis.n
    faired = fair(motion, noise=0.5 * np.deg2rad(wanted) * np.sqrt(n / (4 * (n - 2)))).motion
    with new_figure(7.0, 2.8) as figure:
        axes = figure.subplots()
        for each, name, colour in ((motion, "as recorded", BEFORE), (faired, "faired", AFTER)):
            axes.plot(*jerk(each), color=colour, label=name, linewidth=0.9)
        axes.set_yscale("log")
        axes.set_xlabel("time [s]")
        axes.set_ylabel("|ω″| [°/s³]")
        figure.legend(loc="outside upper left", ncols=2)
        caption = (
            f"The second derivative of the rate of a recorded orientation, and after its controls have moved by "
            f"{wanted:g}° (RMS)."
        )
        return to_figure(figure, "recorded-orientation", caption)
