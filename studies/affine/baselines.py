"""The classical interpolants of affine keyframes beside the optimum: distortion, energy, smoothness."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

import symmotion as sm
from studies.shares import spread
from symmotion.bodies import eight_ellipses, wedge
from symmotion.motions import Motion, PoseMotion, orthonormalise
from symmotion.motions.interpolants import component_cubic, log_blend, polar_blend, rational_spline, steady_morph
from symmotion.motions.quaternions import interpolate_quaternions
from symmotion.report import Column, Figure, Player, Run, Study, StudyOptions, StudyResult, Table, player, to_figure
from symmotion.splines import cubic_interpolant
from symmotion.views import draw_body, draw_ellipsoid, draw_path, new_figure

# Rigid all the way, with as many controls as the component-wise cubic: two more than keyframes, in every number.
RIGID: dict[str, Callable[[sm.Keyframes], Motion]] = {
    "rational, dual quaternions": rational_spline,
    "quaternions, cumulative": lambda keys: PoseMotion(
        interpolate_quaternions(keys), cubic_interpolant(keys.times, keys.translation)
    ),
}
BASELINES: dict[str, Callable[[sm.Keyframes], Motion]] = {
    "component-wise cubic": component_cubic,
    "polar, slerp": partial(polar_blend, rotation="slerp"),
    "polar, C² rotation": polar_blend,
    "logarithm, linear": log_blend,
    "logarithm, cubic": partial(log_blend, degree=3),
    "steady morph": steady_morph,
    **RIGID,
}
SOLVERS = {
    "elimination": sm.Elimination(),
    "staged elimination": sm.Elimination(stages="knots"),
    "ExactNewton": sm.ExactNewton(),
}
PLAYED = ("component-wise cubic", "logarithm, cubic", "least R")
SMOOTHED = 1e-3  # weight of E beside R
SEMI_AXES = (1.1, 0.7, 0.5)
# Jumps below this share of the largest velocity or acceleration are rounding.
ROUNDING = 1e-8


@dataclass(frozen=True)
class Row:
    """What one motion does to one set of keyframes; None where there is no such motion or figure."""

    keyframes: str
    motion: str
    outcome: str
    rigidity: float | None = None
    rigidity2: float | None = None
    energy: float | None = None
    velocity_jump: float | None = None
    acceleration_jump: float | None = None
    from_rigid: float | None = None


def keyframe_sets(full: bool) -> dict[str, sm.Keyframes]:
    """The sets by name; the drawn body travels to the right through all of them."""
    sets = {
        "rigid, 70°": _travelling(sm.examples.random_keyframes(5, 70, 2)),
        "affine, planar": sm.examples.planar_keyframes(),
        "affine, spatial": sm.examples.spatial_keyframes(),
        "rigid, 150°": _travelling(sm.examples.random_keyframes(5, 150, 4)),
    }
    if full:
        for angle in (40, 110, 170):
            for seed in range(3):
                keys = _travelling(sm.examples.random_keyframes(8, angle, seed))
                sets[f"rigid, {angle}°, seed {seed}"] = keys
        sets["two, planar"] = sm.examples.sheared_turn()
    return sets


def _travelling(keys: sm.Keyframes) -> sm.Keyframes:
    i = np.arange(len(keys))
    return sm.Keyframes(keys.times, keys.linear, np.column_stack([3.0 * i, 0.8 * np.sin(1.3 * i), 0.5 * np.cos(i)]))


def run(options: StudyOptions) -> StudyResult:
    rows: list[Row] = []
    runs: list[Run] = []
    figures: list[Figure] = []
    players: list[Player] = []
    for k, (name, keys) in enumerate(keyframe_sets(options.full).items()):
        options.progress(name)
        motions: dict[str, Motion] = {}
        for baseline, make in BASELINES.items():
            try:
                motions[baseline] = make(keys)
            except sm.InputError as error:
                rows.append(Row(name, baseline, str(error)))
                continue
            rows.append(_row(name, baseline, "–", motions[baseline], keys))
        for objective, short in _objectives(keys).items():
            program = sm.affine_program(keys, objective=short)
            for label, solver in SOLVERS.items():
                if short.name not in ("R", "R*") and label != "ExactNewton":
                    continue
                solution = solver.solve(program)
                run = Run.of(f"{name}, least {objective}", solution)
                runs.append(run)
                outcome = "minimum" if run.certified else "saddle point" if run.status == "solved" else run.status
                motion = f"least {objective}: {label}"
                rows.append(_row(name, motion, outcome, solution.motion, keys))
                if label == "ExactNewton":
                    motions[f"least {objective}"] = solution.motion
        if k < 4:
            figures.append(_strips(f"strips-{k + 1}", name, keys, motions))
            body = eight_ellipses() if keys.dimension == 2 else wedge(1.6)
            caption = f"{name}: a body under some of these motions. Grey: the keyframes."
            shown = {label: motions[label] for label in PLAYED if label in motions}
            players.append(player(f"motions-{k + 1}", shown, body, caption, keys, picture=figures[-1]))
    tables, text, answer = (_table(rows),), _conclusion(rows), _answer(rows)
    return StudyResult(tables, tuple(figures), tuple(runs), text, players=tuple(players), answer=answer)


def _points(keys: sm.Keyframes) -> np.ndarray:
    return np.concatenate([np.eye(keys.dimension), -np.eye(keys.dimension)])


def _objectives(keys: sm.Keyframes) -> dict[str, sm.energies.Energy]:
    smooth = sm.Rigidity() + SMOOTHED * sm.TrajectoryEnergy(_points(keys))
    return {"R": sm.Rigidity(), "R*": sm.Rigidity(2), "R + 0.001 E": smooth}


def _row(name: str, label: str, outcome: str, motion: Motion, keys: sm.Keyframes) -> Row:
    def value(energy: sm.energies.Energy) -> float:
        if isinstance(motion, PoseMotion):
            # G is the unit matrix, by construction.
            return 0.0 if isinstance(energy, sm.Rigidity) else sm.measure(motion, energy)
        return sm.measure(motion, energy, times=None if isinstance(motion, sm.AffineMotion) else keys.times)

    points = _points(keys)
    far = None
    if np.abs(keys.linear.transpose(0, 2, 1) @ keys.linear - np.eye(keys.dimension)).max() < 1e-9:
        try:
            far = orthonormalise(motion, np.linspace(*motion.domain, 401)).deviation
        except sm.InputError as error:
            outcome = f"{outcome}; {error}"
    return Row(
        name,
        label,
        outcome,
        rigidity=value(sm.Rigidity()),
        rigidity2=value(sm.Rigidity(2)),
        energy=value(sm.TrajectoryEnergy(points)),
        velocity_jump=jump(motion, keys.times, 1, points),
        acceleration_jump=jump(motion, keys.times, 2, points),
        from_rigid=far,
    )


def jump(motion: Motion, times: np.ndarray, nu: int, points: np.ndarray) -> float:
    """The largest jump of the nu-th derivative of a body point's path at the inner times; 0 where it is rounding."""
    inner = times[1:-1]
    if not len(inner):
        return 0.0
    after = motion.trajectory(points, inner, nu)
    before = motion.trajectory(points, np.nextafter(inner, -np.inf), nu)
    size = np.linalg.norm(motion.trajectory(points, np.linspace(*motion.domain, 101), nu), axis=-1).max()
    largest = float(np.linalg.norm(after - before, axis=-1).max())
    return largest if largest > ROUNDING * size else 0.0


def _table(rows: list[Row]) -> Table:
    columns = (
        Column("keyframes"),
        Column("motion"),
        Column("outcome"),
        Column("R"),
        Column("R*"),
        Column("E"),
        Column("velocity jump"),
        Column("acceleration jump"),
        Column("from rigid"),
    )
    caption = (
        "R, R* and the trajectory energy E (six or four body points at distance 1), integrated between the keyframes: "
        "what a jump of the velocity would add to R* and E, which is infinite, is not in them. Jumps: the largest of a "
        "body point at an inner keyframe. From rigid: largest ‖A − polar(A)‖, where the keyframes are rigid. Outcome: "
        "what the certificate says of an optimised motion, or why there is no such interpolant. All optimised motions "
        "are cubic with one inserted knot per segment."
    )
    return Table("baselines", columns, tuple(tuple(vars(r).values()) for r in rows), caption)


def _strips(figure_name: str, name: str, keys: sm.Keyframes, motions: dict[str, Motion]) -> Figure:
    count = (len(motions) + 2) // 3
    with new_figure(7.0, 0.2 + 1.35 * count) as figure:
        panels = figure.subplots(count, 3, sharex=True, sharey=True, squeeze=False).ravel()
        for axes in panels[len(motions) :]:
            axes.remove()
        for axes, (label, motion) in zip(panels, motions.items(), strict=False):
            between = np.linspace(keys.times[:-1], keys.times[1:], 6, endpoint=False)[1:].ravel()
            if keys.dimension == 2:
                draw_body(axes, motion, eight_ellipses(), between, alpha=0.3)
                draw_body(axes, motion, eight_ellipses(), keys.times, "#000000")
                draw_path(axes, motion)
            else:
                draw_ellipsoid(axes, motion, between, SEMI_AXES)
                draw_ellipsoid(axes, motion, keys.times, SEMI_AXES, ink=True)
            axes.set_title(label, fontsize=9)
        body = "A flower of eight ellipses" if keys.dimension == 2 else "An ellipsoid, drawn by its principal ellipses,"
        return to_figure(
            figure,
            figure_name,
            f"{name}: {body} under every interpolant and under the optima of ExactNewton. In ink: the keyframes.",
        )


def _answer(rows: list[Row]) -> str:
    by_set: dict[str, dict[str, float]] = {}
    for r in rows:
        if r.rigidity is not None:
            by_set.setdefault(r.keyframes, {})[r.motion] = r.rigidity
    best = "least R: ExactNewton"
    gains = [found["component-wise cubic"] / found[best] for found in by_set.values()]
    below = sum(min(found[m] for m in BASELINES if m in found) < found[best] for found in by_set.values())
    return (
        f"Over {len(by_set)} sets of keyframes the spline of least R distorts {spread(gains)} times less than the "
        f"component-wise cubic; in {below} of them a classical interpolant, no spline, distorts still less."
    )


def _conclusion(rows: list[Row]) -> str:
    def find(keyframes: str, motion: str) -> Row:
        return next(r for r in rows if r.keyframes == keyframes and r.motion == motion)

    names = list(dict.fromkeys(r.keyframes for r in rows))
    parts = []
    for name in names[:4]:
        cubic, best = find(name, "component-wise cubic"), find(name, "least R: ExactNewton")
        others = [r for r in rows if r.keyframes == name and r.motion in BASELINES and r.rigidity is not None]
        least = min(others, key=lambda r: r.rigidity or 0.0)
        parts.append(
            f"{name}: R is {cubic.rigidity:.4g} for the component-wise cubic and {best.rigidity:.4g} at the optimum; "
            f"the least of the interpolants is {least.rigidity:.3g} ({least.motion})"
        )
    jumping = "; ".join(sorted({r.motion for r in rows if r.motion in BASELINES and (r.velocity_jump or 0.0) > 0}))
    rigid = {r.motion for r in rows if r.from_rigid is not None} - {
        r.motion for r in rows if (r.from_rigid or 0.0) > 1e-9
    }
    # SciPy's rotation spline is C² to some 1e-6, where its iteration ends.
    rough = {r.motion for r in rows if (r.acceleration_jump or 0.0) > 1e-4}
    smooth = "; ".join(sorted(rigid - rough))
    optimised = [r for r in rows if r.motion.startswith("least")]

    def share(solver: str) -> str:
        mine = [r for r in optimised if r.motion.endswith(f": {solver}")]
        return f"{sum(r.outcome.startswith('minimum') for r in mine)} of {len(mine)}"

    return (
        ". ".join(parts) + ".\n\n"
        "Interpolants made of exponentials keep rigid keyframes rigid exactly, which no spline can do (HJK 2.1); what "
        f"they pay is smoothness or polynomial paths: the velocity jumps at keyframes in: {jumping}. C² "
        f"and rigid are: {smooth}. For keyframes that change shape, the optimum "
        "is to be compared with the polar one in R and E together.\n\n"
        f"{_equal_freedom(rows)}\n\n"
        f"Certified minima: elimination {share('elimination')}, staged {share('staged elimination')}, ExactNewton "
        f"{share('ExactNewton')}."
    )


def _equal_freedom(rows: list[Row]) -> str:
    """Rigid motions beside the affine one with as many controls, over the sets of rigid keyframes."""
    found: dict[str, dict[str, Row]] = {}
    for r in rows:
        if r.from_rigid is not None:
            found.setdefault(r.keyframes, {})[r.motion] = r
    sets = [s for s in found.values() if s.keys() >= {*RIGID, "component-wise cubic"}]
    energies, off = {}, [s["component-wise cubic"].from_rigid or 0.0 for s in sets]
    for name in RIGID:
        pairs = [(s[name].energy, s["component-wise cubic"].energy) for s in sets]
        energies[name] = spread(a / b for a, b in pairs if a and b)
    rational, quaternions = energies.values()
    return (
        f"With two controls more than keyframes each, over {len(sets)} sets of rigid ones: E of the rational motion is "
        f"{rational} times that of the component-wise cubic, E of the cumulative quaternion curve beside a cubic path "
        f"{quaternions} times; both are rigid, where ‖A − polar(A)‖ of the cubic comes to {spread(off)}. The rational "
        "one has rational paths of degree 6, the quaternion curve paths that are not rational (HJK 2.1)."
    )


STUDY = Study(
    "baselines",
    "What does optimisation buy over the classical interpolants of affine keyframes?",
    "HJK 1, 2.3, against Shoemake and Duff 1992, Alexa 2002, Rossignac and Vinacua 2011",
    run,
    order=13,
)
