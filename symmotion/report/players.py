"""Motions as players of the page: sampled to piecewise cubics, with a still picture for where no script runs."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from symmotion.bodies.quads import QuadMesh
from symmotion.errors import InputError
from symmotion.motions import Affine, Keyframes, PoseMotion
from symmotion.motions.quaternions import QuaternionMotion
from symmotion.report.stills import Moving, Shape, motion_colours, still
from symmotion.report.values import Body, Figure, Player, Track, require_name
from symmotion.splines import BSplineBasis, Spline
from symmotion.views.drawing import letter_k
from symmotion.views.fairing_figures import DIRECTION

ACCURACY = 3e-4  # of what the motion spans: a fifth of a pixel of a player
FIRST, MOST = 9, 129  # times of a track at first and at most
TOLERATED = 1e-2  # of what the motion spans
SHORTEST = 1e-6  # of all time: a step within which a motion may jump


def player(
    name: str,
    motions: Mapping[str, Moving],
    body: Shape,
    caption: str,
    keyframes: Keyframes | None = None,
    *,
    picture: Figure | None = None,
    unit: str = "",
    direction: ArrayLike = DIRECTION,
    centre: ArrayLike | None = None,
    span: tuple[float, float] | None = None,
    alt: str = "",
) -> Player:
    """A player of a body under motions, by their labels; of two the first is before, the second after.

    body: closed polygons (P, d), or a mesh in space; keyframes: stay in sight; picture: a figure of
    the study that shows the same, drawn here when left out; direction: from where a body in space
    is seen first; centre: the body point whose path is drawn, the origin when left out; span: the
    times shown, all when left out. Two tracks of 33 times in space are about 10 kB of the page.

    Raises InputError where body, motions and keyframes are not of one dimension, or a motion bends too often.
    """
    shape = _as_body(name, body)
    require_name("player", name)
    if not motions:
        raise InputError(f"player {name!r}: at least one motion is needed")
    if span is not None:
        motions = {label: Clipped(motion, _within(name, label, motion, span)) for label, motion in motions.items()}
    corners, d = np.array(shape.corners), len(shape.corners[0])
    for label, motion in motions.items():
        if (found := motion(motion.domain[0]).translation.shape) != (d,):
            raise InputError(f"player {name!r}, {label!r}: a motion in dimension {found} for a body in dimension {d}")
    if keyframes is not None and keyframes.dimension != d:
        raise InputError(f"player {name!r}: keyframes in dimension {keyframes.dimension}, the body in {d}")
    if (found := np.shape(direction)) != (3,) or not np.any(direction):
        raise InputError(f"player {name!r}: direction of shape {found}: three numbers, not all zero, are needed")
    if centre is not None and np.shape(centre) != (d,):
        raise InputError(f"player {name!r}: centre of shape {np.shape(centre)}: ({d},) is needed")
    eye, middle = np.asarray(direction, dtype=float), np.zeros(d) if centre is None else np.asarray(centre, dtype=float)
    if picture is None:
        picture = still(name, motions, body, keyframes, eye, middle, caption)
    size = max(_extent(m, corners) for m in motions.values())
    radius = float(np.abs(corners).max())
    return Player(
        name,
        shape,
        tuple(
            sampled(label, colour, motion, corners, ACCURACY * size)
            for (label, motion), colour in zip(motions.items(), motion_colours(len(motions)), strict=True)
        ),
        picture,
        caption,
        alt,
        () if keyframes is None else _rows(_flat(Affine(keyframes.linear, keyframes.translation)), size, radius),
        unit,
        tuple(round(float(x), 4) for x in eye),
        tuple(round(float(x), 4) for x in middle),
    )


@dataclass(frozen=True, eq=False)
class Clipped:
    """A motion between two times of its own."""

    motion: Moving
    domain: tuple[float, float]

    def __call__(self, t: Any, nu: int = 0) -> Affine:
        return self.motion(t, nu)


@dataclass(frozen=True, eq=False)
class Travelling:
    """The motion that carries a body along a curve, a function of t and nu, without turning it."""

    curve: Callable[[Any, int], np.ndarray]
    domain: tuple[float, float]

    def __call__(self, t: Any, nu: int = 0) -> Affine:
        place = np.asarray(self.curve(t, nu))
        d = place.shape[-1]
        return Affine(np.broadcast_to(np.eye(d) if nu == 0 else np.zeros((d, d)), (*place.shape, d)), place)


def turning(curve: QuaternionMotion) -> PoseMotion:
    """The motion that turns a body on the spot."""
    return PoseMotion(curve, Spline(BSplineBasis.clamped(curve.domain, 1), np.zeros((2, 3))))


def wedge(size: float = 1.0) -> list[np.ndarray]:
    """A long body with a nose and a flat belly, polygons (P, 3) of length `size`, so that its orientation is seen."""
    back, nose = np.array([[-0.5, -0.3], [-0.5, 0.3]]), np.array([[0.5, 0.08], [0.5, -0.08]])
    plan = size * np.concatenate([back, nose])
    height = size * np.array([0.22, 0.22, 0.06, 0.06])
    low = np.column_stack([plan, np.full(4, -0.06 * size)])
    high = np.column_stack([plan, height])
    sides = [np.stack([low[i - 1], low[i], high[i], high[i - 1]]) for i in range(4)]
    return [low, high, *sides]


def fitting_body(keyframes: Keyframes) -> list[np.ndarray]:
    """A letter K, or a wedge in space, of a size that suits how far apart the keyframes are."""
    steps = np.linalg.norm(np.diff(keyframes.translation, axis=0), axis=1)
    stretch = np.linalg.norm(keyframes.linear, 2, axis=(1, 2)).mean()
    size = 0.6 * float(np.median(steps) or steps.max() or 1.0) / max(float(stretch), 1e-12)
    return [size * polygon for polygon in letter_k()] if keyframes.dimension == 2 else wedge(size)


def sampled(label: str, colour: str, motion: Moving, corners: np.ndarray, accuracy: float) -> Track:
    """The motion as cubics between times that are put where they are needed.

    Every step is halved where the cubic misses a body point (P, d) by more than `accuracy`, up to
    129 times; numbers are rounded to about a hundredth of that. Raises InputError where that many
    leave a hundredth of what the motion spans.
    """
    box = np.array(np.meshgrid(*np.stack([corners.min(axis=0), corners.max(axis=0)]).T)).reshape(corners.shape[1], -1).T
    times = np.linspace(*motion.domain, FIRST)
    while (missed := _missed(motion, times, box)).max() > accuracy and len(times) < MOST:
        worst = np.argsort(-missed)[: MOST - len(times)]
        worst = worst[missed[worst] > accuracy]
        times = np.sort(np.append(times, (times[worst] + times[worst + 1]) / 2))
    if missed.max() > TOLERATED / ACCURACY * accuracy:
        raise InputError(f"{label!r}: the motion bends too often for {MOST} times: choose a shorter span")
    size, radius = accuracy / ACCURACY, float(np.abs(corners).max())
    step = float(np.diff(times).max())
    # As many digits as keep the closest times apart.
    digits = 4 - int(np.floor(np.log10(np.diff(times).min())))
    return Track(
        label,
        colour,
        tuple(round(float(t), digits) + 0.0 for t in times),
        _rows(_flat(motion(times)), size, radius),
        _rows(_flat(motion(times, 1)), size / step, radius),
    )


def _within(name: str, label: str, motion: Moving, span: tuple[float, float]) -> tuple[float, float]:
    (a, b), (low, high) = span, motion.domain
    if not low <= a < b <= high:
        raise InputError(
            f"player {name!r}: span {a:g} to {b:g}: times from {low:g} to {high:g} of {label!r} are needed"
        )
    return span


def _missed(motion: Moving, times: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(N − 1,) how far body points are off in each step, at its quarters; 0 where it is too short to be seen."""
    from scipy.interpolate import CubicHermiteSpline  # here, as in `splines`: it takes a tenth of a second

    between = (times[:-1, None] + np.diff(times)[:, None] * [0.25, 0.5, 0.75]).ravel()
    cubic = CubicHermiteSpline(times, _flat(motion(times)), _flat(motion(times, 1)))
    off = (cubic(between) - _flat(motion(between))).reshape(len(times) - 1, 3, -1)
    d = points.shape[1]
    away = off[..., None, d * d :] + points @ np.swapaxes(off[..., : d * d].reshape(*off.shape[:2], d, d), -1, -2)
    seen = np.diff(times) > SHORTEST * (times[-1] - times[0])
    return np.where(seen, np.linalg.norm(away, axis=-1).max(axis=(1, 2)), 0.0)


def _flat(position: Affine) -> np.ndarray:
    """(N, d² + d) poses: each matrix row by row, then the translation."""
    return np.concatenate([position.linear.reshape(len(position.linear), -1), position.translation], axis=1)


def _extent(motion: Moving, corners: np.ndarray) -> float:
    """The diagonal of the box that the body passes through."""
    linear, translation = motion(np.linspace(*motion.domain, 65))
    places = translation[:, None] + corners @ np.swapaxes(linear, 1, 2)
    return float(np.linalg.norm(np.ptp(places.reshape(-1, places.shape[-1]), axis=0)))


def _rows(rows: np.ndarray, size: float, radius: float) -> tuple[tuple[float, ...], ...]:
    """Poses rounded to five digits of what they span."""
    d = 2 if rows.shape[1] == 6 else 3
    places, turns = (4 - int(np.floor(np.log10(s))) for s in (size, size / radius))
    rounded = np.concatenate([np.round(rows[:, : d * d], turns), np.round(rows[:, d * d :], places)], axis=1)
    return tuple(tuple(row) for row in (rounded + 0.0).tolist())  # without −0


def _as_body(name: str, body: Shape) -> Body:
    if not isinstance(body, QuadMesh):
        shapes = {np.shape(polygon)[1:] for polygon in body}
        if not body or len(shapes) > 1 or shapes.pop() not in ((2,), (3,)) or min(map(len, body)) < 3:
            raise InputError(f"player {name!r}: closed polygons (P, 2) or (P, 3), P ≥ 3, are needed as a body")
    points = body.vertices if isinstance(body, QuadMesh) else np.concatenate(list(body))
    if not np.isfinite(points).all() or not np.ptp(points, axis=0).any():
        raise InputError(f"player {name!r}: a body of finite corners that do not coincide is needed")
    digits = 3 - int(np.floor(np.log10(np.ptp(points, axis=0).max())))
    corners, index = np.unique(np.round(points, digits) + 0.0, axis=0, return_inverse=True)
    index = index.reshape(-1)
    if isinstance(body, QuadMesh):
        faces = index[body.faces].tolist()
    else:
        faces = [face.tolist() for face in np.split(index, np.cumsum([len(polygon) for polygon in body])[:-1])]
    # Where corners fall together, at the poles of a grid say, a quadrilateral has three, or fewer.
    distinct = (tuple(dict.fromkeys(face)) for face in faces)
    return Body(tuple(map(tuple, corners.tolist())), tuple(face for face in distinct if len(face) > 2))
