"""HJK figure 5: the volumes that an ellipsoid sweeps, through keyframes in space and as the letter S."""

from collections.abc import Callable
from typing import Any

import numpy as np

import symmotion as sm
from studies.several_keyframes import start_of
from studies.swept_motions import Circle, breathing, kneaded, letter_s, loop
from symmotion.report import Column, Figure, Player, Run, Study, StudyOptions, StudyResult, Table
from symmotion.report.bodies import ellipsoid_mesh
from symmotion.report.figures import COLOURS, new_figure, to_figure
from symmotion.report.meshes import draw_curve, draw_mesh
from symmotion.report.players import player
from symmotion.report.spheres import VIEW, view_from
from symmotion.sweeps import Mesh, MovingEllipsoid, SweptVolume, characteristic_curves, swept_volume

FRONT = view_from([0.55, -2.6, 0.75])
ABOVE = view_from([0.9, -1.6, 2.6])
BALL = 4 / 3 * np.pi
OBJECTIVE = sm.Rigidity(2)
# name: keyframes, semi-axes, view
SWEEPS: dict[str, tuple[Callable[[], sm.Keyframes], tuple[float, ...], np.ndarray]] = {
    "ellipsoid": (sm.examples.spatial_keyframes, (1.1, 0.7, 0.5), VIEW),
    "letter S": (letter_s, (0.2, 0.3, 0.36), FRONT),
    "loop": (loop, (0.6, 0.6, 0.6), ABOVE),
}


def run(options: StudyOptions) -> StudyResult:
    options.progress("closed forms")
    oracles, worst, orders = _oracles((7, 14, 28, 56) if options.full else (7, 14, 28))
    slices, divisions, samples = (192, 48, 2**20) if options.full else (56, 18, 2**15)
    runs: list[Run] = []
    rows: list[tuple[Any, ...]] = []
    overlaps: list[tuple[Any, ...]] = []
    swept: dict[str, SweptVolume] = {}
    players: list[Player] = []
    for name, (keyframes, axes, view) in SWEEPS.items():
        options.progress(name)
        program = sm.affine_program(keyframes(), objective=OBJECTIVE)
        comparison = sm.compare(program, [sm.ExactNewton(), sm.Ipopt()])
        runs += [Run.of(name, s) for s in comparison.solutions]
        if comparison.best is None:
            raise sm.SolveError(f"no solver solved {name}")
        motions = {"interpolating spline": start_of(program), "least R*": comparison.best.motion}
        caption = f"Before and after: the ellipsoid that sweeps the {name}. Grey: the keyframes."
        shape, slug = ellipsoid_mesh(axes), name.replace(" ", "-")
        players.append(player(slug, motions, shape, caption, keyframes(), direction=view[:, 2]))
        for kind, motion in motions.items():
            body = MovingEllipsoid(motion, axes)
            swept[name] = swept_volume(body, slices=slices, divisions=divisions, samples=samples)
            sizes = (
                BALL
                * np.prod(axes)
                * np.linalg.det(motion(np.linspace(motion.domain[0], motion.domain[1], 401)).linear)
            )
            measured = (swept[name].volume, swept[name].area, sizes.min(), sizes.max())
            rows.append((name, kind, sm.measure(motion, OBJECTIVE), *measured))
        outer = swept_volume(swept[name].body, "implicit", slices=slices, divisions=divisions + divisions // 2)
        overlaps.append((name, *_overlap(swept[name], outer)))
    volumes = Table(
        "swept volumes",
        (
            Column("sweep"),
            Column("motion"),
            Column("R*"),
            Column("volume of the envelope"),
            Column("its area"),
            Column("smallest ellipsoid"),
            Column("largest ellipsoid"),
        ),
        tuple(rows),
        "In the units of the keyframes; the ellipsoids by their volumes along the motion.",
    )
    overlap = Table(
        "overlap",
        (
            Column("sweep"),
            Column("volume of the envelope"),
            Column("overlap"),
            Column("standard error"),
            Column("volume less overlap"),
            Column("outer boundary"),
            Column("its area"),
            Column("difference, relative"),
        ),
        tuple(overlaps),
        "The motions of least R*. Where a sweep overlaps itself the envelope has sheets inside, and its volume counts "
        "what was visited twice twice; overlap is that excess, by quasi-Monte Carlo with independent scramblings. The "
        "outer boundary is found in another way, in a grid in space that cuts curved surfaces more coarsely.",
    )
    options.progress("characteristic curves")
    bodies = {name: s.body for name, s in swept.items()}
    bodies |= {"breathing ball": MovingEllipsoid(breathing()), "kneaded ball": MovingEllipsoid(kneaded())}
    counted = {name: _loop_counts(body) for name, body in bodies.items()}
    meshes = {name: swept_volume(body, slices=slices, divisions=divisions // 2).mesh for name, body in bodies.items()}
    loops = Table(
        "characteristic curves",
        (
            Column("sweep"),
            Column("times"),
            Column("no curve"),
            Column("one loop"),
            Column("two loops"),
            Column("triangles of the envelope"),
            Column("boundary edges"),
            Column("V − E + F"),
        ),
        tuple(
            (name, len(c), *(int(np.sum(c == k)) for k in range(3)), *_topology(meshes[name]))
            for name, c in counted.items()
        ),
        "At how many equally spaced times the envelope touches the ellipsoid along how many closed curves, and the "
        "mesh that marching tetrahedra in sphere × time make of it and of the ends.",
    )
    options.progress("figures")
    shown = {name: bodies[name] for name in ("ellipsoid", "breathing ball", "kneaded ball")}
    free = [o[0] for o in overlaps if o[2] <= 3 * o[3]]
    crossed = overlaps[-1]
    silent, split = counted["breathing ball"], counted["kneaded ball"]
    conclusion = (
        f"{sum(m.closed for m in meshes.values())} of {len(meshes)} envelope meshes are closed. They reach the closed "
        f"forms to {worst:.2g} of volume and area at the finest step; halving the steps divides the error of the "
        f"volume by 2 to the power {orders[0]:.3g} to {orders[1]:.3g}.\n\n"
        f"Without overlap, to three standard errors: {', '.join(free) or 'none'}. The {crossed[0]} overlaps itself by "
        f"{crossed[2]:.3g} ± {crossed[3]:.1g}, {100 * crossed[2] / crossed[4]:.3g} % of the {crossed[4]:.4g} that "
        f"remain. Less the overlap, the envelopes agree with the outer boundaries to "
        f"{100 * max(abs(o[-1]) for o in overlaps):.2g} %.\n\n"
        f"The breathing ball has no characteristic curve at {int(np.sum(silent == 0))} of {len(silent)} times, when it "
        f"swells or shrinks faster than it moves; the kneaded one has two loops at {int(np.sum(split == 2))} of "
        f"{len(split)}. HJK print the condition without the velocity of the translation; it is needed unless the "
        f"origin stays in place.\n\n{where_solvers_end(runs)}"
    )
    figures = (_picture(swept), _curves(shown))
    return StudyResult((oracles, volumes, overlap, loops), figures, tuple(runs), conclusion, players=tuple(players))


def _topology(mesh: Mesh) -> tuple[int, int, int]:
    return len(mesh.triangles), len(mesh.boundary_edges), mesh.euler_characteristic


def where_solvers_end(runs: list[Run]) -> str:
    """Where the solvers ended, in a sentence."""
    apart = [
        f"{a.case} ({a.method} {a.objective:.6g}, {b.method} {b.objective:.6g}, inertia {a.inertia} and {b.inertia})"
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
    skew, goes = np.array([[1.2, 0.3, 0.0], [0.0, 0.7, 0.2], [0.1, 0.0, 0.5]]), np.array([3.0, 1.0, -0.5])
    line = sm.BSplineBasis.clamped([0, 1], 1)
    length, det = float(np.linalg.norm(goes)), float(np.linalg.det(skew))
    ends = np.array([0 * goes, goes])
    cases = {
        "translated ellipsoid": (
            MovingEllipsoid(sm.AffineMotion(line, np.array([skew, skew]), ends)),
            BALL * det + np.pi * det * float(np.linalg.norm(np.linalg.solve(skew, goes))),
            None,
        ),
        "capsule": (
            MovingEllipsoid(sm.AffineMotion(line, np.tile(np.eye(3), (2, 1, 1)), ends), 0.5),
            BALL / 8 + np.pi * length / 4,
            np.pi + np.pi * length,
        ),
        "torus": (MovingEllipsoid(Circle(2.0), 0.5), np.pi**2, 4 * np.pi**2),
    }
    rows: list[tuple[Any, ...]] = []
    worst, orders = 0.0, []
    for name, (body, volume, area) in cases.items():
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
        (
            Column("sweep"),
            Column("divisions"),
            Column("slices"),
            Column("triangles"),
            Column("V − E + F"),
            Column("error of the volume, relative"),
            Column("order"),
            Column("error of the area, relative"),
            Column("order of the area"),
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
            "Characteristic curves at 61 or 31 times, in closed form; dark: the outlines of the first and the last "
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
