"""HJK figure 4: an ellipsoid through four affine keyframes in space."""

import numpy as np
from matplotlib.axes import Axes

import symmotion as sm
from studies.affine.several_keyframes import before_and_after
from symmotion.bodies import ellipsoid_mesh
from symmotion.report import Study, StudyOptions, StudyResult
from symmotion.views import draw_ellipsoid

KEYFRAMES = sm.examples.spatial_keyframes()
SEMI_AXES = (1.1, 0.7, 0.5)


def run(options: StudyOptions) -> StudyResult:
    body = "An ellipsoid, drawn by its principal ellipses,"
    return before_and_after(KEYFRAMES, _draw, ellipsoid_mesh(SEMI_AXES), body, options)


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
