"""Pictures that show how fair a two-parameter motion is, on axes that the caller brings."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm, to_rgb
from numpy.typing import ArrayLike

from symmotion.bodies import Body, Shape
from symmotion.errors import InputError
from symmotion.motions.rational import RationalMotion
from symmotion.motions.two_parameter import TwoParameterMotion
from symmotion.views.parallel import DIRECTION, ISOPHOTES_LIGHT, bare, draw_faces, lit, view_from
from symmotion.views.style import COLOURS, INK

Image = Literal["rotation", "dual", "trajectory"]


@dataclass(frozen=True, eq=False)
class Patch:
    """Samples of a surface; points, normals: (U, V, 3), normals of length 1."""

    points: np.ndarray
    normals: np.ndarray


def sample_patch(
    motion: TwoParameterMotion,
    image: Image = "rotation",
    point: ArrayLike = (0.0, 0.0, 0.0),
    *,
    samples: int = 120,
    region: tuple[tuple[float, float], tuple[float, float]] | None = None,
    reference: ArrayLike | None = None,
) -> Patch:
    """samples × samples points of a surface of a motion, with analytic normals X_u × X_v / |X_u × X_v|.

    image: "rotation", the quaternion surface in E³ (`TwoParameterMotion.rodrigues`, seen from
    `reference`); "dual", that of the dual part (`dual_image`); "trajectory", of a body point.
    region: intervals of u and v, the domain when left out.

    Raises InputError where the surface has no normal at a sample.

    >>> patch = sm.views.sample_patch(sm.motions.smooth_net(6), samples=20)
    >>> patch.points.shape
    (20, 20, 3)
    """
    (a, b), (c, d) = motion.domain if region is None else region
    u, v = np.linspace(a, b, samples)[:, None], np.linspace(c, d, samples)

    def surface(nu: tuple[int, int]) -> np.ndarray:
        if image == "rotation":
            mean = motion.mean_rotation if reference is None else reference
            return motion.rodrigues(u, v, nu, mean)
        if image == "dual":
            return motion.dual_image(u, v, nu)
        return motion.trajectory(point, u, v, nu)[..., 0, :]

    normals = np.cross(surface((1, 0)), surface((0, 1)))
    lengths = np.linalg.norm(normals, axis=-1, keepdims=True)
    if not (lengths > 0).all():
        raise InputError("the surface has no normal everywhere: choose another body point or image")
    return Patch(surface((0, 0)), normals / lengths)


def facing(patch: Patch) -> np.ndarray:
    """(3,) a direction to see a surface from: half-way between its mean normal and one tilted by 45°.

    patch: the surface.

    >>> sm.views.facing(sm.views.sample_patch(sm.motions.smooth_net(6), samples=20)).shape
    (3,)
    """
    normal = patch.normals.mean(axis=(0, 1))
    span = patch.points[-1].mean(axis=0) - patch.points[0].mean(axis=0)
    return normal / np.linalg.norm(normal) + 0.5 * span / np.linalg.norm(span)


def draw_isophotes(
    axes: Axes,
    patch: Patch,
    light: ArrayLike = ISOPHOTES_LIGHT,
    levels: int = 24,
    direction: ArrayLike | None = None,
    colour: str = COLOURS[0],
) -> None:
    """Isophotes of a surface, the curves N · light = c for equally spaced c, in a parallel view (PCG (20)).

    A surface of class C² has isophotes of class C¹: where the third derivatives jump they have corners
    in their curvature, where the surface is bumpy they wave.

    Where the surface folds in the view, so that its isophotes lie over each other, the fold is dashed and named.

    direction: of the view, `facing` when left out.

    axes: of Matplotlib; patch: the surface; light: (3,) from where it comes; levels: how many values of c; colour: of
    the curves.

    >>> patch = sm.views.sample_patch(sm.motions.smooth_net(6), samples=20)
    >>> with sm.views.new_figure() as figure:
    ...     sm.views.draw_isophotes(figure.add_subplot(), patch)
    """
    view = view_from(facing(patch) if direction is None else direction)
    seen = patch.points @ view
    cosine = patch.normals @ (np.asarray(light, dtype=float) / np.linalg.norm(light))
    steps = np.linspace(cosine.min(), cosine.max(), levels + 2)[1:-1]
    axes.contour(seen[..., 0], seen[..., 1], cosine, levels=steps, colors=colour, linewidths=0.7, linestyles="solid")
    side = patch.normals @ view[:, 2]
    if side.min() < 0 < side.max():
        axes.contour(seen[..., 0], seen[..., 1], side, levels=[0.0], colors=INK, linewidths=0.9, linestyles="dashed")
        axes.text(0.5, 0.0, "folds along the dashed line", transform=axes.transAxes, ha="center", va="top", fontsize=7)
    _draw_border(axes, seen)
    bare(axes)


def draw_zebra(
    axes: Axes,
    patch: Patch,
    direction: ArrayLike | None = None,
    stripes: int = 14,
    colour: str = COLOURS[0],
) -> None:
    """Zebra stripes: what a shiny surface reflects of parallel strip lights; direction as for `draw_isophotes`.

    axes: of Matplotlib; patch: the surface; colour: of the stripes.

    >>> patch = sm.views.sample_patch(sm.motions.smooth_net(6), samples=20)
    >>> with sm.views.new_figure() as figure:
    ...     sm.views.draw_zebra(figure.add_subplot(), patch)
    """
    view = view_from(facing(patch) if direction is None else direction)
    seen = patch.points @ view
    eye = view[:, 2]
    mirrored = 2 * (patch.normals @ eye)[..., None] * patch.normals - eye
    # The angle of the mirrored ray about the strips' direction: equal angles, equal strips.
    angle = np.unwrap(np.unwrap(np.arctan2(mirrored @ view[:, 1], mirrored @ eye), axis=0), axis=1)
    levels = np.linspace(angle.min(), angle.max() + 1e-12, 2 * stripes + 1)
    colours = [(*to_rgb(colour), 0.85), (*to_rgb(colour), 0.08)] * stripes
    axes.contourf(seen[..., 0], seen[..., 1], angle, levels=levels, colors=colours)
    _draw_border(axes, seen)
    bare(axes)


def _draw_border(axes: Axes, seen: np.ndarray) -> None:
    border = np.concatenate([seen[:, 0], seen[-1], seen[::-1, -1], seen[0, ::-1]])
    axes.plot(border[:, 0], border[:, 1], color=INK, linewidth=0.8)


def draw_net(axes: Axes, net: np.ndarray, direction: ArrayLike = DIRECTION, colour: str = COLOURS[0]) -> None:
    """A control net (n, m, 3) as its lines in a parallel view.

    axes: of Matplotlib; direction: seen from there; colour: of the lines.

    >>> net = sm.motions.smooth_net(6, spatial=True)
    >>> with sm.views.new_figure() as figure:
    ...     sm.views.draw_net(figure.add_subplot(), net.real[..., 1:])
    """
    seen = (net @ view_from(direction))[..., :2]
    lines = [*seen, *np.swapaxes(seen, 0, 1)]
    axes.add_collection(LineCollection(lines, colors=colour, linewidths=0.8))
    axes.plot(seen[..., 0].ravel(), seen[..., 1].ravel(), ".", color=INK, markersize=2.5)
    bare(axes)


def draw_fairness(
    axes: Axes, motion: TwoParameterMotion, fairness: np.ndarray, limits: tuple[float, float] | None = None
) -> ScalarMappable:
    """A heat map of L_kl at the interior knots, logarithmic; returns what a colour bar takes.

    fairness: (K, L); limits: of the colours, those of the values when left out.

    axes: of Matplotlib; motion: whose knots they are.

    >>> net = sm.motions.noisy_net(sm.motions.smooth_net(6), 0.01, seed=1)
    >>> with sm.views.new_figure() as figure:
    ...     colours = sm.views.draw_fairness(figure.add_subplot(), net, sm.fair(net, max_steps=0).before)
    """
    u, v = (b.origin + b.knots[4 : b.n] for b in motion.bases)
    positive = fairness[fairness > 0]
    low, high = limits or ((positive.min(), positive.max()) if positive.size else (1e-16, 1.0))
    norm = LogNorm(low, max(high, low * 1.001), clip=True)
    mesh = axes.pcolormesh(
        _borders(u),
        _borders(v),
        np.maximum(fairness, low).T,
        norm=norm,
        cmap="cividis",
        edgecolors="face",
        linewidth=0.2,
    )
    axes.set_aspect("equal")
    axes.grid(False)
    axes.set_xlabel("u")
    axes.set_ylabel("v")
    return mesh


def _borders(knots: np.ndarray) -> np.ndarray:
    """The borders of cells about the knots."""
    if len(knots) == 1:
        return knots[0] + np.array([-0.5, 0.5])
    middle = (knots[1:] + knots[:-1]) / 2
    return np.r_[2 * knots[0] - middle[0], middle, 2 * knots[-1] - middle[-1]]


def draw_bodies(
    axes: Axes,
    linear: np.ndarray,
    translation: np.ndarray,
    body: Shape,
    direction: ArrayLike = DIRECTION,
    colour: str = COLOURS[0],
) -> None:
    """A body at positions (…, 3, 3) and (…, 3) in a parallel view, shaded, what is far behind what is near.

    axes: of Matplotlib; linear, translation: of the positions; direction: seen from there; colour: of the body.

    Raises InputError for a body that is none.

    >>> with sm.views.new_figure() as figure:
    ...     sm.views.draw_bodies(figure.add_subplot(), np.eye(3)[None], np.zeros((1, 3)), sm.bodies.jug())
    """
    view = view_from(direction)
    linear, translation = linear.reshape(-1, 3, 3), translation.reshape(-1, 3)
    shape = Body.of(body, 3)
    points = translation[:, None] + shape.vertices @ np.swapaxes(linear, 1, 2)
    corners = shape.polygons(points @ view)
    shade = 0.35 + 0.65 * lit(corners)
    colours = 1 - (1 - np.array(to_rgb(colour))) * (1.25 - 0.75 * shade[:, None])
    # Tens of thousands of small faces: as vectors they would be most of the page.
    draw_faces(axes, corners, np.clip(colours, 0, 1), width=0.2, rasterized=True)
    bare(axes)


def draw_body_along(
    axes: Axes,
    motion: TwoParameterMotion | RationalMotion,
    body: Shape,
    *parameters: ArrayLike,
    spread: tuple[float, float] = (0.0, 0.0),
    direction: ArrayLike = DIRECTION,
    colour: str = COLOURS[0],
) -> None:
    """A body along a motion at parameters that broadcast: u and v, of a one-parameter motion t.

    spread: of a spherical two-parameter motion, which turns the body on the spot, how far the
    copies are set apart per unit of u along x and of v along y.

    axes: of Matplotlib; direction: seen from there; colour: of the body.

    Raises InputError for a body that is none.

    >>> net = sm.motions.smooth_net(6, spatial=True)
    >>> with sm.views.new_figure() as figure:
    ...     sm.views.draw_body_along(figure.add_subplot(), net, sm.bodies.wedge(0.3), [3.0, 4.0], [3.0, 5.0])
    """
    if isinstance(motion, TwoParameterMotion):
        u, v = np.broadcast_arrays(*(np.asarray(p, dtype=float) for p in parameters))
        linear, translation = motion(u, v)
        translation = translation + np.stack([spread[0] * u, spread[1] * v, np.zeros_like(u)], axis=-1)
    else:
        linear, translation = motion(parameters[0])
    draw_bodies(axes, linear, translation, body, direction, colour)
