"""A tectonic plate's finite rotations, at strongly non-uniform ages: a smooth history, and what a tolerance buys."""

from pathlib import Path
from typing import Any

import numpy as np

import symmotion as sm
from studies.runner.recordings import recorded
from symmotion.motions.interpolants import slerp_curve
from symmotion.motions.quaternions import exp, interpolate_quaternions, rotate
from symmotion.report import Column, Run, Study, StudyOptions, StudyResult, Table, player, to_figure
from symmotion.views import COLOURS, draw_sphere, draw_sphere_curve, draw_sphere_points, new_figure, view_from

ROTATIONS = recorded("PALEOMAP_PlateModel.rot")
PLATE, ANCHOR = 701, 0
OLDEST = 600.0  # Ma: beyond, and in the future, poles are guesses hundreds of Ma apart
RADIUS = 6371.0  # km


def run(options: StudyOptions) -> StudyResult:
    ages, q, note = load()
    options.progress(f"{len(ages)} rotations")
    spline = interpolate_quaternions(ages, q)
    knots = 4 if options.full else 2
    exact = sm.ExactNewton().solve(sm.orientation_program(ages, q, refine=knots - 1))
    runs = [Run.of("keyframes met", exact)]
    motions = {"slerp": slerp_curve(ages, q), "C² spline": spline, "least ∫‖Ω̇‖²": exact.motion}
    rows: list[tuple[Any, ...]] = []
    site = np.array(
        [
            np.cos(np.deg2rad(5)) * np.cos(np.deg2rad(20)),
            np.cos(np.deg2rad(5)) * np.sin(np.deg2rad(20)),
            np.sin(np.deg2rad(5)),
        ]
    )
    t = np.linspace(ages[0], ages[-1], 4001)
    rows.append(("slerp", 0.0, None, _speeds(motions["slerp"], t, site)[0], None))
    rows.append(("C² spline", 0.0, sm.measure(spline, sm.Torque()), *_speeds(spline, t, site)))
    rows.append(("least ∫‖Ω̇‖²", 0.0, sm.measure(exact.motion, sm.Torque()), *_speeds(exact.motion, t, site)))
    for degrees in (0.5, 2.0):
        options.progress(f"tolerance {degrees:g}°")
        program = sm.orientation_program(
            ages, q, refine=knots - 1, constraints=[sm.Tolerance(turn=np.deg2rad(degrees))]
        )
        loose = sm.Ipopt().solve(program)
        runs.append(Run.of(f"tolerance {degrees:g}°", loose))
        name = f"within {degrees:g}°"
        motions[name] = loose.motion
        rows.append((name, degrees, sm.measure(loose.motion, sm.Torque()), *_speeds(loose.motion, t, site)))
    table = Table(
        "histories",
        (
            Column("history"),
            Column("tolerance", "°"),
            Column("∫‖Ω̇‖²", "rad²/Ma³"),
            Column("fastest", "km/Ma"),
            Column("largest change of rate", "°/Ma²"),
        ),
        tuple(rows),
        "Speed of a site at 5° N, 20° E today. The slerp's rate jumps at every keyframe: it has no acceleration.",
    )
    figures = (_rates(motions, t, ages), _path(motions, t, ages, q, site))
    step = np.diff(ages)
    conclusion = (
        f"{len(ages)} rotations from {ages[0]:g} to {ages[-1]:g} Ma, {step.min():g} to {step.max():g} Ma apart: "
        f"the C² "
        f"quaternion spline goes through all of them, and the optimum with {knots} knots per interval lowers "
        f"∫‖Ω̇‖² by "
        f"{100 * (1 - rows[2][2] / rows[1][2]):.2g} %. The data are what bends the history: with a tolerance of "
        f"0.5° the "
        f"least ∫‖Ω̇‖² falls to {100 * rows[3][2] / rows[2][2]:.3g} % of that, with 2° to "
        f"{100 * rows[4][2] / rows[2][2]:.2g} %, "
        f"and the fastest motion of the site from {rows[2][3]:.4g} to {rows[3][3]:.4g} and {rows[4][3]:.4g} km/Ma "
        f"(slerp: {rows[0][3]:.4g})."
    )
    answer = (
        f"A C² quaternion spline carries all {len(ages)} rotations and bends "
        f"{100 * (rows[1][2] / rows[2][2] - 1):.2g} % more than the least; tolerances of 0.5° and 2° lower the least "
        f"∫‖Ω̇‖² to {100 * rows[3][2] / rows[2][2]:.3g} % and {100 * rows[4][2] / rows[2][2]:.2g} %."
    )
    return StudyResult((table,), figures, tuple(runs), conclusion, (note,), (_drift(motions, site),), answer)


def load(path: Path | None = None) -> tuple[np.ndarray, np.ndarray, str]:
    """Ages in Ma (M,), quaternions (M, 4) of the plate, and what the report has to say about them."""
    path = ROTATIONS if path is None else path
    if not path.is_file():
        return *example(), f"Ran on example data made by the project: {path.name} is not beside the checkout."
    keys = sm.read_keyframes(path, "rot", node=f"{PLATE}/{ANCHOR}")
    ages, q = keys.times, sm.quaternions.from_rotation(keys.rotations())
    used = (ages >= 0) & (ages <= OLDEST)
    which = f"plate {PLATE} relative to {ANCHOR:03d}, up to {OLDEST:g} Ma"
    note = f"Rotations: {path.name} (C. R. Scotese, PALEOMAP, CC BY 3.0), {which}."
    return ages[used], q[used], note


def example() -> tuple[np.ndarray, np.ndarray]:
    """A made-up plate: a wandering pole, ages from 1 to 60 Ma apart."""
    rng = np.random.default_rng(11)
    ages = np.concatenate([[0.0], np.cumsum(np.geomspace(4, 60, 24) * rng.uniform(0.8, 1.2, 24))])
    angle = np.deg2rad(0.18 * ages + 6 * np.sin(ages / 60))
    pole = np.column_stack([0.6 + 0.2 * np.sin(ages / 150), 0.3 * np.cos(ages / 100), 0.7 + 0 * ages])
    pole /= np.linalg.norm(pole, axis=1, keepdims=True)
    return ages, exp(angle[:, None] / 2 * pole)


def _speeds(motion, t: np.ndarray, site: np.ndarray) -> tuple[float, float]:
    jet = motion.jet(t, 2)
    speed = RADIUS * np.linalg.norm(np.cross(jet.rate, site), axis=1)
    return float(speed.max()), float(np.rad2deg(np.linalg.norm(jet.acceleration, axis=1).max()))


def _rates(motions, t: np.ndarray, ages: np.ndarray):
    with new_figure(7.0, 3.0) as figure:
        axes = figure.subplots()
        colours = ("#000000", COLOURS[1], COLOURS[2], COLOURS[3], COLOURS[0])
        for (name, motion), colour in zip(motions.items(), colours, strict=True):
            rate = np.rad2deg(np.linalg.norm(motion.jet(t, 1).rate, axis=1))
            axes.plot(t, rate, color=colour, label=name, linewidth=0.8 if name == "slerp" else 1.3)
        axes.plot(ages, np.zeros_like(ages), "|", color="#000000", markersize=6)
        axes.set(xlabel="age [Ma]", ylabel="rate [°/Ma]")
        figure.legend(loc="outside upper left", ncols=5)
        return to_figure(figure, "rates", "Angular rate of the plate by age; ticks are the ages of the data.")


def _drift(motions, site: np.ndarray):
    """The plate as a cap of the unit sphere, 20° wide, about the site."""
    east = np.cross([0.0, 0.0, 1.0], site)
    around = np.linspace(0, 2 * np.pi, 24, endpoint=False)[:, None]
    ring = np.cos(around) * east / np.linalg.norm(east) + np.sin(around) * np.cross(site, east)
    angle = np.deg2rad(20)
    cap = np.cos(angle) * site + np.sin(angle) * ring
    shown = {name: motions[name] for name in ("C² spline", "within 2°")}
    caption = "A cap of the sphere, 20° in radius, about the site, and the path that the plate's rotations carry it on."
    return player("drift", shown, [cap], caption, unit="Ma", centre=site, direction=(0.9, 0.35, 0.5))


def _path(motions, t: np.ndarray, ages: np.ndarray, q: np.ndarray, site: np.ndarray):
    view = view_from([0.9, 0.35, 0.1])
    with new_figure(5.0, 4.6) as figure:
        axes = figure.subplots()
        draw_sphere(axes, view)
        for name, colour in (("least ∫‖Ω̇‖²", COLOURS[2]), ("within 2°", COLOURS[0])):
            draw_sphere_curve(axes, rotate(motions[name](t), site), colour, label=name, linewidth=1.3, view=view)
        draw_sphere_points(axes, rotate(q, site), size=3, view=view)
        figure.legend(loc="outside upper left", ncols=2)
        return to_figure(figure, "path", "Where a site of the plate has been; dots are the data.")


STUDY = Study(
    "plates",
    "Does a quaternion spline carry a plate's recorded rotations, at uneven ages, and what do tolerances buy?",
    "real input: finite rotations of a tectonic plate",
    run,
    order=25,
)
