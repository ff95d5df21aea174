"""Keyframes of a net: displacements and places that it has to keep, as linear equations of its coordinates."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np
from scipy import sparse

from symmotion import checks
from symmotion.brief import in_a_line, instants
from symmotion.errors import InputError
from symmotion.fairing.coordinates import Coordinates
from symmotion.motions.dual import DualQuaternions, as_quaternion
from symmotion.motions.position import Affine
from symmotion.motions.quaternions import conjugate, product
from symmotion.splines import BSplineBasis
from symmotion.values import read_only, value

Hold = Literal["displacement", "rotation"]
At: TypeAlias = float | Sequence[float]
UNITS = np.eye(4)
# How far a dual quaternion may be from a displacement, |Q · Q⁰| over |Q| |Q⁰|, and two alike from each other.
PROPER = 1e-9
# The cosine of half the angle of a turn that is as good as half a turn: its sign is open.
OPEN = 1e-6
# The part of the weight that the net has there which a keyframe must keep.
COLLAPSED = 1e-3


@value
class NetKeyframe:
    """A displacement D* that a net takes at (u, v), or a curve at (t,).

    at: the parameters. displacement: one `DualQuaternions` or `Affine`. weight: None for D(u, v) ∝ D*, 7 equations
    of the 8 coordinates, 3 of 4 where the motion is spherical; w > 0 for D(u, v) = w D*, with Q* of length 1.
    hold: "displacement", or "rotation": of the real part alone.

    >>> net = sm.motions.noisy_net(sm.motions.smooth_net(7), 0.01, seed=1)
    >>> there = net(5.0, 5.0)
    >>> kept = sm.fair(net, "least-squares", keyframes=[((5.0, 5.0), there)])
    >>> bool(np.allclose(kept.motion(5.0, 5.0).linear, there.linear))
    True
    """

    at: At
    displacement: Affine | DualQuaternions
    weight: float | None = None
    hold: Hold = "displacement"

    __repr__ = in_a_line


@value
class NetPlace:
    """A body point p (3,) that is at x (3,) at (u, v): x Q = p turned by Q + 2 Q⁰ as quaternions, x Q − Q p = 2 Q⁰.

    Four equations: the fourth is Q · Q⁰ = 0 there, where the dual part moves together with the real one.

    place: (3,). Raises InputError for other shapes.

    >>> net = sm.motions.noisy_net(sm.motions.smooth_net(7, spatial=True), 0.01, seed=1)
    >>> place = net.trajectory([0.0, 0.0, 0.0], 5.0, 5.0)[0]
    >>> kept = sm.fair(net, "least-squares", keyframes=[sm.fairing.NetPlace((5.0, 5.0), np.zeros(3), place)])
    >>> bool(np.allclose(kept.motion.trajectory([0.0, 0.0, 0.0], 5.0, 5.0)[0], place))
    True
    """

    at: At
    point: np.ndarray
    place: np.ndarray

    __repr__ = in_a_line

    def __post_init__(self):
        for name in ("point", "place"):
            given = checks.array(getattr(self, name), (3,), f"{name} of a keyframe").copy()
            object.__setattr__(self, name, read_only(given))


Asked: TypeAlias = NetKeyframe | NetPlace | tuple[At, Affine | DualQuaternions]


@dataclass(frozen=True, eq=False)
class Held:
    """One keyframe as equations Σ_k form_k (combos_k x) = target of the coordinates x (n m, C).

    combos: (k, n m) sparse; form: (e, k, C); target: (e,); covector: (e, d), whose rows times D are the left side.
    displacement: (d,) what D is proportional to, None for a place; label: as messages name it.
    """

    combos: sparse.csr_array
    form: np.ndarray
    target: np.ndarray
    covector: np.ndarray
    displacement: np.ndarray | None
    label: str


@dataclass(frozen=True, eq=False)
class View:
    """D = Σ_k maps_k (combos_k x) + constant, the real part and the dual one over `length`, at one (u, v)."""

    combos: sparse.csr_array
    maps: np.ndarray
    constant: np.ndarray

    def of(self, net: np.ndarray) -> np.ndarray:
        """(d,) D of a net (n, m, C)."""
        return np.einsum("kdc,kc->d", self.maps, self.combos @ net.reshape(-1, net.shape[-1])) + self.constant

    @staticmethod
    def at(coordinates: Coordinates, at: np.ndarray) -> "View":
        """D at (u, v) as a function of the coordinates that are faired."""
        parts, length = coordinates.parts, coordinates.length
        factors = [basis.matrix(np.array([t])) for basis, t in zip(coordinates.bases, at, strict=True)]
        row = factors[0] if len(factors) == 1 else sparse.csr_array(sparse.kron(factors[0], factors[1]))
        pair = coordinates.rational.control_displacements
        flat, c = pair.real.reshape(-1, 4), coordinates.channels
        if coordinates.spherical or parts == "real+dual":
            return View(row, np.eye(c)[None], np.zeros(c))
        if parts == "real":
            # Q⁰ = (½ d + Q·Q⁰/S²) Q with both factors as they are.
            left = as_quaternion(pair.translation.reshape(-1, 3)) / 2
            left[:, 0] = pair.plucker.ravel()
            maps = np.zeros((5, 8, 4))
            maps[0, :4] = UNITS
            maps[1:, 4:] = np.swapaxes(product(UNITS[:, None], UNITS), -1, -2) / length
            return View(_weighed(row, np.concatenate([np.ones((len(flat), 1)), left], axis=1)), maps, np.zeros(8))
        still = np.concatenate([(row @ flat)[0], np.zeros(4)])
        if parts == "dual":
            return View(row, np.concatenate([np.zeros((4, 4)), UNITS])[None], still)
        still[4:] = (row @ (pair.plucker.reshape(-1, 1) * flat))[0] / length
        maps = np.zeros((4, 8, 3))
        maps[:, 4:] = np.swapaxes(product(UNITS[1:], UNITS[:, None]), -1, -2) / 2
        return View(_weighed(row, flat), maps, still)


def _weighed(row: sparse.csr_array, factors: np.ndarray) -> sparse.csr_array:
    """(k, n m) a row (1, n m) times each column of (n m, k)."""
    columns = row.indices
    data = row.data * factors[columns].T
    k = len(data)
    pointers = np.arange(k + 1) * len(columns)
    return sparse.csr_array((data.ravel(), np.tile(columns, k), pointers), shape=(k, row.shape[1]))


def held(coordinates: Coordinates, keyframes: Sequence[Asked]) -> tuple[Held, ...]:
    """The equations of keyframes; InputError that names the first one that cannot be."""
    if isinstance(keyframes, NetKeyframe | NetPlace) or not isinstance(keyframes, Sequence):
        raise InputError("keyframes: a list of ((u, v), displacement), NetKeyframe or NetPlace is needed")
    if not len(keyframes):
        return ()
    if coordinates.parts == "real+translation":
        raise InputError(
            "keyframes with parts 'real+translation': a displacement is not linear in both; least squares in closed "
            "form meet them one after the other; or fair real+dual"
        )
    if coordinates.normalised:
        raise InputError("keyframes: a curve of unit quaternions is not linear in its controls; use a RationalMotion")
    found = tuple(_held(coordinates, i, k) for i, k in enumerate(keyframes))
    _require_consistent(keyframes, found)
    return found


def _held(coordinates: Coordinates, i: int, asked: Asked) -> Held:
    name = f"keyframe {i}"
    if not isinstance(asked, NetKeyframe | NetPlace):
        if not isinstance(asked, tuple | list) or len(asked) != 2:
            raise InputError(f"{name}: ((u, v), displacement), NetKeyframe or NetPlace is needed")
        asked = NetKeyframe(*asked)
    at = _inside(coordinates.bases, asked.at, name)
    where = f"{name} at ({', '.join(instants(*at))})"
    view = View.at(coordinates, at)
    now = view.of(coordinates.net)
    if isinstance(asked, NetPlace):
        covector, target = _place(coordinates, asked, now, where)
        displacement = None
    else:
        displacement = _proper(coordinates, asked, where)
        covector, target = _displaced(coordinates, asked, displacement, now, where)
        displacement = displacement if asked.hold == "displacement" else displacement[:4]
    form = np.einsum("ed,kdc->ekc", covector, view.maps)
    return Held(view.combos, form, target - covector @ view.constant, covector, displacement, where)


def _inside(bases: Sequence[BSplineBasis], at: object, name: str) -> np.ndarray:
    """(2,) or (1,) the parameters, within the domain."""
    given = np.atleast_1d(checks.numbers(at, f"{name}: parameters"))
    needed = "uv" if len(bases) == 2 else "t"
    if given.shape != (len(needed),):
        raise InputError(f"{name}: parameters of shape {given.shape}: {checks.shown((len(needed),))} is needed")
    for t, basis, x in zip(given, bases, needed, strict=True):
        a, b = basis.domain
        if not a <= t <= b:
            t, a, b = instants(t, a, b)
            raise InputError(f"{name} at {x} = {t} is outside the net, whose {x} goes from {a} to {b}")
    return given


def _proper(coordinates: Coordinates, asked: NetKeyframe, where: str) -> np.ndarray:
    """(8,) or (4,) the displacement with Q* of length 1, the dual part over the length; InputError for what is none."""
    checks.choice(asked.hold, get_args(Hold), f"{where}: hold")
    given = asked.displacement
    try:
        if isinstance(given, Affine):
            given = DualQuaternions.from_matrices(given.linear, given.translation)
    except InputError as error:
        raise InputError(f"{where} is no displacement: {error}") from None
    if not isinstance(given, DualQuaternions):
        raise InputError(f"{where}: an Affine or DualQuaternions is needed, not {type(given).__name__}")
    if given.shape != ():
        raise InputError(f"{where}: {given.shape} displacements, one is needed")
    size = float(np.linalg.norm(given.real))
    if np.abs(given.real @ given.dual) > PROPER * size * max(float(np.linalg.norm(given.dual)), size):
        raise InputError(
            f"{where}: a dual quaternion that is no displacement, Q · Q⁰ / S² = {given.plucker:.3g}; "
            "DualQuaternions.from_parts makes one of a rotation and a translation"
        )
    if not coordinates.spherical:
        return np.concatenate([given.real, given.dual / coordinates.length]) / size
    if asked.hold == "displacement" and np.linalg.norm(given.translation) > PROPER:
        raise InputError(f"{where} has a translation: a spherical motion turns about the origin; hold='rotation'")
    return given.real / size


def _displaced(
    coordinates: Coordinates, asked: NetKeyframe, displacement: np.ndarray, now: np.ndarray, where: str
) -> tuple[np.ndarray, np.ndarray]:
    """The equations covector D = target, D the sign's of the net there, of a keyframe."""
    real, size = displacement[:4], float(np.linalg.norm(now[:4]))
    cosine = float(real @ now[:4]) / size
    if abs(cosine) < OPEN:
        raise InputError(f"{where} is half a turn away from the net, so that its hemisphere cannot be told")
    if asked.weight is not None:
        checks.positive(asked.weight, f"{where}: weight")
    if cosine < 0:
        displacement = -displacement
    if not coordinates.parts.startswith("real"):
        if np.linalg.norm(now[:4] / size - displacement[:4]) > PROPER:
            angle = np.rad2deg(2 * np.arccos(min(1.0, abs(cosine))))
            raise InputError(
                f"{where} is turned by {angle:.3g}° from the motion, whose rotations parts={coordinates.parts!r} "
                "leaves as they are: fair the real part too"
            )
        if asked.weight is not None and abs(asked.weight - size) > PROPER * size:
            raise InputError(f"{where}: weight {asked.weight:g} where the real part, which stays, has {size:.6g}")
        covector = np.concatenate([np.zeros((4, 4)), UNITS], axis=1)
        return (covector, size * displacement[4:]) if asked.hold == "displacement" else (covector[:0], np.zeros(0))
    held = displacement if asked.hold == "displacement" else displacement[:4]
    if asked.weight is not None:
        covector, target = np.eye(len(held), len(displacement)), asked.weight * held
    else:
        # Householder's reflection of the displacement: its other rows are an orthonormal complement, exactly.
        covector = np.zeros((len(held) - 1, len(displacement)))
        covector[:, : len(held)] = _complement(held)
        target = np.zeros(len(held) - 1)
    return covector, target


def _complement(vector: np.ndarray) -> np.ndarray:
    """(d − 1, d) an orthonormal basis of what is perpendicular to a vector (d,)."""
    return np.linalg.qr(np.column_stack([vector, np.eye(len(vector))]))[0][:, 1 : len(vector)].T


def _place(coordinates: Coordinates, asked: NetPlace, now: np.ndarray, where: str) -> tuple[np.ndarray, np.ndarray]:
    """The equations covector D = target of a body point's place."""
    point, place = (
        as_quaternion(checks.array(x, (3,), f"{where}: {name}")) / coordinates.length
        for x, name in ((asked.point, "point"), (asked.place, "place"))
    )
    # The columns of Q ↦ x Q − Q p.
    turned = (product(place, UNITS) - product(UNITS, point)).T
    if coordinates.spherical:
        far, near = np.linalg.norm(place), np.linalg.norm(point)
        if abs(far - near) > PROPER * max(far, near):
            raise InputError(
                f"{where}: a body point at distance {near:g} from the origin cannot be at distance {far:g} from it "
                "under a spherical motion"
            )
        # x Q = Q p: of four equations two are independent where |x| = |p|.
        return np.linalg.svd(turned)[2][:2] if far else turned[:0], np.zeros(2 if far else 0)
    if coordinates.parts.startswith("real"):
        return np.concatenate([turned, -2 * UNITS], axis=1), np.zeros(4)
    # With Q fixed, vec(2 Q⁰Q*) = vec((x Q − Q p) Q*): three equations, whatever Q · Q⁰ is.
    back = product(UNITS, conjugate(now[:4])).T[1:]
    covector = np.concatenate([np.zeros((3, 4)), 2 * back], axis=1)
    return covector, back @ (turned @ now[:4])


def _require_consistent(keyframes: Sequence[Asked], found: tuple[Held, ...]) -> None:
    """InputError that names two keyframes at one place with different displacements."""
    first: dict[tuple[float, ...], int] = {}
    for i, (asked, here) in enumerate(zip(keyframes, found, strict=True)):
        if here.displacement is None:
            continue
        at = asked.at if isinstance(asked, NetKeyframe | NetPlace) else asked[0]
        j = first.setdefault(tuple(np.atleast_1d(np.asarray(at, dtype=float)).tolist()), i)
        other = found[j].displacement
        assert other is not None
        d = min(len(other), len(here.displacement))
        one, two = here.displacement[:d], other[:d]
        if np.linalg.norm(one - np.sign(one[:4] @ two[:4]) * two) > PROPER * max(1.0, float(np.linalg.norm(one))):
            raise InputError(f"keyframes {j} and {i} are different displacements at one place: drop one of them")


def weights_of(coordinates: Coordinates, keyframes: tuple[Held, ...], net: np.ndarray) -> np.ndarray:
    """(M,) the weight w of each, D(u, v) = w D* with Q* of length 1, NaN of places; InputError where one is lost."""
    weights = np.full(len(keyframes), np.nan)
    for i, k in enumerate(keyframes):
        if k.displacement is None or (not coordinates.spherical and not coordinates.parts.startswith("real")):
            continue
        flat, start = (x.reshape(-1, x.shape[-1]) for x in (net, coordinates.net))
        now, before = ((k.combos[[0]] @ x[:, :4])[0] for x in (flat, start))
        weights[i] = abs(now @ k.displacement[:4])
        if now @ before <= 0 or weights[i] < COLLAPSED * np.linalg.norm(before):
            raise InputError(
                f"{k.label} is met with a weight of {np.sign(now @ before) * weights[i]:.3g} where the net has "
                f"{np.linalg.norm(before):.3g}: it is too far from the net or too close to others; give weights"
            )
    return weights
