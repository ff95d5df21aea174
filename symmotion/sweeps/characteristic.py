"""Characteristic curves of a moving ellipsoid in closed form: where its envelope touches it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from symmotion.checks import floats, numbers
from symmotion.errors import InputError
from symmotion.sweeps.ellipsoid import MovingEllipsoid, SurfaceSpeed
from symmotion.values import read_only, value

# Halvings of the step between meridians where a loop turns back.
HALVINGS = 16
# Of the interval of the multiplier, until it is as small as rounding.
BISECTIONS = 60


@value
class CharacteristicCurve:
    """A closed loop on the ellipsoid at one time.

    sphere: (N, 3) unit vectors s with g(s) = 0, in order round the loop, the last followed by
    the first; points: (N, 3) w + B s.

    Raises InputError for points that are no numbers.

    >>> motion = sm.interpolants.component_cubic(sm.examples.spatial_keyframes())
    >>> curves = sm.sweeps.characteristic_curves(sm.sweeps.MovingEllipsoid(motion, [1.0, 0.7, 0.5]), 0.5)
    >>> bool(np.allclose(np.linalg.norm(curves[0].sphere, axis=1), 1.0))
    True
    """

    sphere: np.ndarray
    points: np.ndarray

    def __post_init__(self):
        for name in ("sphere", "points"):
            object.__setattr__(self, name, read_only(numbers(getattr(self, name), name)))

    def __repr__(self) -> str:
        return f"CharacteristicCurve(a loop of {len(self.points)} points)"


class Range(NamedTuple):
    """The least and the greatest value of g on the unit sphere, in 1 / time."""

    least: np.ndarray
    greatest: np.ndarray

    @property
    def crossed(self) -> np.ndarray:
        """Whether g has both signs, so that there is a characteristic curve."""
        return (self.least < 0) & (self.greatest > 0)


def surface_speed_range(body: MovingEllipsoid, t: ArrayLike) -> Range:
    """The least and the greatest g at times t (…): the trust-region problem min sᵀHs + b·s, |s| = 1, by duality.

    min = max over λ ≤ w₁ of λ − Σ c_i² / (4 (w_i − λ)), with w, Q the eigenvalues and -vectors
    of H and c = Qᵀb; there is no gap between the two (Stern and Wolkowicz 1995).
    """
    form = body.surface_speed(floats(t, "times"))
    return Range(_least(form), -_least(SurfaceSpeed(-form.quadratic, -form.linear)))


def characteristic_curves(body: MovingEllipsoid, t: float, meridians: int = 180) -> tuple[CharacteristicCurve, ...]:
    """The characteristic curves at one time: none, one loop or two, where unit sphere and quadric g(s) = 0 meet.

    Every meridian s = sin θ e(φ) + cos θ n about an axis n turns g = 0 into a quartic in
    x = tan(θ/2),
        (r − z) x⁴ + 2 (q − k) x³ + (4p − 2r) x² + 2 (q + k) x + (r + z) = 0,
    with p = eᵀHe, k = 2 eᵀHn, r = nᵀHn, q = b·e, z = b·n. Its positive real roots, from the
    companion matrix, are the curve's points there; those of neighbouring meridians are joined
    in order, and where their number falls by two the loop turns back. About an eigenvector of H
    as axis k is zero; n is an eigenvector or a diagonal of the eigenframe, whichever keeps g at
    both poles furthest from zero.

    meridians: at least 8; near turns they are halved until the gap cannot be seen. Raises
    InputError for a time outside the domain and where the ellipsoid is flat.

    body: the ellipsoid and its motion; t: a time in the domain.

    >>> motion = sm.interpolants.component_cubic(sm.Keyframes([0.0, 1.0], [np.eye(3)] * 2, [[0, 0, 0], [2, 0, 0]]))
    >>> (circle,) = sm.sweeps.characteristic_curves(sm.sweeps.MovingEllipsoid(motion), 0.5)
    >>> bool(np.abs(circle.sphere[:, 0]).max() < 1e-9)
    True
    """
    if meridians < 8:
        raise InputError(f"{meridians} meridians are too few: at least 8 are needed")
    body.require_solid(np.array([t], dtype=float))
    if not surface_speed_range(body, t).crossed:
        return ()
    form = body.surface_speed(t)
    frame = _frame(form)
    angles = 2 * np.pi * np.arange(meridians) / meridians
    roots = _roots(form, frame, angles)
    for _ in range(HALVINGS):
        wide = _wide(_on_sphere(angles, roots), 3 * 2 * np.pi / meridians)
        if not wide.any():
            break
        after = np.append(angles[1:], angles[0] + 2 * np.pi)[wide]
        middle = 0.5 * (angles[wide] + after)
        order = np.argsort(np.append(angles, middle))
        roots = np.concatenate([roots, _roots(form, frame, middle)])[order]
        angles = np.append(angles, middle)[order]
    nodes = _on_sphere(angles, roots)
    curves = []
    for loop in _loops(roots):
        j, k = np.array(loop).T
        s = nodes[j, k] @ frame.T
        curves.append(CharacteristicCurve(s, body.points(s, t)))
    return tuple(curves)


def _on_sphere(angles: np.ndarray, roots: np.ndarray) -> np.ndarray:
    """(M, 4, 3) the points of the roots x = tan(θ/2) on the meridians, nan where there is none."""
    theta, phi = 2 * np.arctan(roots), angles[:, None]
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)


def _wide(nodes: np.ndarray, step: float) -> np.ndarray:
    """(M,) whether between a meridian and the next a loop turns back, or runs for more than `step`."""
    following = np.roll(nodes, -1, axis=0)
    one, other = (np.isfinite(x[..., 0]) for x in (nodes, following))
    far = np.linalg.norm(following - nodes, axis=-1) > step  # nan is not
    return (one != other).any(axis=1) | far.any(axis=1)


def _least(form: SurfaceSpeed) -> np.ndarray:
    """(…) the least value of g on the unit sphere."""
    w, q = np.linalg.eigh(form.quadratic)
    c = np.einsum("...ji,...j->...i", q, form.linear)
    # Below the rounding of w a share of b would only divide zero by zero.
    c2 = np.where(np.abs(c) > np.finfo(float).eps * np.abs(w).max(axis=-1, keepdims=True), c, 0.0) ** 2
    size = np.sqrt(c2.sum(axis=-1))
    # The dual is concave in λ; its slope 1 − Σ c²/(4 (w − λ)²) is at least 0 at the low end.
    low, high = w[..., 0] - size / 2, w[..., 0].copy()

    def gaps(level):
        return np.where(c2 > 0, np.maximum(w - level[..., None], np.finfo(float).tiny), 1.0)

    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        with np.errstate(over="ignore"):
            rising = ((np.sqrt(c2) / (2 * gaps(middle))) ** 2).sum(axis=-1) <= 1
        low, high = np.where(rising, middle, low), np.where(rising, high, middle)
    return low - (c2 / (4 * gaps(low))).sum(axis=-1)


def _frame(form: SurfaceSpeed) -> np.ndarray:
    """(3, 3) orthonormal columns, the last an axis n with g(n) and g(−n) far from zero."""
    _, q = np.linalg.eigh(form.quadratic)
    # Not all of these can have a zero of g at a pole unless g is zero everywhere.
    diagonals = np.array([[1, 1, 1], [-1, 1, 1], [1, -1, 1], [1, 1, -1]]) / np.sqrt(3)
    axes = np.concatenate([q.T, diagonals @ q.T])
    n = axes[np.argmax(np.minimum(np.abs(form(axes)), np.abs(form(-axes))))]
    e = q[:, np.argmin(np.abs(n @ q))]
    e = e - (e @ n) * n
    e /= np.linalg.norm(e)
    return np.column_stack([e, np.cross(n, e), n])


def _roots(form: SurfaceSpeed, frame: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """(M, 4) the positive real roots x = tan(θ/2) on each meridian, increasing, then nan."""
    h, b = frame.T @ form.quadratic @ frame, frame.T @ form.linear
    e = np.column_stack([np.cos(angles), np.sin(angles)])
    p = np.einsum("mi,ij,mj->m", e, h[:2, :2], e)
    k, q = 2 * e @ h[:2, 2], e @ b[:2]
    r, z = h[2, 2], b[2]
    ones = np.ones_like(p)
    coefficients = np.column_stack([2 * (q - k), 4 * p - 2 * r, 2 * (q + k), (r + z) * ones]) / (r - z)
    companion = np.zeros((len(angles), 4, 4))
    companion[:, 1:, :-1] = np.eye(3)
    companion[:, 0] = -coefficients
    found = np.linalg.eigvals(companion)
    # LAPACK returns complex roots of real matrices as exact pairs: an imaginary part of zero is a real root.
    return np.sort(np.where((found.imag == 0) & (found.real > 0), found.real, np.nan), axis=1)


def _loops(roots: np.ndarray) -> list[list[tuple[int, int]]]:
    """Closed loops through the nodes (meridian, place), given the roots (M, 4) in order, nan where there is none."""
    theta = 2 * np.arctan(roots)
    counts = np.isfinite(theta).sum(axis=1)
    links: dict[tuple[int, int], list[tuple[int, int]]] = {}

    def link(one: tuple[int, int], other: tuple[int, int]) -> None:
        links.setdefault(one, []).append(other)
        links.setdefault(other, []).append(one)

    m = len(theta)
    for j in range(m):
        more, fewer = (j, (j + 1) % m) if counts[j] >= counts[(j + 1) % m] else ((j + 1) % m, j)
        places = list(range(counts[more]))
        while len(places) > counts[fewer]:
            k = _turning(theta[more, places], theta[fewer, : counts[fewer]])
            link((more, places[k]), (more, places[k + 1]))
            del places[k : k + 2]
        for k, place in enumerate(places):
            link((more, place), (fewer, k))
    loops = []
    while links:
        start = next(iter(links))
        loop, node = [], start
        while node in links:
            loop.append(node)
            following = links.pop(node)
            node = next((n for n in following if n in links), start)
        loops.append(loop)
    return loops


def _turning(more: np.ndarray, fewer: np.ndarray) -> int:
    """The k for which places k and k + 1 have no partners on the next meridian: the others then fit it best."""
    if len(more) - len(fewer) > 2:
        return 0  # four places and none: the first two are one turn, the last two another
    rest = [np.abs(np.delete(more, [k, k + 1]) - fewer).sum() for k in range(len(more) - 1)]
    gaps = np.diff(more)
    return int(np.argmin(np.array(rest) + gaps))
