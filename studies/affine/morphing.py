"""Affine morphing: a drawn shape carried through affine copies of itself with as little distortion as can be."""

import numpy as np

import symmotion as sm
from studies.affine.several_keyframes import start_of
from symmotion.motions import copy_deviations, keyframes_from_copies
from symmotion.report import Column, Figure, Run, Study, StudyOptions, StudyResult, Table, player, to_figure
from symmotion.views import COLOURS, draw_body, new_figure

# A fish: control points of four cubic Bézier arcs that close.
OUTLINE = np.array(
    [
        [[1.5, 0.0], [1.0, 0.8], [-0.1, 0.7], [-0.8, 0.12]],
        [[-0.8, 0.12], [-1.0, 0.5], [-1.3, 0.6], [-1.5, 0.6]],
        [[-1.5, 0.6], [-1.25, 0.1], [-1.25, -0.1], [-1.5, -0.5]],
        [[-1.5, -0.5], [-0.9, -0.4], [0.6, -1.1], [1.5, 0.0]],
    ]
)
SEED, TREMBLE = 3, 0.02
# By angle in degrees, size along and across, shear, place.
PLACES = (
    (0, 1.0, 1.0, 0.0, (0.0, 0.0)),
    (75, 1.3, 0.8, 0.3, (7.0, 3.0)),
    (170, 0.8, 1.1, -0.2, (14.5, 2.8)),
    (250, 1.1, 1.0, 0.4, (20.0, -1.0)),
)


def drawn_copies() -> tuple[np.ndarray, np.ndarray]:
    """The control points (16, 2) and their copies (4, 16, 2): affine, but for a hand that trembles."""
    shape = OUTLINE.reshape(-1, 2)
    rng = np.random.default_rng(SEED)
    copies = []
    for angle, along, across, shear, place in PLACES:
        turn = sm.examples.rotation_2d(angle)
        linear = turn @ np.array([[along, shear], [0.0, across]])
        copies.append(shape @ linear.T + place + TREMBLE * rng.normal(size=shape.shape))
    return shape, np.array(copies)


def outline(controls: np.ndarray, points: int = 24) -> np.ndarray:
    """(…, 4 points, 2) the polygon of four Bézier arcs with control points (…, 16, 2)."""
    t = np.linspace(0, 1, points, endpoint=False)[:, None]
    weights = np.concatenate([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3], axis=1)
    arcs = weights @ controls.reshape(*controls.shape[:-2], 4, 4, 2)
    return arcs.reshape(*controls.shape[:-2], -1, 2)


def run(options: StudyOptions) -> StudyResult:
    shape, copies = drawn_copies()
    keys = keyframes_from_copies(shape, copies)
    away = copy_deviations(keys, shape, copies)
    motions, runs = {}, []
    for objective in (sm.Rigidity(1), sm.Rigidity(2)):
        options.progress(objective.name)
        program = sm.affine_program(keys, refine=3 if options.full else 1, objective=objective)
        motions.setdefault("interpolating spline", start_of(program))
        comparison = sm.compare(program, [sm.ExactNewton(), sm.Ipopt()])
        runs += [Run.of(objective.name, s) for s in comparison.solutions]
        if comparison.best is None:
            raise sm.SolveError(f"no solver solved {objective.name}")
        motions[f"least {objective.name}"] = comparison.best.motion
    tables = (
        Table(
            "copies",
            (Column("copy"), Column("time"), Column("deviation, RMS"), Column("area over the shape's")),
            tuple(zip(range(len(keys)), keys.times, away, np.linalg.det(keys.linear), strict=True)),
            f"Least-squares affine maps of {len(shape)} control points. The copies were drawn with an error of "
            f"{TREMBLE:g} per coordinate (seed {SEED}); the deviation is what no affine map explains.",
        ),
        Table(
            "morphs",
            (Column("motion"), Column("R"), Column("R*"), Column("smallest area"), Column("largest area")),
            tuple(
                (name, sm.measure(m, sm.Rigidity(1)), sm.measure(m, sm.Rigidity(2)), *_areas(m))
                for name, m in motions.items()
            ),
            "Area over that of the shape, along the motion.",
        ),
    )
    low, high = np.linalg.det(keys.linear).min(), np.linalg.det(keys.linear).max()
    least = {name: _areas(m)[0] for name, m in motions.items()}
    conclusion = (
        f"The affine maps explain the copies up to {away.max():.2g} (RMS), about the {TREMBLE * np.sqrt(2):.2g} that "
        f"the drawing trembles. The copies have {low:.3g} to {high:.3g} times the area of the shape; between them the "
        f"component-wise spline shrinks it to {least['interpolating spline']:.3g}, the motion of least R to "
        f"{least['least R']:.3g}, that of least R* to {least['least R*']:.3g}."
    )
    picture = _figure(motions, shape, copies)
    caption = "A drawn fish under three affine motions through the least-squares keyframes, grey."
    fish = player("morphs", motions, [outline(shape, 12)], caption, keys, picture=picture)
    answer = (
        f"Between affine copies the motion of least R keeps {100 * least['least R']:.0f} % of the fish's area or more, "
        f"that of least R* {100 * least['least R*']:.0f} %, the component-wise spline "
        f"{100 * least['interpolating spline']:.0f} %."
    )
    return StudyResult(tables, (picture,), tuple(runs), conclusion, players=(fish,), answer=answer)


def _areas(motion: sm.AffineMotion) -> tuple[float, float]:
    areas = np.linalg.det(motion(np.linspace(*motion.domain, 801)).linear)
    return float(areas.min()), float(areas.max())


def _figure(motions: dict[str, sm.AffineMotion], shape: np.ndarray, copies: np.ndarray) -> Figure:
    with new_figure(7.0, 6.0) as figure:
        panels = figure.subplots(len(motions), 1, sharex=True, sharey=True)
        for axes, (name, motion) in zip(panels, motions.items(), strict=True):
            draw_body(axes, motion, [outline(shape)], np.linspace(*motion.domain, 16), alpha=0.3)
            for copy in outline(copies):
                axes.fill(*copy.T, facecolor="none", edgecolor=COLOURS[1], linewidth=1.4)
            axes.set_title(name)
        return to_figure(
            figure,
            "morphs",
            "A drawn fish (orange: the four copies) under three affine motions through the least-squares keyframes.",
        )


STUDY = Study(
    "morphing",
    "How little must a shape be distorted between affine copies of itself?",
    "HJK 2.3 (affine morphing)",
    run,
    order=13,
)
