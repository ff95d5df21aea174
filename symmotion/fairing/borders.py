"""Which controls of a net may move, and how: its borders held, continued or free, and regions."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np
from scipy import sparse

from symmotion import checks
from symmotion.brief import in_a_line
from symmotion.errors import InputError
from symmotion.fairing.coordinates import Box, Coordinates, Fairable
from symmotion.fairing.jumps import Jumps
from symmotion.splines import BSplineBasis
from symmotion.values import value

Order = Literal["G0", "G1", "G2"]
Hold = Literal["ring", "free", "G0", "G1", "G2"]
SIDES = ("u0", "u1", "v0", "v1")
# Two values of a corner that are to agree, relative to the larger.
AGREE = 1e-9


@value
class Continued:
    """A border that continues a neighbouring net: Dᵏ = w ratioᵏ Eᵏ along it for the derivatives across, k ≤ order.

    net: the neighbour, over the same knots along the border; this motion's border at "u0" continues the
    neighbour's at "u1", and the other way round. order: "G0", "G1" or "G2". ratio: of the speeds across.
    The one factor w of the neighbour's coordinates, which its displacements do not depend on, is the
    closest to the net's own.

    >>> left = sm.motions.smooth_net(8)
    >>> right = sm.motions.noisy_net(left, 0.01, seed=1)
    >>> sm.fairing.Continued(left, "G1").order
    'G1'
    """

    net: Fairable
    order: Order = "G1"
    ratio: float = 1.0

    __repr__ = in_a_line


Border: TypeAlias = Hold | Continued
Borders: TypeAlias = Border | Mapping[str, Border]


@dataclass(frozen=True, eq=False)
class Edge:
    """What holds at an end of a direction: rows (k, n) times controls are targets (k, other, C), None: as is."""

    rows: np.ndarray
    targets: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Freedom:
    """The nets x⁰ + shift + Z_u y Z_vᵀ that the borders and the region allow.

    u, v: (n, N_u), (m, N_v) sparse, orthonormal columns; shift: (n, m, C), None for zero.
    edges: of the local steps, by side; ring: whether the outermost controls of each side stay; box: of the knots.
    """

    u: sparse.csr_array
    v: sparse.csr_array
    shift: np.ndarray | None
    edges: Mapping[str, Edge]
    ring: Mapping[str, bool]
    box: Box

    def lift(self, y: np.ndarray) -> np.ndarray:
        """(n, m, C) the move Z_u y Z_vᵀ of coordinates (N, C)."""
        (n, a), (m, b) = self.u.shape, self.v.shape
        rows = (self.u @ y.reshape(a, -1)).reshape(n, b, -1)
        return (self.v @ np.swapaxes(rows, 0, 1).reshape(b, -1)).reshape(m, n, -1).swapaxes(0, 1)

    def drop(self, x: np.ndarray) -> np.ndarray:
        """(N, C) Z_uᵀ x Z_v of a net (n, m, C)."""
        (n, a), (m, b) = self.u.shape, self.v.shape
        rows = (self.u.T @ x.reshape(n, -1)).reshape(a, m, -1)
        return (self.v.T @ np.swapaxes(rows, 0, 1).reshape(m, -1)).reshape(b, a, -1).swapaxes(0, 1).reshape(a * b, -1)

    @property
    def free(self) -> np.ndarray:
        """(n, m) whether each control may still move, those moved by `shift` alone left out."""
        return np.outer(*(np.diff(z.indptr) > 0 for z in (self.u, self.v)))

    @staticmethod
    def of(coordinates: Coordinates, jumps: Jumps, region: object = None, borders: Borders = "ring") -> "Freedom":
        """What a region and the borders leave free; InputError for borders that there are not or that contradict."""
        box = Box.of(jumps, coordinates.bases, region)
        sides = _sides(len(coordinates.bases), borders)
        if region is not None and any(b != "ring" for b in sides.values()):
            raise InputError("borders go with a whole net: in a region its outermost controls stay")
        ring = {side: b == "ring" for side, b in sides.items()}
        controls = box.controls(jumps)
        edges = {s: _edge(coordinates, s, b) for s, b in sides.items() if b not in ("ring", "free")}
        z, shapes = [], coordinates.net.shape
        for k, x in enumerate("uv"):
            part = controls[k]
            if f"{x}0" in ring:
                part = slice(
                    part.start - (not ring[f"{x}0"]) if region is None else part.start,
                    part.stop + (not ring[f"{x}1"]) if region is None else part.stop,
                )
            z.append(_null(shapes[k], part, [edges[f"{x}{e}"].rows for e in "01" if f"{x}{e}" in edges]))
        shift = _shift(coordinates.net, edges) if any(e.targets is not None for e in edges.values()) else None
        for x, basis in zip("uv", z, strict=True):
            if not basis.shape[1]:
                raise InputError(
                    f"borders {x}0 and {x}1 leave none of the {basis.shape[0]} controls in {x} free to move"
                )
        return Freedom(z[0], z[1], shift, edges, ring, box)


def _sides(directions: int, borders: Borders) -> dict[str, Border]:
    known = SIDES[: 2 * directions]
    sides: dict[str, Border]
    if isinstance(borders, Mapping):
        for side in borders:
            checks.choice(side, known, "border")
        sides = {side: borders.get(side, "ring") for side in known}
    else:
        sides = {side: borders for side in known}
    for side, border in sides.items():
        if not isinstance(border, Continued):
            checks.choice(border, get_args(Hold), f"border {side}")
    return sides


def _edge(coordinates: Coordinates, side: str, border: Border) -> Edge:
    """The rows of derivatives across a border, and what they are to be."""
    basis = coordinates.bases["uv".index(side[0])]
    order = int((border.order if isinstance(border, Continued) else str(border))[1])
    if not isinstance(border, Continued):
        if coordinates.linear or _clamped(basis):
            return Edge(_across(basis, int(side[1]), order))
        # Translations, and rotations beside translations that stay, make the motion along a border of
        # more controls than their own combination: all that it reads stay.
        return Edge(_across(basis, int(side[1]), 2))
    checks.choice(border.order, get_args(Order), f"border {side}: order")
    ratio = checks.positive(border.ratio, f"border {side}: ratio")
    if not coordinates.linear:
        raise InputError(
            f"border {side} continues a net in real, dual or real+dual, not in parts {coordinates.parts!r}"
        )
    try:
        other = Coordinates.of(border.net, coordinates.parts, coordinates.length)
    except InputError as error:
        raise InputError(f"border {side}, the neighbour: {error}") from None
    if type(other.motion) is not type(coordinates.motion):
        raise InputError(f"border {side}: a neighbour of type {type(other.motion).__name__} cannot be continued")
    k = "uv".index(side[0])
    for i, (one, two) in enumerate(zip(coordinates.bases, other.bases, strict=True)):
        if i != k and not (one.degree == two.degree and np.array_equal(one.knots, two.knots)):
            raise InputError(f"border {side}: the neighbour has other knots in {'uv'[i]}: the same are needed along it")
    here, there = np.moveaxis(coordinates.net, k, 0), np.moveaxis(other.net, k, 0)
    rows = _across(basis, int(side[1]), order)
    beyond = _across(other.bases[k], 1 - int(side[1]), order)
    speeds = ratio ** np.arange(order + 1.0)
    targets = np.einsum("ki,ijc->kjc", speeds[:, None] * beyond, there)
    own = np.einsum("i,ijc->jc", rows[0], here)
    cosine = float(np.sum(own * targets[0]) / (np.linalg.norm(own) * np.linalg.norm(targets[0])))
    if abs(cosine) < AGREE:
        raise InputError(f"border {side}: the neighbour's displacements are half a turn away: its sign cannot be told")
    return Edge(rows, targets * (np.sum(own * targets[0]) / np.sum(targets[0] ** 2)))


def _clamped(basis: BSplineBasis) -> bool:
    basis = basis.relative
    return bool(basis.knots[0] == basis.domain[0] and basis.knots[-1] == basis.domain[1])


def _across(basis: BSplineBasis, end: int, order: int) -> np.ndarray:
    """(order + 1, n) the values and derivatives of the B-splines at an end of the domain, rounding left out."""
    rows = np.stack([basis(basis.domain[end], k)[0] for k in range(order + 1)])
    return np.where(np.abs(rows) > 1e-13 * np.abs(rows).max(axis=1, keepdims=True), rows, 0.0)


def _null(n: int, part: slice, held: list[np.ndarray]) -> sparse.csr_array:
    """(n, N) an orthonormal basis of what the rows `held` leave of the controls `part`, single ones where it can."""
    columns = np.arange(n)[part]
    rows = np.concatenate(held) if held else np.zeros((0, n))
    read = rows[:, columns].any(axis=0)
    plain = columns[~read]
    basis = sparse.csr_array((np.ones(len(plain)), (plain, np.arange(len(plain)))), shape=(n, len(plain)))
    if not read.any():
        return basis
    touched = columns[read]
    _, s, vt = np.linalg.svd(rows[:, touched])
    rest = vt[int((s > 1e-12 * s.max()).sum()) :].T
    rest[np.abs(rest) < 1e-14] = 0.0
    extra = sparse.lil_array((n, rest.shape[1]))
    extra[touched] = rest
    return sparse.csr_array(sparse.hstack([extra, basis]))


def _shift(net: np.ndarray, edges: Mapping[str, Edge]) -> np.ndarray:
    """(n, m, C) the least move that gives every edge its targets; InputError where two contradict at a corner."""
    shift = np.zeros_like(net)
    for x in "uv":
        mine = {s: e for s, e in edges.items() if s[0] == x}
        if not mine:
            continue
        k = "uv".index(x)
        rows = np.concatenate([e.rows for e in mine.values()])
        targets = [
            np.tensordot(e.rows, np.moveaxis(net, k, 0), 1) if e.targets is None else e.targets for e in mine.values()
        ]
        missing = np.concatenate(targets) - np.tensordot(rows, np.moveaxis(net + shift, k, 0), 1)
        if np.linalg.matrix_rank(rows) < len(rows):
            raise InputError(f"borders {' and '.join(mine)} share controls: the net is too small for both")
        shift = shift + np.moveaxis(np.tensordot(np.linalg.pinv(rows), missing, 1), 0, k)
    for side, edge in edges.items():
        k = "uv".index(side[0])
        asked = np.tensordot(edge.rows, np.moveaxis(net, k, 0), 1) if edge.targets is None else edge.targets
        error = np.abs(np.tensordot(edge.rows, np.moveaxis(net + shift, k, 0), 1) - asked)
        if error.max() > AGREE * np.abs(asked).max():
            j = int(np.argmax(error.max(axis=(0, 2))))
            others = [s for s in edges if s[0] != side[0]]
            raise InputError(
                f"borders {side} and {' or '.join(others)} contradict each other near control {j} along {side}: they "
                "ask for different displacements at the corner"
            )
    return shift
