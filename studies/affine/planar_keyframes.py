"""HJK figure 3: a planar body of eight ellipses through four affine keyframes."""

import numpy as np
from matplotlib.axes import Axes

import symmotion as sm
from studies.affine.several_keyframes import before_and_after
from symmotion.bodies import eight_ellipses
from symmotion.report import Study, StudyOptions, StudyResult
from symmotion.views import COLOURS, draw_body, draw_path

KEYFRAMES = sm.examples.planar_keyframes()


def run(options: StudyOptions) -> StudyResult:
    return before_and_after(KEYFRAMES, draw, eight_ellipses(), "A body of eight ellipses", options)


def draw(axes: Axes, motion: sm.AffineMotion) -> None:
    """A flower of eight ellipses between the keyframes and, in ink, at them."""
    between = np.linspace(*motion.domain, 13)
    draw_body(axes, motion, eight_ellipses(), between, COLOURS[0], 0.18)
    draw_body(axes, motion, eight_ellipses(), KEYFRAMES.times, COLOURS[5], 0.55)
    draw_path(axes, motion)


STUDY = Study(
    "planar_keyframes",
    "What does optimisation change for a planar body that also changes its shape?",
    "HJK 5.2, figure 3",
    run,
    order=2,
)
