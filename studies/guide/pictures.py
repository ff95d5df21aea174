"""The pictures of the README and of what plots: a body that moves, before and after, and `plot` of each kind."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes

import symmotion as sm
from studies.affine import planar_keyframes
from studies.affine.several_keyframes import draw_both, start_of
from studies.guide.moving import moving
from symmotion.bodies import eight_ellipses
from symmotion.motions import noisy_net, smooth_net
from symmotion.report import Column, Figure, Run, Study, StudyOptions, StudyResult, Table, to_figure
from symmotion.views import FONT, HEIGHT, WIDTH, fit_height, new_figure


def run(options: StudyOptions) -> StudyResult:
    planar, spatial = sm.examples.planar_keyframes(), sm.examples.spatial_keyframes()
    options.progress("solving")
    flat = sm.ExactNewton().solve(sm.affine_program(planar, objective=sm.Rigidity(2)))
    objective = sm.Rigidity() + 1e-3 * sm.TrajectoryEnergy(np.eye(3))
    comparison = sm.compare(sm.affine_program(spatial, objective=objective))
    solution = comparison.solutions[0]
    options.progress("fairing")
    net = noisy_net(smooth_net(15), 0.018, seed=1)
    faired = sm.fair(net, target=0.002)
    options.progress("drawing")
    size = np.linalg.norm(solution.multipliers["keyframes"].linear, axis=(1, 2))
    dearest = int(np.argmax(size))
    pictures: list[tuple[str, Callable[[Axes], Any], str]] = [
        (
            "motion",
            lambda axes: flat.motion.plot(axes, keyframes=planar),
            "motion.plot(keyframes=keys): the planar motion of least R* through four keyframes, dark and numbered.",
        ),
        (
            "solution",
            solution.plot,
            "solution.plot(): a motion in space of least R + E/1000 and its keyframes, seen in parallel.",
        ),
        ("comparison", comparison.plot, "comparison.plot(): stationarity over the iterations of three solvers."),
        ("fairing", faired.plot, "faired.plot(): the fairness G over the steps of greedy fairing."),
    ]
    if options.full:
        pictures += _others(solution, faired, net)
    both = draw_both(planar_keyframes.draw, "A body of eight ellipses", start_of(flat.program), flat.motion)
    caption = "moving: the C² spline through four keyframes (grey) and the motion of least R*, side by side."
    sides = {"C² spline": start_of(flat.program), "least distortion": flat.motion}
    played = moving("moving", sides, eight_ellipses(), planar, caption)
    figures = (played, on_paper(replace(both, name="body")), *(_drawn(*picture) for picture in pictures))
    runs = tuple(Run.of("space, R + E/1000", s) for s in comparison.solutions)
    runs = (Run.of("plane, R*", flat), *runs)
    rows = tuple((f.name, f.caption.split(": ")[0], len(f.svg) / 1e3) for f in figures[1:])
    table = Table("pictures", (Column("picture"), Column("call"), Column("size", "kB")), rows)
    steps = ", ".join(f"{s.method} {s.iterations}" for s in comparison.solutions)
    conclusion = (
        f"Of the keyframes in space number {dearest} is the most expensive, ‖λ‖ = {size[dearest]:.3g} of its linear "
        f"part. Steps of the solvers: {steps}. Fairing lowers G from {faired.initial:.3g} to {faired.final:.3g} in "
        f"{faired.steps} steps."
    )
    answer = (
        f"The pictures show that keyframe {dearest} in space is the dearest, ‖λ‖ = {size[dearest]:.3g}, and that "
        f"fairing lowers G from {faired.initial:.3g} to {faired.final:.3g} in {faired.steps} steps."
    )
    return StudyResult((table,), figures, runs, conclusion, answer=answer)


def _others(solution: sm.Solution, faired: sm.fairing.FairingResult, net: sm.motions.TwoParameterMotion) -> list:
    """The other kinds of pictures."""
    from scipy.spatial.transform import Rotation

    turns = Rotation.from_euler("ZYX", [[0, 0, 0], [60, 30, 10], [110, -20, 70], [190, 25, 95]], degrees=True)
    curve = sm.quaternions.interpolate_quaternions(np.arange(4.0), turns)
    rigid = sm.motions.orthonormalise(solution.motion, np.linspace(0, 1, 41))
    return [
        (
            "multipliers",
            lambda axes: solution.plot(axes, kind="multipliers"),
            "solution.plot(kind='multipliers'): what each keyframe costs.",
        ),
        (
            "convergence",
            lambda axes: solution.plot(axes, kind="convergence"),
            "solution.plot(kind='convergence'): stationarity over the iterations.",
        ),
        ("rate", curve.plot, "curve.plot(): body rates of an interpolating quaternion curve."),
        ("sphere", lambda axes: curve.plot(axes, kind="sphere"), "curve.plot(kind='sphere'): its unit vectors."),
        ("net", net.plot, "net.plot(): a noisy spherical motion as its quaternion surface."),
        ("faired", faired.motion.plot, "faired.motion.plot(): the same, faired."),
        ("knots", lambda axes: faired.plot(axes, kind="knots"), "faired.plot(kind='knots'): what is left of G."),
        ("rigid", rigid.plot, "rigid.plot(): what orthonormalising the motion in space gives up."),
        ("keyframes", solution.program.design.keyframes.plot, "keys.plot(): keyframes alone."),
    ]


def on_paper(figure: Figure) -> Figure:
    """A figure in black on white wherever it is shown: a README takes no colour from its page."""
    svg = figure.svg.replace("currentColor", "#000000").replace("fill: none", "fill: #ffffff", 1)
    return replace(figure, svg=svg)


def _drawn(name: str, draw: Callable[[Axes], Any], caption: str) -> Figure:
    with new_figure(WIDTH, HEIGHT) as figure:
        matplotlib.rcParams.update(FONT)
        axes = figure.add_subplot()
        draw(axes)
        fit_height(axes)
        return on_paper(to_figure(figure, name, caption))


STUDY = Study("pictures", "What do the pictures of the README show?", "README", run, order=95)
