"""How fast are quaternion curves and their programs, beside SciPy and other packages where they are installed?"""

from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from time import perf_counter
from typing import Any

import numpy as np
from scipy.spatial.transform import RotationSpline

import symmotion as sm
from symmotion.design import orientation_program
from symmotion.motions.quaternions import QuaternionMotion, exp, interpolate_quaternions, product, to_rotation
from symmotion.report import Column, Run, Study, StudyOptions, StudyResult, Table

KEYS, ORIENTATIONS = 1000, 100_000
PROGRAMS = (10, 100, 1000)
INERTIAS = (("unit", None), ("1, 2, 3", [1.0, 2.0, 3.0]))


def run(options: StudyOptions) -> StudyResult:
    times, q = np.arange(float(KEYS)), _walk(KEYS)
    options.progress("evaluation")
    evaluation, plain, full = _evaluation(times, q, options)
    options.progress("programs")
    programs, runs = _programs(options)
    shooting = _shooting(options)
    longest: tuple[Any, ...] = programs.rows[-1]
    conclusion = (
        f"An orientation on a curve through {KEYS} keyframes takes {plain:.2g} µs, with rate and acceleration "
        f"{full:.2g} µs "
        f"(aims: 1 and 2 µs). The torque-minimal program with {longest[0]} keyframes and two knots per interval "
        f"is built and "
        f"solved in {longest[5]:.3g} s (aim: 10 s for 1000)."
    )
    if shooting is not None:
        near: tuple[Any, ...] = shooting.rows[-1]
        conclusion += (
            f"\n\nWhere the inertia is a unit matrix and nothing else is asked, shooting solves the same problem: "
            f"{near[2]:.2g} s against {near[6]:.2g} s at {near[0]} keyframes, and its energy lies "
            f"{100 * (near[5] / near[1] - 1):.2g} % below that with 8 knots per interval, which falls towards it."
        )
    tables = (evaluation, programs) if shooting is None else (evaluation, programs, shooting)
    answer = (
        f"An orientation on a quaternion curve through {KEYS} keyframes takes {plain:.2g} µs, and the program of least "
        f"torque with {longest[0]} keyframes is built and solved in {longest[5]:.3g} s."
    )
    return StudyResult(tables, (), tuple(runs), conclusion, answer=answer)


def _walk(count: int, angle: float = 0.7, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    q = [np.array([1.0, 0.0, 0.0, 0.0])]
    for _ in range(count - 1):
        axis = rng.normal(size=3)
        q.append(product(q[-1], exp(angle / 2 * axis / np.linalg.norm(axis))))
    return np.array(q)


def _best(function: Callable[[], object], repeats: int) -> float:
    """The least of several wall-clock times, in seconds: others on the machine only add to it."""
    times = []
    for _ in range(repeats):
        began = perf_counter()
        function()
        times.append(perf_counter() - began)
    return min(times)


def _evaluation(times: np.ndarray, q: np.ndarray, options: StudyOptions) -> tuple[Table, float, float]:
    t = np.random.default_rng(1).uniform(times[0], times[-1], ORIENTATIONS)
    micro = 1e6 / ORIENTATIONS
    rows: list[tuple[Any, ...]] = []
    motion = interpolate_quaternions(times, q)
    build = _best(lambda: interpolate_quaternions(times, q), 3)
    plain, full = micro * _best(lambda: motion(t), 5), micro * _best(lambda: motion.jet(t, 2), 5)
    rows.append(("symmotion, C² quaternion spline", build, plain, full))
    quintic = QuaternionMotion(sm.splines.BSplineBasis.clamped(np.linspace(times[0], times[-1], KEYS - 4), 5), q)
    fifth = micro * _best(lambda: quintic(t), 3), micro * _best(lambda: quintic.jet(t, 2), 3)
    rows.append(("symmotion, degree 5", None, *fifth))
    rotations = to_rotation(q)
    build = _best(lambda: RotationSpline(times, rotations), 1)
    spline = RotationSpline(times, rotations)
    rows.append(
        (
            "SciPy RotationSpline",
            build,
            micro * _best(lambda: spline(t), 3),
            micro * _best(lambda: (spline(t), spline(t, 1), spline(t, 2)), 3),
        )
    )
    if find_spec("splines") is not None:
        options.progress("splines")
        rows.append(("splines, de Casteljau", *_splines(times, q, t)))
    note = "" if find_spec("splines") is not None else " The package splines is not installed."
    caption = f"{KEYS} keyframes, {ORIENTATIONS} random times; least wall-clock time of several runs.{note}"
    columns = (
        Column("curve"),
        Column("build", "s"),
        Column("orientation", "µs"),
        Column("with rate and acceleration", "µs"),
    )
    return Table("evaluation", columns, tuple(rows), caption), plain, full


def _splines(times: np.ndarray, q: np.ndarray, t: np.ndarray) -> tuple[float, float, None]:
    """Seconds to build and µs per orientation of the package `splines`, whose evaluation is one at a time."""
    module = import_module("splines.quaternion")
    keys = [module.UnitQuaternion.from_unit_xyzw(np.roll(row, -1)) for row in q]
    build = _best(lambda: module.CatmullRom(keys, list(times)), 1)
    curve = module.CatmullRom(keys, list(times))
    few = t[:500]
    return build, 1e6 / len(few) * _best(lambda: [curve.evaluate(float(s)) for s in few], 3), None


def _programs(options: StudyOptions) -> tuple[Table, list[Run]]:
    rows: list[tuple[Any, ...]] = []
    runs: list[Run] = []
    for count in PROGRAMS:
        # The quick form times the largest with the last inertia only.
        for name, inertia in INERTIAS if options.full or count < PROGRAMS[-1] else INERTIAS[1:]:
            options.progress(f"{count} keyframes, inertia {name}")
            q = _walk(count)
            began = perf_counter()
            program = orientation_program(np.arange(float(count)), q, objective=sm.Torque(inertia))
            solution = sm.ExactNewton().solve(program)
            seconds = perf_counter() - began
            runs.append(Run.of(f"{count} keyframes, inertia {name}", solution))
            rows.append((count, name, program.unknowns, program.conditions, solution.iterations, seconds))
    columns = (
        Column("keyframes"),
        Column("inertia"),
        Column("unknowns"),
        Column("multipliers"),
        Column("iterations"),
        Column("build and solve", "s"),
    )
    caption = "ExactNewton, two knots per interval, neighbours turned by 40°; the first of a kind derives its kernels."
    return Table("programs", columns, tuple(rows), caption), runs


def _shooting(options: StudyOptions) -> Table | None:
    """InterpolatePy's shooting for the Riemannian cubic beside our optimum, where that package is installed."""
    if find_spec("interpolatepy") is None:
        return None
    module = import_module("interpolatepy")
    rows: list[tuple[Any, ...]] = []
    for count in (4, 10, 100) if options.full else (4, 10, 40):
        options.progress(f"shooting, {count} keyframes")
        times, q = np.arange(float(count)), _walk(count)
        keys = [module.Quaternion(*row) for row in q.tolist()]
        began = perf_counter()
        shot = module.ShootingQuaternionInterpolation(times, keys)
        seconds = perf_counter() - began
        energies = []
        for knots in (2, 4, 8):
            began = perf_counter()
            program = orientation_program(times, q, refine=knots - 1)
            energies.append(sm.ExactNewton().solve(program).require().objective)
        rows.append((count, shot.acceleration_energy, seconds, *energies, perf_counter() - began))
    columns = (
        Column("keyframes"),
        Column("energy by shooting"),
        Column("shooting", "s"),
        *(Column(f"energy with {k} knots") for k in (2, 4, 8)),
        Column("with 8 knots", "s"),
    )
    caption = "∫ ‖Ω̇‖² with unit inertia: InterpolatePy's shooting, free of any spline, and the optimum over splines."
    return Table("shooting", columns, tuple(rows), caption)


STUDY = Study(
    "quaternion_speed",
    "How fast are quaternion curves and torque-minimal programs, beside other packages?",
    "symmotion, SciPy RotationSpline, splines and InterpolatePy where installed",
    run,
    alone=True,
    order=26,
)
