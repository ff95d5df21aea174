"""Methods that the classes of motions share: their pictures. Who only computes never imports Matplotlib."""

from typing import TYPE_CHECKING, Any, Literal

from numpy.typing import ArrayLike

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from symmotion.bodies.outlines import Body
    from symmotion.motions.keyframes import Keyframes


def plot_positions(
    self: Any,
    axes: "Axes | None" = None,
    *,
    body: "Body | None" = None,
    times: int | ArrayLike = 9,
    keyframes: "Keyframes | None" = None,
    colour: str | None = None,
    label: str | None = None,
) -> "Axes":
    """A body at several times and the path of its origin; arguments as for `plot_body`. Returns the axes."""
    from symmotion.views.body_plots import plot_body

    return plot_body(self, axes, body=body, times=times, keyframes=keyframes, colour=colour, label=label)


def plot_rates(self: Any, axes: "Axes | None" = None, *, kind: Literal["rate", "sphere"] = "rate") -> "Axes":
    """The body rate over time, or the moving unit vectors on the sphere; returns the axes."""
    from symmotion.views.motion_plots import plot_orientation

    return plot_orientation(self, axes, kind=kind)


def as_html(self: Any) -> str:
    """Facts and a picture, for notebooks."""
    from symmotion.views.notebook import motion_html

    return motion_html(self)
