"""Swept volumes of ellipsoids: their boundary as a closed mesh, and how much of it is counted more than once."""

from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np

from symmotion.bodies.mesh import Mesh, compact
from symmotion.checks import choice, numbers, whole
from symmotion.sweeps.characteristic import surface_speed_range
from symmotion.sweeps.ellipsoid import MovingEllipsoid
from symmotion.sweeps.marching import cubes, isosurface, prisms, sphere
from symmotion.values import read_only, value

METHODS = ("envelope", "implicit")
# Crossings keep this share of an edge away from its ends, so that no triangle degenerates. The envelope's points are
# stationary along their edges, which makes this an error of its square.
CLEAR = 0.01
# Of the share of an edge, far below what the size of the edges leaves open.
TOLERANCES = {"xatol": 1e-6, "xrtol": 0.0, "fatol": 0.0, "frtol": 0.0}
# A body whose surface moves slower than this times its fastest is at rest.
REST = 1e-9
# Of a slice, for the time when movement begins or ends.
BISECTIONS = 40
# Placements and rates that differ by less than this, relatively, are the same.
SAME = 1e-9
# Times per slice at which points are looked for.
LOOKS = 4
REPLICATES = 8


class Estimate(NamedTuple):
    """A quasi-Monte Carlo estimate and its standard error, from independent scramblings.

    >>> motion = sm.interpolants.component_cubic(sm.Keyframes([0.0, 1.0], [np.eye(3)] * 2, [[0, 0, 0], [2, 0, 0]]))
    >>> swept = sm.sweeps.swept_volume(sm.sweeps.MovingEllipsoid(motion), slices=8, divisions=8, samples=1024)
    >>> value, error = swept.union
    >>> bool(abs(value - 10.47) < 5 * error + 0.5)
    True
    """

    value: float
    error: float


@value
class SweptVolume:
    """The boundary of the union of a moving ellipsoid's positions.

    mesh: closed, facing outwards; times: (N,) the slices; without_curve: those of them where
    the whole surface moves outwards, or inwards, so that the envelope does not touch it;
    closed: whether the motion ends as it begins, so that there are no end caps; samples:
    points that `overlap` and `union` draw.

    body: the `MovingEllipsoid`; method: "envelope" or "implicit", as in `swept_volume`.

    Raises InputError for times that are no numbers.

    >>> motion = sm.interpolants.component_cubic(sm.Keyframes([0.0, 1.0], [np.eye(3)] * 2, [[0, 0, 0], [2, 0, 0]]))
    >>> swept = sm.sweeps.swept_volume(sm.sweeps.MovingEllipsoid(motion), slices=16, divisions=12, samples=1024)
    >>> bool(abs(swept.volume / (2 * np.pi + 4 * np.pi / 3) - 1) < 0.03)
    True
    """

    body: MovingEllipsoid
    method: str
    mesh: Mesh
    times: np.ndarray
    without_curve: np.ndarray
    closed: bool
    samples: int

    def __post_init__(self):
        for name in ("times", "without_curve"):
            object.__setattr__(self, name, read_only(numbers(getattr(self, name), name)))

    @property
    def volume(self) -> float:
        """The volume that the mesh encloses; of an envelope, what was visited twice counts twice (see `overlap`)."""
        return self.mesh.volume

    @property
    def area(self) -> float:
        """The area of the mesh; of an envelope with its parts inside the swept volume."""
        return self.mesh.area

    @property
    def overlap(self) -> Estimate:
        """∫ max(visits − 1, 0) dx, the volume that an envelope counts more than once; zero without self-overlap.

        An envelope goes round a point as often as the body visits it, so that `volume` minus
        this is the volume of the union.
        """
        return self._estimates[0]

    @property
    def union(self) -> Estimate:
        """The volume of the union of all positions, whatever the mesh."""
        return self._estimates[1]

    @cached_property
    def _estimates(self) -> tuple[Estimate, Estimate]:
        from scipy.stats import qmc  # here, since it takes longer than `import symmotion`

        fine = np.linspace(self.times[0], self.times[-1], LOOKS * (len(self.times) - 1) + 1)
        low, high = self.body.box(fine)
        power = max(1, int(np.ceil(np.log2(self.samples / REPLICATES))))
        shares = []
        for seed in range(REPLICATES):
            points = low + (high - low) * qmc.Sobol(3, rng=seed).random_base2(power)
            visits = self.body.visits(points, fine, self.closed)
            shares.append(((visits - 1).clip(0).mean(), (visits > 0).mean()))
        values = np.prod(high - low) * np.array(shares)
        mean, error = values.mean(axis=0), values.std(axis=0, ddof=1) / np.sqrt(REPLICATES)
        overlap, union = (Estimate(float(m), float(e)) for m, e in zip(mean, error, strict=True))
        return overlap, union

    def __repr__(self) -> str:
        o = self.overlap
        return (
            f"SweptVolume({self.method}, {len(self.mesh.triangles)} triangles, volume {self.volume:.6g}, "
            f"area {self.area:.6g}, overlap {o.value:.3g} ± {o.error:.1g})"
        )


def swept_volume(
    body: MovingEllipsoid,
    method: Literal["envelope", "implicit"] = "envelope",
    *,
    slices: int = 64,
    divisions: int = 24,
    samples: int = 2**16,
) -> SweptVolume:
    """The volume that a moving ellipsoid sweeps, as a closed mesh that faces outwards.

    "envelope": the surface g(s, t) = 0 in the space of unit sphere and time, cut out by
    marching tetrahedra and carried to w(t) + B(t) s, with the part of the first position that
    moves inwards and of the last one that moves outwards as caps. Loops may split, merge and
    vanish. It is the boundary of the part where g > 0, on which (s, t) ↦ x keeps orientation,
    so it goes round every point as often as the body visits it: where the sweep overlaps
    itself, sheets lie inside, and `overlap` is what they enclose twice.
    "implicit": marching tetrahedra in a grid of space on min over t of |B⁻¹(x − w)| = 1: the
    outer boundary alone, creases cut at the size of a grid cell.

    slices: steps in time; divisions: steps along an edge of the icosahedron that becomes the
    sphere (envelope), or cubes along the longest side of the box (implicit, twice as many).
    Both methods converge with the second order. A motion that ends as it begins, with the same
    rates, has no caps. Raises InputError that names a time where the ellipsoid is flat
    or, of a spline, jumps. Source: HJK 5.4.

    body: the ellipsoid and its motion; method: one of those two.

    >>> motion = sm.interpolants.component_cubic(sm.Keyframes([0.0, 1.0], [np.eye(3)] * 2, [[0, 0, 0], [2, 0, 0]]))
    >>> swept = sm.sweeps.swept_volume(sm.sweeps.MovingEllipsoid(motion), slices=16, divisions=12, samples=1024)
    >>> bool(swept.volume < 11.0)
    True
    """
    choice(method, METHODS, "method")
    slices, divisions, samples = (
        whole(slices, 3, "slices"),
        whole(divisions, 1, "divisions"),
        whole(samples, REPLICATES, "samples"),
    )
    times = np.linspace(*body.domain, slices + 1)
    body.require_solid(times)
    body.require_continuous()
    closed = _returns(body)
    mesh = _envelope(body, times, divisions, closed) if method == "envelope" else _implicit(body, times, 2 * divisions)
    moving = times[_moving(body, times)]
    still = moving[~surface_speed_range(body, moving).crossed] if len(moving) else moving
    return SweptVolume(body, method, mesh, times, still, closed, samples)


def _returns(body: MovingEllipsoid) -> bool:
    """Whether the motion ends with the placement and the rates that it began with, in motion."""
    ends = np.array(body.domain)
    # From rest it may set out in another direction than it came from: that has ends.
    if not _moving(body, np.linspace(ends[0], ends[1], 9))[[0, -1]].all():
        return False
    parts = [*body(ends), *body.surface_speed(ends)]
    scales = [np.abs(x).max() for x in parts]
    scales[1] = max(scales[0], scales[1])
    scales[2:] = [max(scales[2:])] * 2
    return all(np.abs(x[1] - x[0]).max() <= SAME * scale for x, scale in zip(parts, scales, strict=True))


def _moving(body: MovingEllipsoid, times: np.ndarray) -> np.ndarray:
    """(N,) whether the surface moves at each time (sliding along itself is no movement)."""
    size = np.abs(np.stack(surface_speed_range(body, times))).max(axis=0)
    rate = np.abs(np.linalg.solve(body(times).matrix, body(times, 1).matrix)).max()
    return size > REST * max(size.max(), rate)


def _in_motion(body: MovingEllipsoid, times: np.ndarray) -> np.ndarray:
    """The times without those at rest, where g is rounding; first and last are when movement begins and ends."""
    moving = _moving(body, times)
    kept = times[moving]
    if not len(kept):
        return kept
    ends = []
    first, last = np.flatnonzero(moving)[[0, -1]]
    for inside, outside in ((first, first - 1), (last, last + 1)):
        if not 0 <= outside < len(times):
            continue
        inner, outer = times[inside], times[outside]
        for _ in range(BISECTIONS):
            middle = 0.5 * (outer + inner)
            if _moving(body, np.append(times, middle))[-1]:
                inner = middle
            else:
                outer = middle
        ends.append(inner)
    return np.union1d(kept, ends)


def _envelope(body: MovingEllipsoid, times: np.ndarray, divisions: int, closed: bool) -> Mesh:
    nodes, faces = sphere(divisions)
    times = _in_motion(body, times)
    if not len(times):
        return Mesh(body.points(nodes, body.domain[0]), faces)
    form = body.surface_speed(times)
    positive = np.stack([form_k >= 0 for form_k in _values(form, nodes)])
    if closed:
        positive[-1] = positive[0]
    flat, count = positive.ravel(), len(nodes)
    edges, triangles = isosurface(prisms(faces, positive), flat)
    if not closed:
        caps = [_cap(faces, ~positive[0], 0), _cap(faces, positive[-1], (len(times) - 1) * count)]
        # A node that stays is an edge from itself to itself.
        pairs = np.concatenate([edges[triangles], *caps])
    else:
        pairs = edges[triangles]
        pairs = np.where((pairs >= flat.size - count).all(axis=2, keepdims=True), pairs - (flat.size - count), pairs)
    keys, inverse = np.unique(pairs @ [flat.size, 1], return_inverse=True)
    first, second = np.divmod(keys, flat.size)
    share = _crossings(body, nodes, times, first, second)
    s, t = _between(nodes, times, first, second, share)
    return compact(body.points(s, t), inverse.reshape(-1, 3))


def _values(form, nodes: np.ndarray) -> np.ndarray:
    """(N, V) g at all nodes (V, 3) of the sphere and all times (N,)."""
    products = (nodes[:, :, None] * nodes[:, None, :]).reshape(len(nodes), 9)
    return form.quadratic.reshape(-1, 9) @ products.T + form.linear @ nodes.T


def _cap(faces: np.ndarray, kept: np.ndarray, offset: int) -> np.ndarray:
    """(F, 3, 2) the triangles of the part of a sphere whose nodes are `kept`, cut where edges leave it.

    Corners are edges of nodes, the smaller first: a node itself is the edge from it to itself.
    """
    parts = [np.empty((0, 3, 2), dtype=faces.dtype)]
    count = kept[faces].sum(axis=1)
    parts.append(np.repeat(faces[count == 3][:, :, None], 2, axis=2))
    for number in (1, 2):
        cut = faces[count == number]
        odd = kept[cut] if number == 1 else ~kept[cut]
        start = np.argmax(odd, axis=1)
        a, b, c = (cut[np.arange(len(cut)), (start + k) % 3] for k in range(3))
        aa, bb, cc, ab, ac = (np.stack(p, axis=1) for p in ((a, a), (b, b), (c, c), (a, b), (a, c)))
        if number == 1:
            parts.append(np.stack([aa, ab, ac], axis=1))
        else:
            parts += [np.stack([ab, bb, cc], axis=1), np.stack([ab, cc, ac], axis=1)]
    return np.sort(np.concatenate(parts), axis=2) + offset


def _between(nodes, times, first, second, share) -> tuple[np.ndarray, np.ndarray]:
    """Points (E, 3) of the unit sphere and times (E,) at a share of the way along edges of sphere × time."""
    count = len(nodes)
    s = nodes[first % count] * (1 - share)[:, None] + nodes[second % count] * share[:, None]
    s /= np.linalg.norm(s, axis=1, keepdims=True)
    a, b = times[first // count], times[second // count]
    # Rounding must not lead out of the domain.
    return s, np.clip(a + share * (b - a), np.minimum(a, b), np.maximum(a, b))


def _crossings(body, nodes, times, first, second) -> np.ndarray:
    """(E,) the share of the way from the first to the second node at which g is zero; 0 for an edge of one node."""
    from scipy.optimize.elementwise import find_root  # here, since it is not needed by `import symmotion`

    def g(share, start, end):
        s, t = _between(nodes, times, start.astype(int), end.astype(int), share)
        return body.surface_speed(t)(s)

    share = np.zeros(len(first))
    real = np.flatnonzero(first != second)
    with np.errstate(invalid="ignore"):  # where there is no change of sign, SciPy says so by nan
        found = find_root(
            g, (np.zeros(len(real)), np.ones(len(real))), args=(first[real], second[real]), tolerances=TOLERANCES
        )
    # Rounding alone can leave an edge without a change of sign; its middle is then as good.
    share[real] = np.where(found.success, found.x, 0.5).clip(CLEAR, 1 - CLEAR)
    return share


def _implicit(body: MovingEllipsoid, times: np.ndarray, divisions: int) -> Mesh:
    from scipy.optimize.elementwise import find_root

    fine = np.linspace(times[0], times[-1], LOOKS * (len(times) - 1) + 1)
    low, high = body.box(fine)
    step = (high - low).max() / divisions
    # A layer of cells around the box, so that the surface is closed.
    sides = [np.arange(-1, int(np.ceil(w / step)) + 2) * step + a for a, w in zip(low, high - low, strict=True)]
    nodes = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1)
    inside = body.closest(nodes.reshape(-1, 3), fine).reshape(nodes.shape[:-1]) < 1
    edges, triangles = isosurface(cubes(inside), inside.ravel())
    a, b = (nodes.reshape(-1, 3)[edges[:, k]] for k in range(2))

    def depth(share, index):
        i = index.astype(int)
        return body.closest(a[i] + share[:, None] * (b[i] - a[i]), fine) - 1

    found = find_root(
        depth,
        (np.zeros(len(edges)), np.ones(len(edges))),
        args=(np.arange(len(edges)),),
        tolerances=TOLERANCES,
    )
    share = np.where(found.success, found.x, 0.5).clip(CLEAR, 1 - CLEAR)[:, None]
    return Mesh(a + share * (b - a), triangles)
