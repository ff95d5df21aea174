"""A body along a motion, by one call: in the plane as it is, in space in a parallel view."""

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.bodies import Body, Shape
from symmotion.bodies.places import body_size
from symmotion.bodies.shapes import Up
from symmotion.errors import InputError
from symmotion.motions import Affine, Keyframes
from symmotion.motions.motion import Moving
from symmotion.views.canvas import (
    as_numbers,
    bears,
    fit_height,
    in_powers,
    on_axes,
    require_axes,
    require_colour,
    stamps,
    told,
)
from symmotion.views.parallel import draw_faces, lit, upright_view
from symmotion.views.style import COLOURS, INK

# Keyframes beyond this many are not drawn: their bodies would hide the motion.
MOST_KEYFRAMES = 12
# Directions of space, and times and numbers, are drawn once on axes that show several motions.
TRIAD, MARK = "_symmotion-triad", "_symmotion-mark"
# Of more keyframes as many as this are drawn.
MOST_COPIES = 24
MOST_TIMES = 1000


def plot_body(
    motion: Moving,
    axes: Axes | None = None,
    *,
    body: Shape | None = None,
    times: int | ArrayLike = 9,
    keyframes: Keyframes | None = None,
    colour: str | None = None,
    label: str | None = None,
    up: Up = "z",
) -> Axes:
    """A body at several times of a motion, and the path of its origin; returns the axes.

    Space is seen in parallel from (2, −3, 1.6), with its directions and a length beside: "up" is the axis of
    the motion that is upright, "z", or "y" as in files of BVH and glTF, seen from (2, 1.6, 3). Where
    the origin stays in its place, the bodies stand side by side over time.

    motion: called as `AffineMotion` is, in the plane or in space.
    axes: ordinary matplotlib Axes; those of a new figure when left out.
    body: of any form that `Body.of` takes; a letter F of a size that suits the motion when left out.
    times: how many, equally spaced, or which, (N,).
    keyframes: drawn dark and numbered; more than 12 are left out. colour: blue when left out;
        label: for a legend.

    Raises InputError for keyframes of another dimension, and axes or a body that cannot be drawn on or with.

    >>> motion = sm.interpolants.component_cubic(sm.examples.planar_keyframes())
    >>> with sm.views.new_figure() as figure:
    ...     axes = sm.views.plot_body(motion, figure.add_subplot(), times=5)
    """
    require_axes(axes)
    colour = COLOURS[0] if colour is None else colour
    t = _times(motion, times)
    path = motion(_dense(motion))
    place = motion(t)
    d = path.linear.shape[-1]
    _require_drawable(path, d)
    require_colour(colour)
    if keyframes is not None and (not isinstance(keyframes, Keyframes) or keyframes.dimension != d):
        raise InputError(f"keyframes {keyframes!r}: Keyframes in {d}D, as the motion, are needed")
    keyed = keyframes if keyframes is not None and len(keyframes) <= MOST_KEYFRAMES else None
    size, pinned = body_size(path, len(t))
    shape, view = Body.of(body, d, size=size, up=up), _view(d, up)
    if keyed is None:
        copies = [_Copies(t, place, colour, view, _ends(t))]
    else:
        copies = _with_keyframes(motion, t, keyed, colour, view)
    if pinned:
        return _plot(axes, shape, _side_by_side(copies, shape), None, colour, label, strip=True)
    return _plot(axes, shape, copies, path.translation, colour, label)


def plot_keyframes(
    keyframes: Keyframes,
    axes: Axes | None = None,
    *,
    body: Shape | None = None,
    colour: str | None = None,
    label: str | None = None,
    up: Up = "z",
) -> Axes:
    """A body at keyframes, numbered where they are 12 or fewer; arguments as for `plot_body`, but black.

    Of more than 24 keyframes that many are drawn, spread evenly.
    """
    require_axes(axes)
    colour = INK if colour is None else colour
    require_colour(colour)
    d = keyframes.dimension
    place = Affine(keyframes.linear, keyframes.translation)
    size, pinned = body_size(place, min(len(keyframes), MOST_COPIES))
    shape = Body.of(body, d, size=size, up=up)
    if len(keyframes) > MOST_COPIES:
        keyframes = keyframes[np.linspace(0, len(keyframes) - 1, MOST_COPIES).round().astype(int)]
    copies = [_at_keyframes(keyframes, colour, _view(d, up))]
    if pinned:
        return _plot(axes, shape, _side_by_side(copies, shape), None, colour, label, strip=True)
    return _plot(axes, shape, copies, None, colour, label)


@dataclass(frozen=True, eq=False)
class _Copies:
    """Copies of the body that are drawn alike; view: (d, d) its directions; marks: (which, text) of those with one."""

    times: np.ndarray
    place: Affine
    colour: str
    view: np.ndarray
    marks: tuple[tuple[int, str], ...] = ()
    dark: bool = False

    def polygons(self, body: Body) -> list[np.ndarray]:
        """The faces of all copies, in space in the directions right, up and near."""
        return body.polygons(self.place(body.vertices) @ self.view)


def _ends(t: np.ndarray) -> tuple[tuple[int, str], ...]:
    ends = sorted({0, len(t) - 1})
    return tuple((i, f"t = {text}") for i, text in zip(ends, stamps(t[ends]), strict=True))


def _view(dimension: int, up: Up) -> np.ndarray:
    """(d, d) the directions of the picture, in space right, up and towards the viewer."""
    view = upright_view(up)
    return view if dimension == 3 else np.eye(2)


def _at_keyframes(keyframes: Keyframes, colour: str, view: np.ndarray) -> _Copies:
    t, few = keyframes.times, len(keyframes) <= MOST_KEYFRAMES
    names = dict(_ends(t))
    marks = tuple((i, f"{i} ({names[i]})" if i in names else str(i)) for i in range(len(t) if few else 0))
    return _Copies(t, Affine(keyframes.linear, keyframes.translation), colour, view, marks, True)


def _with_keyframes(
    motion: Moving, t: np.ndarray, keyframes: Keyframes, colour: str, view: np.ndarray
) -> list[_Copies]:
    """Copies at times and at keyframes, none twice."""
    # Relative to their span: seconds since 1970 are all alike relative to their size.
    between = t[~np.isclose(t[:, None], keyframes.times, rtol=0, atol=1e-9 * np.ptp(t)).any(axis=1)]
    return [_Copies(between, motion(between), colour, view), _at_keyframes(keyframes, INK, view)]


def _side_by_side(copies: list[_Copies], body: Body) -> list[_Copies]:
    """Copies set apart along the horizontal, in the order of their times."""
    polygons = [p for c in copies for p in c.polygons(body)]
    step = 1.15 * (max(p[:, 0].max() for p in polygons) - min(p[:, 0].min() for p in polygons))
    order = np.unique(np.concatenate([c.times for c in copies]))
    moved = []
    for c in copies:
        across = step * np.searchsorted(order, c.times)
        place = Affine(c.place.linear, across[:, None] * c.view[:, 0])
        moved.append(replace(c, place=place, marks=()))
    return moved


def _plot(
    axes: Axes | None,
    body: Body,
    copies: list[_Copies],
    path: np.ndarray | None,
    colour: str,
    label: str | None,
    strip: bool = False,
) -> Axes:
    spatial, view = body.dimension == 3, copies[0].view
    with on_axes(axes) as target:
        if path is not None:
            seen = path @ view
            target.plot(seen[:, 0], seen[:, 1], color=colour, linewidth=1.0, label=label, zorder=1.5 if spatial else 3)
        elif label is not None:
            target.plot([], [], color=colour, label=label)
        (_draw_solid if spatial else _draw_flat)(target, copies, body)
        if any(c.marks for c in copies) and not bears(target, MARK):
            target.margins(0.05, 0.12)
            for c in copies:
                _draw_marks(target, c, body)
        target.set_aspect("equal")
        target.grid(False)
        target.autoscale_view()
        if spatial and not bears(target, TRIAD):
            _draw_triad(target, view, measured=not strip)
        if strip:
            _time_axis(target, copies)
        elif spatial:
            target.set_axis_off()
        else:
            target.set_xlabel("x")
            target.set_ylabel("y")
        if axes is None:
            if not spatial and not strip:
                in_powers(target)
            fit_height(target)
    return target


def _draw_flat(axes: Axes, copies: list[_Copies], body: Body) -> None:
    for c in copies:
        strength = 0.55 if c.dark else 0.2
        face, edge = (*to_rgb(c.colour), strength), (*to_rgb(c.colour), 1.0 if c.dark else 0.75)
        axes.add_collection(PolyCollection(c.polygons(body), facecolors=[face], edgecolors=[edge], linewidths=0.7))


def _draw_solid(axes: Axes, copies: list[_Copies], body: Body) -> None:
    """Faces of all copies, shaded, what is far behind what is near."""
    faces, shares, bases, edges = [], [], [], []
    for c in copies:
        base, polygons = np.array(to_rgb(c.colour)), c.polygons(body)
        faces += polygons
        shares.append((0.75 - 0.45 * lit(polygons)) if c.dark else (0.5 - 0.35 * lit(polygons)))
        bases += [base] * len(polygons)
        edges += [base if c.dark else 1 - 0.85 * (1 - base)] * len(polygons)
    colours = 1 - np.concatenate(shares)[:, None] * (1 - np.array(bases))
    draw_faces(axes, faces, colours, edges, joined="round", zorder=2)


def _draw_marks(axes: Axes, copies: _Copies, body: Body) -> None:
    """Texts below copies; of two in the same place one text."""
    polygons, each = copies.polygons(body), len(body.faces)
    written: list[tuple[np.ndarray, str]] = []
    for i, text in copies.marks:
        points = np.concatenate(polygons[i * each : (i + 1) * each])[:, :2]
        foot = np.array([(points[:, 0].min() + points[:, 0].max()) / 2, points[:, 1].min()])
        size = np.ptp(points, axis=0).max()
        same = next((k for k, (at, _) in enumerate(written) if np.linalg.norm(foot - at) < 0.3 * size), None)
        if same is None:
            written.append((foot, text))
        else:
            written[same] = (written[same][0], f"{written[same][1]}, {text}")
    for foot, text in written:
        below = axes.annotate(text, (foot[0], foot[1]), (0, -2), textcoords="offset points", label=MARK)
        below.set(ha="center", va="top", fontsize="small")


def _draw_triad(axes: Axes, view: np.ndarray, measured: bool) -> None:
    """The directions of space left of the picture, each of a round length, which is written below."""
    (low, bottom), (high, top) = axes.dataLim.min, axes.dataLim.max
    # Of a motion that shrinks everything to a point there is still a picture.
    room = 0.16 * (max(high - low, top - bottom) or 1.0)
    power = 10.0 ** np.floor(np.log10(room))
    length = float(power * max(k for k in (1, 2, 5) if k * power <= room * (1 + 1e-9)))
    length = length if measured else 0.5 * room
    arms = length * view[:, :2]
    origin = np.array([low - 1.6 * room, bottom + 0.5 * room])
    for arm, name in zip(arms, "xyz", strict=True):
        axes.plot(*(np.stack([origin, origin + arm]).T), color=INK, linewidth=0.8, solid_capstyle="round")
        axes.annotate(
            name, tuple(origin + 1.25 * arm), ha="center", va="center", fontsize="small", style="italic", label=TRIAD
        )
    if measured:
        foot = (origin[0], origin[1] + min(arms[:, 1].min(), 0.0))
        text = f"each {length:g}"
        axes.annotate(text, foot, (0, -8), textcoords="offset points", ha="center", va="top", fontsize="small")


def _time_axis(axes: Axes, copies: list[_Copies]) -> None:
    """Ticks under copies that stand side by side, some of them where they are many."""
    t = np.concatenate([c.times for c in copies])
    at = np.concatenate([c.place.translation @ c.view[:, 0] for c in copies])
    order = np.argsort(at)
    order = order[:: -(-len(order) // 10)]
    ticks, name = told(t[order])
    axes.set_xticks(at[order], stamps(ticks, 3))
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    axes.spines["bottom"].set_bounds(at.min(), at.max())
    axes.set_xlabel(name)


def _times(motion: Moving, times: int | ArrayLike) -> np.ndarray:
    if isinstance(times, int | np.integer):
        return np.linspace(*motion.domain, checks.whole(times, 1, "times", " of bodies", most=MOST_TIMES))
    t = as_numbers(times, "times")
    if t.ndim != 1 or not len(t):
        raise InputError(f"times of shape {t.shape}: a number of them, or times (N,), N ≥ 1, is needed")
    return np.sort(t)


def _dense(motion: Moving) -> np.ndarray:
    """(N,) times close enough for a smooth path, however many keyframes there are."""
    basis = getattr(motion, "basis", None)
    spans = 50 if basis is None else len(basis.breakpoints)
    return np.linspace(motion.domain[0], motion.domain[1], int(np.clip(8 * spans, 300, 2000)))


def _require_drawable(path: Affine, d: int) -> None:
    if d not in (2, 3):
        raise InputError(f"a motion in {d}D has no picture: 2 or 3 dimensions are needed")
    if not (np.isfinite(path.linear).all() and np.isfinite(path.translation).all()):
        raise InputError("the motion is not finite everywhere: it has no picture")
