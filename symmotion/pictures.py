"""The one place that looks up: how motions, solutions and results draw, film and show themselves, by `symmotion.views`.

Each function becomes a method of classes that lie below the pictures. Who only computes never imports Matplotlib.
"""

from typing import TYPE_CHECKING, Literal

from numpy.typing import ArrayLike

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from symmotion.answers import Band
    from symmotion.bodies import Shape
    from symmotion.bodies.places import Oriented
    from symmotion.bodies.shapes import Up
    from symmotion.fairing import FairingResult
    from symmotion.files.formats import FilePath
    from symmotion.motions import Keyframes, RigidSamples, TwoParameterMotion
    from symmotion.motions.motion import Moving
    from symmotion.solvers import Comparison, Solution
    from symmotion.views.solutions import Drawn

# Of a film, as those of `write_animation`.
FILM_SECONDS, FRAMES_PER_SECOND = 4.0, 20.0


def plot_positions(
    self: "Moving",
    axes: "Axes | None" = None,
    *,
    body: "Shape | None" = None,
    times: int | ArrayLike = 9,
    keyframes: "Keyframes | None" = None,
    colour: str | None = None,
    label: str | None = None,
    up: "Up" = "z",
) -> "Axes":
    """A body at several times and the path of its origin; arguments as for `symmotion.views.plot_body`."""
    from symmotion.views.body_plots import plot_body

    return plot_body(self, axes, body=body, times=times, keyframes=keyframes, colour=colour, label=label, up=up)


def plot_keyframes(
    self: "Keyframes",
    axes: "Axes | None" = None,
    *,
    body: "Shape | None" = None,
    colour: str | None = None,
    label: str | None = None,
    up: "Up" = "z",
) -> "Axes":
    """A body at the keyframes; arguments as for the `plot` of motions. Returns the axes."""
    from symmotion.views.body_plots import plot_keyframes

    return plot_keyframes(self, axes, body=body, colour=colour, label=label, up=up)


def plot_rates(self: "Oriented", axes: "Axes | None" = None, *, kind: Literal["rate", "sphere"] = "rate") -> "Axes":
    """The body rate over time, or the moving unit vectors on the sphere; returns the axes."""
    from symmotion.views.motion_plots import plot_orientation

    return plot_orientation(self, axes, kind=kind)


def plot_net(self: "TwoParameterMotion", axes: "Axes | None" = None, *, point: ArrayLike | None = None) -> "Axes":
    """The trajectory surface of a body point (3,) by its parameter lines; returns the axes.

    Of the origin when left out, and of a spherical motion, whose origin stays, the quaternion surface in E³.
    """
    from symmotion.views.motion_plots import plot_net

    return plot_net(self, axes, point=point)


def plot_deviations(self: "RigidSamples", axes: "Axes | None" = None) -> "Axes":
    """The deviations over time; returns the axes."""
    from symmotion.views.motion_plots import plot_deviations

    return plot_deviations(self, axes)


def plot_solution(
    self: "Solution",
    axes: "Axes | None" = None,
    *,
    kind: Literal["motion", "convergence", "multipliers", "band"] | None = None,
    up: "Up" = "z",
) -> "Axes":
    """The motion with its keyframes, the convergence, the multipliers, or how well a fit is known; returns the axes.

    kind: when left out, the motion where it has a picture, else the convergence; up: as for the `plot` of motions.
    """
    from symmotion.views.plots import plot_solution

    return plot_solution(self, axes, kind=kind, up=up)


def plot_band(self: "Band", axes: "Axes | None" = None) -> "Axes":
    """The origin's coordinates over time, two standard deviations wide, and two of the turn; returns the axes."""
    from symmotion.views.plots import plot_band

    return plot_band(self, axes)


def plot_comparison(self: "Comparison", axes: "Axes | None" = None) -> "Axes":
    """Stationarity over the iterations, solver by solver; returns the axes."""
    from symmotion.views.plots import plot_comparison

    return plot_comparison(self, axes)


def plot_fairing(
    self: "FairingResult", axes: "Axes | None" = None, *, kind: Literal["history", "knots"] = "history"
) -> "Axes":
    """G over the steps, or what is left of it at the knots; returns the axes."""
    from symmotion.views.plots import plot_fairing

    return plot_fairing(self, axes, kind=kind)


def as_html(self: "Drawn") -> str:
    """Facts and a picture, for notebooks."""
    from symmotion.views.notebook import html_of

    return html_of(self)


def write_film(
    motion: "Moving | Oriented",
    path: "FilePath",
    *,
    body: "Shape | None" = None,
    seconds: float = FILM_SECONDS,
    fps: float = FRAMES_PER_SECOND,
    up: "Up" = "z",
) -> None:
    """Write a film; see `write_animation`."""
    from symmotion.views.films import write_animation

    write_animation(motion, path, body, seconds=seconds, fps=fps, up=up)


def check_film(
    path: "FilePath",
    *,
    body: object = None,
    seconds: float = FILM_SECONDS,
    fps: float = FRAMES_PER_SECOND,
    up: object = None,
) -> None:
    """Raise InputError where there is no way to such a film."""
    from symmotion.views.films import plan

    plan(path, seconds, fps)
