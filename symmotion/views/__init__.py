"""Pictures of motions and solutions, notebook display and films; Matplotlib is loaded by who draws."""

from symmotion.views.body_plots import plot_body
from symmotion.views.canvas import FONT, HEIGHT, WIDTH, fit_height
from symmotion.views.drawing import (
    draw_body,
    draw_deviation,
    draw_ellipsoid,
    draw_inner_products,
    draw_kkt,
    draw_path,
    nearly_rigid,
)
from symmotion.views.fairing_figures import (
    draw_bodies,
    draw_body_along,
    draw_fairness,
    draw_isophotes,
    draw_net,
    draw_zebra,
    facing,
    sample_patch,
)
from symmotion.views.films import write_animation
from symmotion.views.meshes import draw_curve, draw_mesh
from symmotion.views.parallel import DIRECTION, VIEW, view_from
from symmotion.views.spheres import draw_curve as draw_sphere_curve
from symmotion.views.spheres import draw_outlines, draw_sphere, on_sphere
from symmotion.views.spheres import draw_points as draw_sphere_points
from symmotion.views.style import COLOURS, INK, method_style, new_figure

__all__ = [
    "COLOURS",
    "DIRECTION",
    "FONT",
    "HEIGHT",
    "INK",
    "VIEW",
    "WIDTH",
    "draw_bodies",
    "draw_body",
    "draw_body_along",
    "draw_curve",
    "draw_deviation",
    "draw_ellipsoid",
    "draw_fairness",
    "draw_inner_products",
    "draw_isophotes",
    "draw_kkt",
    "draw_mesh",
    "draw_net",
    "draw_outlines",
    "draw_path",
    "draw_sphere",
    "draw_sphere_curve",
    "draw_sphere_points",
    "draw_zebra",
    "facing",
    "fit_height",
    "method_style",
    "nearly_rigid",
    "new_figure",
    "on_sphere",
    "plot_body",
    "sample_patch",
    "view_from",
    "write_animation",
]
