"""The spline space of a fit: knots for a number of controls, whether samples determine them, and what follows them."""

import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.brief import instant, instants
from symmotion.errors import InputError
from symmotion.motions import Keyframes
from symmotion.splines import BSplineBasis, Spline, from_origin, unified

SPARSE = 0.75  # controls per sample up to which knots lie at equal numbers of samples


def fit_basis(times: np.ndarray, used: np.ndarray, degree: int, controls: int | None, knots) -> BSplineBasis:
    """The clamped basis over `times` (M,) for a number of controls, or with given inner knots; used: sample numbers."""
    if (controls is None) == (knots is None):
        raise InputError("either controls, their number, or knots, the inner knots, is needed")
    origin, times = from_origin(times)
    if controls is None:
        inner = checks.array(knots, ("K",), "knots") - origin
    else:
        controls = checks.whole(controls, degree + 1, "controls", f" for degree {degree}")
        if len(used) < controls:
            raise InputError(f"{len(used)} samples cannot determine {controls} controls: ask for {len(used)} or fewer")
        inner = _inner(times[used], degree, controls)
    ends = [np.full(degree + 1, t) for t in times[[0, -1]]]
    # A knot that misses a sample by its rounding would leave it inside a support where it weighs nothing.
    inner = unified(inner, times, origin)
    return BSplineBasis(np.concatenate([ends[0], inner, ends[1]]), degree, origin=origin)


def _inner(times: np.ndarray, degree: int, controls: int) -> np.ndarray:
    """(controls − degree − 1,) the inner knots for a number of controls, at most as many as times (M,)."""
    m = len(times)
    if controls <= SPARSE * m:
        # Equal numbers of samples between the knots: where samples are dense there is detail to follow.
        return np.interp(np.linspace(0, m - 1, controls - degree + 1), np.arange(m), times)[1:-1]
    # Knots closer to each other than samples, as equal numbers would have them, pass from samples to between them,
    # where splines of odd degree hardly see an alternating error: of 300 cubic controls for 300 samples the condition
    # is 1e16. With as many sites as controls, knots at sites, or amid for even degrees, it is 4 (de Boor 1978, XIII).
    sites = np.interp(np.linspace(0, m - 1, controls), np.arange(m), times)
    sites, half = (sites, (degree + 1) // 2) if degree % 2 else (0.5 * (sites[1:] + sites[:-1]), degree // 2)
    return sites[half : len(sites) - half]


def _supports(basis: BSplineBasis) -> tuple[np.ndarray, np.ndarray]:
    """(n,) each: where the support of every control begins and ends, from the origin on; the domain's ends inside."""
    low, high = basis.knots[: basis.n].copy(), basis.knots[-basis.n :].copy()
    low[0], high[-1] = np.nextafter(low[0], -np.inf), np.nextafter(high[-1], np.inf)
    return low, high


def require_determined(basis: BSplineBasis, times: np.ndarray, used: np.ndarray) -> None:
    """Raise InputError unless every control gets a sample of its own inside its support, in order."""
    taken, times = -1, times - basis.origin
    low, high = _supports(basis)
    firsts = np.searchsorted(times[used], low, side="right").tolist()
    ends = np.searchsorted(times[used], high, side="left").tolist()
    for j, (first, end) in enumerate(zip(firsts, ends, strict=True)):
        free = max(first, taken + 1)
        if free >= end:
            there = f"samples {used[first]} to {used[end - 1]}" if end > first else "no samples"
            first, last = instants(*(basis.origin + np.clip([low[j], high[j]], *basis.knots[[0, -1]])))
            raise InputError(
                f"control {j} acts between the times {first} and {last}, where there are {there}: "
                "too few for the controls there; move the knots or ask for fewer controls"
            )
        taken = free


def require_free(basis: BSplineBasis, times: np.ndarray, exact: np.ndarray) -> None:
    """Raise InputError unless every exact sample gets a control of its own that acts there, in order."""
    (low, high), since = _supports(basis), times - basis.origin
    taken = -1
    firsts = np.searchsorted(high, since[exact], side="right").tolist()
    ends = np.searchsorted(low, since[exact], side="left").tolist()
    for i, first, end in zip(exact, firsts, ends, strict=True):
        taken = max(first, taken + 1)
        if taken >= end:
            raise InputError(
                f"exact sample {i} (time {instant(float(times[i]))}) and those before it are more conditions than the "
                "controls that act there: ask for more controls or fewer exact samples"
            )


def least_squares(basis: BSplineBasis, samples: Keyframes, used: np.ndarray, weights: np.ndarray) -> Spline:
    """The spline of least Σ w_i ‖s(t_i) − sample_i‖² over the samples used; weight one where an exact one has none."""
    from scipy.interpolate import make_lsq_spline  # here: see Spline._scipy

    roots = np.sqrt(np.where(weights > 0, weights, 1.0)[used])
    since = samples.times[used] - basis.origin
    found = make_lsq_spline(since, samples.coordinates[used], basis.knots, basis.degree, w=roots)
    return Spline(basis, found.c)


def root_of(points: np.ndarray) -> np.ndarray:
    """L (d + 1, d + 1) with ‖(ΔA Δv) L‖² = mean of ‖ΔA p + Δv‖² over the points: Σ (p 1)ᵀ(p 1)/P = L Lᵀ."""
    homogeneous = np.column_stack([points, np.ones(len(points))]) / np.sqrt(len(points))
    return np.transpose(np.linalg.qr(homogeneous, mode="r"))


def body_points(points: ArrayLike | None, d: int) -> np.ndarray:
    points = np.concatenate([np.eye(d), -np.eye(d)]) if points is None else checks.numbers(points, "body points")
    if points.ndim != 2 or points.shape[1] != d or not np.isfinite(points).all():
        raise InputError(f"body points of shape {points.shape}: finite, shape (P, {d}), is needed")
    if np.linalg.matrix_rank(np.column_stack([points, np.ones(len(points))])) <= d:
        raise InputError(f"the {len(points)} body points do not fix an affine position: {d + 1} that span are needed")
    return points


def sample_weights(weights: ArrayLike | None, m: int) -> np.ndarray:
    weights = np.ones(m) if weights is None else checks.numbers(weights, "weights")
    if weights.shape != (m,):
        raise InputError(f"weights of shape {weights.shape} for {m} samples: ({m},) is needed")
    bad = ~(np.isfinite(weights) & (weights >= 0))
    if bad.any():
        i = int(np.argmax(bad))
        raise InputError(f"the weight of sample {i} is {weights[i]:g}: weights must be finite and not negative")
    return weights
