"""HJK figure 5: the volumes that an ellipsoid sweeps, through keyframes in space and as the letter S."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

import symmotion as sm
from studies.affine.several_keyframes import start_of
from studies.sweeps.swept_motions import BALL, breathing, closed_forms, kneaded, letter_s, loop
from symmotion.bodies import Mesh, ellipsoid_mesh
from symmotion.report import Column, Figure, Player, Run, Study, StudyOptions, StudyResult, Table, player, to_figure
from symmotion.sweeps import MovingEllipsoid, SweptVolume, characteristic_curves, swept_volume
from symmotion.views import COLOURS, VIEW, draw_curve, draw_mesh, new_figure, view_from

FRONT = view_from([0.55, -2.6, 0.75])
ABOVE = view_from([0.9, -1.6, 2.6])
OBJECTIVE = sm.Rigidity(2)
# name: keyframes, semi-axes, view
SWEEPS: dict[str, tuple[Callable[[], sm.Keyframes], tuple[float, ...], np.ndarray]] = {
    "ellipsoid": (sm.examples.spatial_keyframes, (1.1, 0.7, 0.5), VIEW),
    "letter S": (letter_s, (0.2, 0.3, 0.36), FRONT),
    "loop": (loop, (0.6, 0.6, 0.6), ABOVE),
}


def columns(*names: str) -> tuple[Column, ...]:
    """Columns without units."""
    return tuple(map(Column, names))


class Sweeps(NamedTuple):
    """What the solvers and the envelopes of all sweeps came to."""

    runs: list[Run]
    players: list[Player]
    rows: list[tuple[Any, ...]]
    best: dict[str, SweptVolume]


def run(options: StudyOptions) -> StudyResult:
    options.progress("closed forms")
    oracles, worst, orders = _oracles((7, 14, 28, 56) if options.full else (7, 14, 28))
    slices, divisions, samples = (192, 48, 2**20) if options.full else (56, 18, 2**15)
    sweeps = _sweeps(options, slices, divisions, samples)
    options.progress("outer boundaries")
    outer = {"slices": slices, "divisions": divisions + divisions // 2}
    overlaps = [(name, *_overlap(s, swept_volume(s.body, "implicit", **outer))) for name, s in sweeps.best.items()]
    options.progress("characteristic curves")
    bodies = {name: s.body for name, s in sweeps.best.items()}
    bodies |= {"breathing ball": MovingEllipsoid(breathing()), "kneaded ball": MovingEllipsoid(kneaded())}
    counted = {name: _loop_counts(body) for name, body in bodies.items()}
    meshes = {name: swept_volume(body, slices=slices, divisions=divisions // 2).mesh for name, body in bodies.items()}
    options.progress("figures")
    shown = {name: bodies[name] for name in ("ellipsoid", "breathing ball", "kneaded ball")}
    conclusion = (
        f"{sum(m.closed for m in meshes.values())} of {len(meshes)} envelope meshes are closed. They reach the closed "
        f"forms to {worst:.2g} of volume and area at the finest step; halving the steps divides the error of the "
        f"volume by 2 to the power {orders[0]:.3g} to {orders[1]:.3g}.\n\n{_said_of_overlap(overlaps)}\n\n"
        f"{_said_of_curves(counted)}\n\n{where_solvers_end(sweeps.runs)}"
    )
    return StudyResult(
        (oracles, _volumes(sweeps.rows), _overlaps(overlaps), _loops(counted, meshes)),
        (_picture(sweeps.best), _curves(shown)),
        tuple(sweeps.runs),
        conclusion,
        players=tuple(sweeps.players),
        answer=(
            f"{sum(m.closed for m in meshes.values())} of {len(meshes)} envelopes of a moving ellipsoid close; volume "
            f"and area reach closed forms to {worst:.2g}, with order {orders[0]:.3g} to {orders[1]:.3g} in the step."
        ),
    )


def _sweeps(options: StudyOptions, slices: int, divisions: int, samples: int) -> Sweeps:
    runs: list[Run] = []
    players: list[Player] = []
    rows: list[tuple[Any, ...]] = []
    best: dict[str, SweptVolume] = {}
    for name, (keyframes, axes, view) in SWEEPS.items():
        options.progress(name)
        program = sm.affine_program(keyframes(), objective=OBJECTIVE)
        comparison = sm.compare(program, [sm.ExactNewton(), sm.Ipopt()])
        runs += [Run.of(name, s) for s in comparison.solutions]
        if comparison.best is None:
            raise sm.SolveError(f"no solver solved {name}")
        motions = {"interpolating spline": start_of(program), "least R*": comparison.best.motion}
        caption = f"Before and after: the body of the sweep “{name}”. Grey: the keyframes."
        shape, slug = ellipsoid_mesh(axes), name.replace(" ", "-")
        players.append(player(slug, motions, shape, caption, keyframes(), direction=view[:, 2]))
        for kind, motion in motions.items():
            swept = swept_volume(MovingEllipsoid(motion, axes), slices=slices, divisions=divisions, samples=samples)
            t = np.linspace(motion.domain[0], motion.domain[1], 401)
            sizes = BALL * np.prod(axes) * np.linalg.det(motion(t).linear)
            measured = (swept.volume, swept.area, float(sizes.min()), float(sizes.max()))
            rows.append((name, kind, sm.measure(motion, OBJECTIVE), *measured))
            best[name] = swept  # the last is the best
    return Sweeps(runs, players, rows, best)


def _volumes(rows: list[tuple[Any, ...]]) -> Table:
    return Table(
        "swept volumes",
        columns(
            "sweep", "motion", "R*", "volume of the envelope", "its area", "smallest ellipsoid", "largest ellipsoid"
        ),
        tuple(rows),
        "In the units of the keyframes; the ellipsoids by their volumes along the motion.",
    )


def _overlaps(rows: list[tuple[Any, ...]]) -> Table:
    return Table(
        "overlap",
        columns(
            "sweep",
            "volume of the envelope",
            "overlap",
            "standard error",
            "volume less overlap",
            "outer boundary",
            "its area",
            "difference, relative",
        ),
        tuple(rows),
        "The motions of least R*. Where a sweep overlaps itself the envelope has sheets inside, and its volume counts "
        "what was visited twice twice; overlap is that excess, by quasi-Monte Carlo with independent scramblings. The "
        "outer boundary is found in another way, in a grid in space that cuts curved surfaces more coarsely.",
    )


def _said_of_overlap(rows: list[tuple[Any, ...]]) -> str:
    free = [row[0] for row in rows if row[2] <= 3 * row[3]]
    name, _, overlap, error, less, *_ = rows[-1]
    return (
        f"Without overlap, to three standard errors: {', '.join(free) or 'none'}. The {name} overlaps itself by "
        f"{overlap:.3g} ± {error:.1g}, {100 * overlap / less:.3g} % of the {less:.4g} that remain. Less the overlap, "
        f"the envelopes agree with the outer boundaries to {100 * max(abs(row[-1]) for row in rows):.2g} %."
    )


def _loops(counted: dict[str, np.ndarray], meshes: dict[str, Mesh]) -> Table:
    return Table(
        "characteristic curves",
        columns(
            "sweep",
            "times",
            "no curve",
            "one loop",
            "two loops",
            "triangles of the envelope",
            "boundary edges",
            "V − E + F",
        ),
        tuple(
            (
                name,
                len(c),
                *(int(np.sum(c == k)) for k in range(3)),
                len(m.triangles),
                len(m.boundary_edges),
                m.euler_characteristic,
            )
            for (name, c), m in zip(counted.items(), meshes.values(), strict=True)
        ),
        "At how many equally spaced times the envelope touches the ellipsoid along how many closed curves, and the "
        "mesh that marching tetrahedra in sphere × time make of it and of the ends.",
    )


def _said_of_curves(counted: dict[str, np.ndarray]) -> str:
    silent, split = counted["breathing ball"], counted["kneaded ball"]
    return (
        f"The breathing ball has no characteristic curve at {int(np.sum(silent == 0))} of {len(silent)} times, when it "
        f"swells or shrinks faster than it moves; the kneaded one has two loops at {int(np.sum(split == 2))} of "
        f"{len(split)}. HJK print the condition without the velocity of the translation; it is needed unless the "
        "origin stays in place."
    )


def where_solvers_end(runs: list[Run]) -> str:
    """Where the solvers ended, in a sentence."""
    apart = [
        f"{a.case} (objective: {a.method} {a.objective:.6g}, {b.method} {b.objective:.6g}; "
        f"inertia {a.inertia} and {b.inertia})"
        for a, b in zip(runs[::2], runs[1::2], strict=True)
        if abs((a.objective or 0) - (b.objective or 0)) > 1e-6 * abs(a.objective or 1)
    ]
    if not apart:
        return "Both solvers end at the same motions."
    return f"The solvers end at different motions for {', '.join(apart)}; the lower one is shown."


def _overlap(envelope: SweptVolume, outer: SweptVolume) -> tuple[float, ...]:
    less = envelope.volume - envelope.overlap.value
    return envelope.volume, *envelope.overlap, less, outer.volume, outer.area, outer.volume / less - 1


def _oracles(steps: tuple[int, ...]) -> tuple[Table, float, tuple[float, float]]:
    """The table of errors against closed forms, the largest at the finest step, and the range of orders by volume."""
    rows: list[tuple[Any, ...]] = []
    worst, orders = 0.0, []
    for name, (body, volume, area) in closed_forms().items():
        before: tuple[float, ...] = ()
        for n in steps:
            swept = swept_volume(body, slices=4 * n, divisions=n)
            errors = [swept.volume / volume - 1] + ([] if area is None else [swept.area / area - 1])
            found = [float(np.log2(abs(b / e))) for b, e in zip(before, errors, strict=False)]
            orders += found[:1]
            cells = [errors[0], *(found[:1] or [None]), *(errors[1:] or [None]), *(found[1:] or [None])]
            rows.append((name, n, 4 * n, len(swept.mesh.triangles), swept.mesh.euler_characteristic, *cells))
            before = tuple(errors)
        worst = max(worst, *(abs(e) for e in before))
    table = Table(
        "closed forms",
        columns(
            "sweep",
            "divisions",
            "slices",
            "triangles",
            "V − E + F",
            "error of the volume, relative",
            "order",
            "error of the area, relative",
            "order of the area",
        ),
        tuple(rows),
        "Against 4π/3 det A + |L| π det A |A⁻¹L/|L||, 4π/3 r³ + πr²L with area 4πr² + 2πrL, and 2π²Rr² with area "
        "4π²Rr. Order: log₂ of the ratio of errors when the steps are halved. The area of the translated ellipsoid has "
        "no simple closed form.",
    )
    return table, worst, (min(orders), max(orders))


def _loop_counts(body: MovingEllipsoid, times: int = 49) -> np.ndarray:
    return np.array([len(characteristic_curves(body, t, 48)) for t in np.linspace(*body.domain, times)])


def _picture(swept: dict[str, SweptVolume]) -> Figure:
    with new_figure(7.0, 6.6) as figure:
        grid = figure.add_gridspec(2, 2, height_ratios=[1, 1.3])
        panels = (figure.add_subplot(grid[0, :]), figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1]))
        for axes, (name, s) in zip(panels, swept.items(), strict=True):
            draw_mesh(axes, swept_volume(s.body, slices=56, divisions=8).mesh, view=SWEEPS[name][2])
            axes.set_title(name)
        return to_figure(
            figure,
            "swept-volumes",
            "The volumes that ellipsoids sweep under the motions of least R*: through the keyframes of figure 4 "
            "(HJK figure 5a), a brush that writes the letter S (figure 5b), and one that crosses its own path.",
        )


def _curves(bodies: dict[str, MovingEllipsoid]) -> Figure:
    with new_figure(7.0, 5.2) as figure:
        grid = figure.add_gridspec(2, 2)
        panels = (figure.add_subplot(grid[0, :]), figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1]))
        for axes, (name, body) in zip(panels, bodies.items(), strict=True):
            axes.set_title(name)
            for t in np.linspace(*body.domain, 61 if axes is panels[0] else 31):
                for curve in characteristic_curves(body, t, 72):
                    draw_curve(axes, curve.points, COLOURS[0], closed=True, linewidth=0.7, alpha=0.75)
            for t in body.domain:
                draw_curve(axes, _outline(body, t), COLOURS[5], closed=True, linewidth=1.4)
        return to_figure(
            figure,
            "characteristic-curves",
            "Characteristic curves at 61 or 31 times, in closed form; in ink: the outlines of the first and the last "
            "position. The breathing ball has none while it swells or shrinks faster than it moves, the kneaded ball "
            "two loops while it is drawn out or pressed flat.",
        )


def _outline(body: MovingEllipsoid, t: float) -> np.ndarray:
    """(96, 3) the outline of the ellipsoid seen from afar, where the normal B⁻ᵀs is across the view."""
    matrix, _ = body(t)
    plane = np.linalg.svd((np.linalg.inv(matrix) @ VIEW[:, 2])[None])[2][1:]
    angle = np.linspace(0, 2 * np.pi, 96, endpoint=False)
    return body.points(np.column_stack([np.cos(angle), np.sin(angle)]) @ plane, t)


STUDY = Study(
    "swept_volumes",
    "What volume does a moving ellipsoid sweep, and does its envelope close?",
    "HJK 5.4, figure 5",
    run,
    order=18,
)
