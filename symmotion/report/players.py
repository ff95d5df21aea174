"""Motions as players of the page: sampled to piecewise cubics, with a still picture for where no script runs."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.bodies import Body, Shape
from symmotion.bodies.places import Oriented, body_size, dimension_of, placed
from symmotion.bodies.shapes import UPRIGHT, Up
from symmotion.brief import instants
from symmotion.errors import InputError
from symmotion.motions import Affine, Keyframes
from symmotion.motions.motion import Moving
from symmotion.report.carrying import Clipped, Upright, upright
from symmotion.report.stills import COPIES, motion_colours, still
from symmotion.report.tracks import ACCURACY, extent, flat, rounded, sampled
from symmotion.report.values import Figure, Player, require_name
from symmotion.views.parallel import DIRECTION, TO_Z


def player(
    name: str,
    motions: Mapping[str, Moving | Oriented],
    body: Shape | None,
    caption: str,
    keyframes: Keyframes | None = None,
    *,
    picture: Figure | None = None,
    unit: str = "",
    direction: ArrayLike | None = None,
    centre: ArrayLike | None = None,
    span: tuple[float, float] | None = None,
    alt: str = "",
    up: Up = "z",
) -> Player:
    """A player of a body under motions, by their labels; of two the first is before, the second after.

    motions: an orientation alone turns about the origin; body: of any form that `Body.of` takes,
    a letter F of a size that suits where it is None; keyframes: stay in sight; picture: a figure of
    the study that shows the same, drawn here when left out; direction: from where a body in space
    is seen first; centre: the body point whose path is drawn, the origin when left out; span: the
    times shown, all when left out; up: the axis that is upright, "z", or "y" as in files of BVH and glTF.
    Two tracks of 33 times in space are about 10 kB of the page.

    name: one of its own on a page; caption: below it; unit: of the times; alt: what is seen, in words, the caption when
    left out.

    Raises InputError where body, motions and keyframes are not of one dimension, or a motion bends too often.

    >>> keys = sm.examples.planar_keyframes()
    >>> moving = sm.report.player("spline", {"spline": sm.interpolants.component_cubic(keys)}, None, "A letter.", keys)
    >>> figures, rest = sm.report.player_elements([moving])
    """
    require_name("player", name)
    shown = _shown(name, motions, span)
    moved = _moved(body, shown, keyframes, checks.choice(up, UPRIGHT, f"player {name!r}: up"))
    kept = _compact(name, moved)
    d = kept.dimension
    _require_dimension(name, shown, keyframes, d)
    eye = _vector(name, "direction", DIRECTION if direction is None else direction, 3)
    middle = np.zeros(d) if centre is None else _vector(name, "centre", centre, d)
    if not eye.any():
        raise InputError(f"player {name!r}: direction {direction}: numbers that are not all zero are needed")
    if up == "y" and d == 3:
        # The page turns bodies about z.
        shown = {label: Upright(motion) for label, motion in shown.items()}
        keyframes = None if keyframes is None else Keyframes(keyframes.times, *upright(_positions(keyframes)))
        eye = eye if direction is None else TO_Z @ eye
    if picture is None:
        picture = still(name, shown, moved, keyframes, eye, middle, caption)
    size = max(extent(motion, kept.vertices) for motion in shown.values())
    return Player(
        name,
        kept,
        tuple(
            sampled(label, colour, motion, kept.vertices, ACCURACY * size)
            for (label, motion), colour in zip(shown.items(), motion_colours(len(shown)), strict=True)
        ),
        picture,
        caption,
        alt,
        () if keyframes is None else rounded(flat(_positions(keyframes)), size, float(np.abs(kept.vertices).max())),
        unit,
        tuple(round(float(x), 4) for x in eye),
        tuple(round(float(x), 4) for x in middle),
    )


def _shown(name: str, motions: Mapping[str, Moving | Oriented], span: tuple[float, float] | None) -> dict[str, Moving]:
    """The motions between the times shown, orientations as motions that turn about the origin."""
    if not motions:
        raise InputError(f"player {name!r}: at least one motion is needed")
    shown = {label: placed(motion) for label, motion in motions.items()}
    if span is None:
        return shown
    a, b = span
    for label, motion in shown.items():
        low, high = motion.domain
        if not low <= a < b <= high:
            a, b, low, high = instants(a, b, low, high)
            raise InputError(f"player {name!r}: span {a} to {b}: times from {low} to {high} of {label!r} are needed")
    return {label: Clipped(motion, (a, b)) for label, motion in shown.items()}


def _moved(body: Shape | None, motions: Mapping[str, Moving], keyframes: Keyframes | None, up: Up) -> Body:
    """The body that is meant, or a letter of a size that suits the keyframes, else the first motion."""
    if body is not None:
        return Body.of(body)
    first = next(iter(motions.values()))
    path = first(np.linspace(*first.domain, COPIES)) if keyframes is None else _positions(keyframes)
    return Body.of(None, dimension_of(first), size=body_size(path, len(path.translation))[0], up=up)


def _compact(name: str, body: Body) -> Body:
    """The body with corners that a player can tell apart: rounded to a thousandth of it, each once."""
    if min(map(len, body.faces)) < 3:
        raise InputError(f"player {name!r}: closed polygons (P, d), P ≥ 3, are needed as a body")
    sides = np.ptp(body.vertices, axis=0)
    if not sides.any():
        raise InputError(f"player {name!r}: a body of corners that do not coincide is needed")
    digits = 3 - int(np.floor(np.log10(sides.max())))
    corners, index = np.unique(np.round(body.vertices, digits) + 0.0, axis=0, return_inverse=True)
    renumbered = index.reshape(-1).tolist()
    # Where corners fall together, at the poles of a grid say, a quadrilateral has three, or fewer.
    distinct = (tuple(dict.fromkeys(renumbered[i] for i in face)) for face in body.faces)
    return Body(corners, tuple(face for face in distinct if len(face) > 2))


def _require_dimension(name: str, motions: Mapping[str, Moving], keyframes: Keyframes | None, dimension: int) -> None:
    """Raise InputError unless motions and keyframes are of the body's dimension."""
    for label, motion in motions.items():
        if (found := dimension_of(motion)) != dimension:
            raise InputError(
                f"player {name!r}, {label!r}: a motion in dimension {found} for a body in dimension {dimension}"
            )
    if keyframes is not None and keyframes.dimension != dimension:
        raise InputError(f"player {name!r}: keyframes in dimension {keyframes.dimension}, the body in {dimension}")


def _vector(name: str, what: str, value: ArrayLike, dimension: int) -> np.ndarray:
    if np.shape(value) != (dimension,):
        raise InputError(f"player {name!r}: {what} of shape {np.shape(value)}: ({dimension},) is needed")
    return np.asarray(value, dtype=float)


def _positions(keyframes: Keyframes) -> Affine:
    return Affine(keyframes.linear, keyframes.translation)
