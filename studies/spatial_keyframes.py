"""HJK figure 4: an ellipsoid through four affine keyframes in space."""

import numpy as np
from matplotlib.axes import Axes

import symmotion as sm
from studies.several_keyframes import before_and_after
from symmotion.report import Study, StudyOptions, StudyResult
from symmotion.report.bodies import Mesh, grid_mesh
from symmotion.report.drawing import draw_ellipsoid

KEYFRAMES = sm.examples.spatial_keyframes()
SEMI_AXES = (1.1, 0.7, 0.5)


def run(options: StudyOptions) -> StudyResult:
    body = "An ellipsoid, drawn by its principal ellipses,"
    return before_and_after(KEYFRAMES, _draw, ellipsoid(SEMI_AXES), body, options)


def ellipsoid(semi_axes: tuple[float, float, float]) -> Mesh:
    """An ellipsoid about the origin, 12 faces round and 8 from pole to pole."""
    round_, up = np.linspace(0, 2 * np.pi, 13)[:, None], np.linspace(-np.pi / 2, np.pi / 2, 9)
    return grid_mesh(
        np.stack([np.cos(round_) * np.cos(up), np.sin(round_) * np.cos(up), 0 * round_ + np.sin(up)], axis=-1)
        * semi_axes
    )


def _draw(axes: Axes, motion: sm.AffineMotion) -> None:
    between = np.setdiff1d(np.linspace(*motion.domain, 13), KEYFRAMES.times)
    draw_ellipsoid(axes, motion, between, SEMI_AXES)
    draw_ellipsoid(axes, motion, KEYFRAMES.times, SEMI_AXES, ink=True)


STUDY = Study(
    "spatial_keyframes",
    "What does optimisation change for a body in space?",
    "HJK 5.3, figure 4",
    run,
    order=3,
)
