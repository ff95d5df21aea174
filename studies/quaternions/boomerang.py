"""KKS figure 7: a boomerang's flight, a Hermite curve for the path and a Hermite quaternion curve for the spin."""

from typing import Any

import numpy as np

from symmotion.motions import Keyframes, PoseMotion
from symmotion.motions.quaternions import QuaternionMotion, exp
from symmotion.report import Column, Study, StudyOptions, StudyResult, Table, player, to_figure
from symmotion.splines import BSplineBasis, Spline
from symmotion.views import COLOURS, draw_outlines, new_figure, view_from

SECONDS = 3.0
VIEW = view_from([0.5, -2.0, 1.5])
PLACES = np.array([[0.0, 0.0, 1.5], [1.0, 0.5, 1.2]])  # m
VELOCITIES = np.array([[26.0, 6.0, 3.0], [4.0, -24.0, -2.5]])  # m/s
TILT = exp(np.array([[0.5, 0.0, 0.0], [0.05, 0.0, 0.0]]))


def run(options: StudyOptions) -> StudyResult:
    basis = BSplineBasis.clamped([0.0, SECONDS], 3)
    inner = PLACES + np.array([[1], [-1]]) * VELOCITIES * SECONDS / 3
    path = Spline(basis, np.stack([PLACES[0], inner[0], inner[1], PLACES[1]]))
    rows: list[tuple[Any, ...]] = []
    motions = {}
    for spin in (2.2, 6.2, 12.2):  # turns per second at both ends; not whole, so that the middle factor is a spin too
        rate = np.array([0.0, 0.0, 2 * np.pi * spin])
        options.progress(f"{spin:g} turns per second")
        # Of all numbers of extra turns, the one of the steadiest spin.
        most = round(spin * SECONDS / 3) + 1
        choices = {k: _flight(rate, k, path) for k in range(-most, most + 1)}
        steady = min(choices, key=lambda k, c=choices: _unsteadiness(c[k]))
        motion = choices[steady]
        motions[spin] = motion
        t = np.linspace(0, SECONDS, 6001)
        speed = np.linalg.norm(motion.orientation.rate(t), axis=1)
        ends = motion.orientation.rate([0.0, SECONDS])
        turns = np.trapezoid(speed, t) / (2 * np.pi)
        rows.append(
            (
                spin,
                steady,
                float(turns),
                float(speed.min() / 2 / np.pi),
                float(speed.max() / 2 / np.pi),
                float(np.abs(ends - rate).max()),
            )
        )
    table = Table(
        "flights",
        (
            Column("spin at the ends", "turns/s"),
            Column("extra turns"),
            Column("turns in all"),
            Column("slowest", "turns/s"),
            Column("fastest", "turns/s"),
            Column("error of the end rates", "rad/s"),
        ),
        tuple(rows),
    )
    motion, arm = motions[2.2], _boomerang()
    with new_figure(7.0, 3.6) as figure:
        axes = figure.subplots()
        t = np.linspace(0, SECONDS, 400)
        line = motion(t).translation @ VIEW
        axes.plot(line[:, 0], line[:, 1], color="#000000", linewidth=0.8, alpha=0.6)
        for k, s in enumerate(np.linspace(0, SECONDS, 21)):
            end = k in (0, 20)
            draw_outlines(
                axes, lambda p, s=s: motion.trajectory(p, s), [arm], (COLOURS[5 if end else 0],), alpha=0.5, view=VIEW
            )
        picture = to_figure(
            figure,
            "flight",
            "A boomerang that leaves with 2.2 turns per second and returns; its ends are in ink (KKS figure 7).",
        )
    conclusion = (
        f"One Hermite quaternion curve carries the boomerang through {rows[0][2]:.3g} to {rows[-1][2]:.3g} "
        f"turns, with the end "
        f"rates met to {max(r[5] for r in rows):.1g} rad/s: turns are a number in the middle factor, not more "
        f"keyframes. "
        f"With the number of turns that makes the spin steadiest, {rows[-1][0]:g} turns per second at the ends "
        f"range from "
        f"{rows[-1][3]:.3g} to {rows[-1][4]:.3g} in between."
    )
    flights = {"2.2 turns per second at the ends": motion}
    caption = "A boomerang that leaves with 2.2 turns per second and returns. Grey: at 21 times."
    s = np.linspace(0, SECONDS, 21)
    moving = player(
        "flight", flights, [arm], caption, Keyframes(s, *motion(s)), picture=picture, unit="s", direction=VIEW[:, 2]
    )
    answer = (
        f"One Hermite quaternion curve carries a boomerang through {rows[0][2]:.3g} to {rows[-1][2]:.3g} turns, with "
        f"end rates that are met to {max(r[5] for r in rows):.1g} rad/s."
    )
    return StudyResult((table,), (picture,), (), conclusion, players=(moving,), answer=answer)


def _flight(rate: np.ndarray, turns: int, path: Spline) -> PoseMotion:
    return PoseMotion(QuaternionMotion.hermite(TILT[0], TILT[1], rate, rate, turns=turns, span=(0, SECONDS)), path)


def _unsteadiness(motion: PoseMotion) -> float:
    return float(np.ptp(np.linalg.norm(motion.orientation.rate(np.linspace(0, SECONDS, 301)), axis=1)))


def _boomerang() -> np.ndarray:
    """(N, 3) the outline of a bent wing about its centre, 3 m across to be seen."""
    outer = np.array([[-1.6, -0.5], [-1.45, -0.72], [0.0, 0.32], [1.45, -0.72], [1.6, -0.5], [0.0, 0.8]])
    return np.column_stack([1.1 * outer, np.zeros(len(outer))])


STUDY = Study(
    "boomerang",
    "Can one Hermite quaternion curve spin a body many times between given end rates?",
    "KKS 6.2, figure 7",
    run,
    order=22,
)
