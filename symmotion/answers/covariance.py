"""How well a fit is known: the covariance of its motion from that of the samples, and bands of the pose over time."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.brief import between
from symmotion.design.fitting import SAMPLES, FitDesign
from symmotion.errors import InputError
from symmotion.motions import Affine, Keyframes
from symmotion.motions.rigid import polar_factors
from symmotion.pictures import plot_band
from symmotion.solvers import Solution
from symmotion.values import read_only

# Numbers of a batch of gradients by the samples.
BATCH = 4_000_000


@dataclass(frozen=True, eq=False)
class Band:
    """Standard deviations of a pose over time.

    times: (N,); positions: `Affine`, the mean (N, d, d), (N, d). places: (N, d, d) covariances of the origin, in
    units of length²; turns: (N, 3, 3) of small turns about the fixed axes, in rad², (N, 1, 1) in the plane.

    >>> samples = sm.examples.recorded_tour(60)
    >>> fit = sm.ExactNewton().solve(sm.fit_program(samples, controls=20)).require()
    >>> sm.answers.fit_covariance(fit, (0.001, 0.002)).band(5).places.shape
    (5, 3, 3)
    """

    times: np.ndarray
    positions: Affine
    places: np.ndarray
    turns: np.ndarray

    def __repr__(self) -> str:
        places, turns = (f"{known.min():.2g} to {known.max():.2g}" for known in (self.place, self.turn))
        first, last = self.times[[0, -1]]
        return f"Band({len(self.times)} times, {between(first, last)}; places off by {places}, turns by {turns} rad)"

    @property
    def place(self) -> np.ndarray:
        """(N,) how far the origin is off, root mean square."""
        return np.sqrt(np.trace(self.places, axis1=1, axis2=2))

    @property
    def turn(self) -> np.ndarray:
        """(N,) by what angle the body is off, root mean square [rad]."""
        return np.sqrt(np.trace(self.turns, axis1=1, axis2=2))

    plot = plot_band


@dataclass(frozen=True, eq=False)
class FitCovariance:
    """The covariance of a fit to first order, cov(x) = H⁻¹ C Σ Cᵀ H⁻¹ along the conditions, C = ∂²f/∂x∂y.

    samples: (M, d² + d, d² + d) Σ, of each sample's coordinates, rows of A first; samples are independent.
    sizes: the standard deviations of places and turns [rad] that they were made of, None where they were given.

    solution: of the fit. Raises InputError for times outside of the motion.

    >>> samples = sm.examples.recorded_tour(60)
    >>> fit = sm.ExactNewton().solve(sm.fit_program(samples, controls=20)).require()
    >>> covariance = sm.answers.fit_covariance(fit, (0.001, 0.002))
    >>> covariance.band(3).turns.shape
    (3, 3, 3)
    """

    solution: Solution
    samples: np.ndarray
    sizes: tuple[float, float] | None

    def __repr__(self) -> str:
        known = "given" if self.sizes is None else "σ of places {:.3g}, of turns {:.3g} rad".format(*self.sizes)
        return f"FitCovariance({len(self.samples)} samples, {known}; of {self.solution!r})"

    def of(self, gradient: ArrayLike) -> np.ndarray:
        """(k, k) the covariance of scalars of the motion with gradients (k, unknowns) by x; a number for one."""
        given = checks.numbers(gradient, "gradient")
        pulls = _pulls(self.solution, np.atleast_2d(given))
        covariance = np.einsum("kma,mab,lmb->kl", pulls, self.samples, pulls, optimize=True)
        return covariance if given.ndim == 2 else covariance[0, 0]

    def coordinates(self, times: ArrayLike) -> np.ndarray:
        """(N, d² + d, d² + d) the covariances of (A, v) at times (N,), rows of A first."""
        instants = checks.array(times, ("N",), "times")
        found = []
        for rows in _batches(self.solution, instants, self.samples.shape[0]):
            pulls = _pulls(self.solution, rows)
            weighted = np.einsum("ncma,mab->ncmb", pulls, self.samples, optimize=True)
            found.append(np.einsum("ncmb,nemb->nce", weighted, pulls, optimize=True))
        return np.concatenate(found)

    def band(self, times: int | ArrayLike = 100) -> Band:
        """The band of the pose at times (N,), or at as many equally spaced."""
        a, b = self.solution.motion.domain
        count = isinstance(times, int | np.integer)
        instants = np.linspace(a, b, checks.whole(times, 2, "times")) if count else checks.array(times, ("N",), "times")
        positions = Affine(*self.solution.motion(instants))
        covariances, d = self.coordinates(instants), positions.translation.shape[1]
        turning = _turning(positions.linear)
        turns = turning @ covariances[:, : d * d, : d * d] @ np.swapaxes(turning, 1, 2)
        return Band(instants, positions, covariances[:, d * d :, d * d :], turns)


def fit_covariance(solution: Solution, noise: tuple[float, float] | ArrayLike | None = None) -> FitCovariance:
    """How well the motion of a `fit_program` is known, given how well its samples are.

    noise: standard deviations of a sample's place, each coordinate, in the unit of length, and of its turn about each
        axis in rad; or covariances of its coordinates (d² + d, d² + d), rows of A first, one or (M, …) one of each;
        None to be estimated from what the fit leaves, by the degrees of freedom that the fit has not taken.

    solution: of a `fit_program`. Raises InputError for others, and for noise of other shapes.

    >>> samples = sm.examples.recorded_tour(60)
    >>> fit = sm.ExactNewton().solve(sm.fit_program(samples, controls=20)).require()
    >>> sm.answers.fit_covariance(fit, (0.001, 0.002)).band(3).positions.translation.shape
    (3, 3)
    """
    if not isinstance(solution, Solution) or not isinstance(solution.program.design, FitDesign):
        raise InputError("covariance: the solution of a fit_program is needed")
    samples = solution.program.design.samples
    d, m = samples.dimension, len(samples)
    given = noise_of(solution) if noise is None else noise
    values = checks.numbers(given, "noise")
    if values.shape == (2,):
        if not (np.isfinite(values).all() and (values >= 0).all()):
            raise InputError(f"noise {values.tolist()}: standard deviations, 0 or more, are needed")
        return FitCovariance(solution, _of_sizes(samples, *values.tolist()), (float(values[0]), float(values[1])))
    width = d * d + d
    if values.shape not in ((width, width), (m, width, width)) or not np.isfinite(values).all():
        raise InputError(
            f"noise of shape {values.shape}: standard deviations of places and turns (2,), or finite covariances "
            f"{checks.shown((width, width))} or {checks.shown((m, width, width))}, are needed"
        )
    return FitCovariance(solution, read_only(np.broadcast_to(values, (m, width, width)).copy()), None)


def noise_of(solution: Solution) -> tuple[float, float]:
    """Standard deviations of places and turns [rad], each coordinate, of the samples of a fit, from its residuals.

    Σ rᵢ² divided by the number of residuals less the trace of ∂fitᵢ/∂sampleᵢ.

    solution: of a `fit_program`.

    Raises InputError where the fit leaves no degree of freedom to tell noise from.

    >>> samples = sm.examples.recorded_tour(100)
    >>> fit = sm.ExactNewton().solve(sm.fit_program(samples, controls=20)).require()
    >>> places, turns = sm.answers.noise_of(fit)
    """
    design = solution.program.design
    samples, which = design.samples, design.followed
    d = samples.dimension
    linear, translation = solution.motion(samples.times)
    own, fitted = polar_factors(samples.linear)[0], polar_factors(linear)[0]
    turning, free = _turning(linear), np.zeros(2)
    first = 0
    for rows in _batches(solution, samples.times[which], len(samples)):
        pulls = _pulls(solution, rows)
        for k, i in enumerate(which[first : first + len(rows)]):
            shift = pulls[k][:, i]
            spun = _generators(d) @ own[i]
            free[0] += np.trace(shift[d * d :, d * d :])
            free[1] += np.trace(turning[i] @ shift[: d * d, : d * d] @ spun.reshape(-1, d * d).T)
        first += len(rows)
    apart = (translation - samples.translation)[which]
    relative = (fitted @ np.swapaxes(own, 1, 2))[which]
    angles = 0.5 * np.einsum("kij,nij->nk", _generators(d), relative)
    sums, counts = np.array([(apart**2).sum(), (angles**2).sum()]), np.array([apart.size, angles.size])
    if (counts - free <= 0).any():
        raise InputError("noise: the fit leaves no degree of freedom to tell it from; give standard deviations")
    place, turn = np.sqrt(sums / (counts - free)).tolist()
    return place, turn


def _batches(solution: Solution, times: np.ndarray, samples: int) -> Iterator[np.ndarray]:
    """(N', d² + d, unknowns) the gradients of the coordinates of (A, v) by x, for a few times each."""
    design = solution.program.design
    width = design.samples.dimension**2 + design.samples.dimension
    each = max(1, BATCH // (width * width * samples + width * solution.program.unknowns))
    for first in range(0, len(times), each):
        values = design.basis(times[first : first + each])
        yield np.einsum("nj,ca->ncja", values, np.eye(width)).reshape(len(values), width, -1)


def _pulls(solution: Solution, gradients: np.ndarray) -> np.ndarray:
    """(…, M, d² + d) the gradients by the samples' coordinates of scalars with gradients (…, unknowns) by x."""
    pulled = solution.sensitivity().operator(SAMPLES).rmatmat(gradients.reshape(-1, gradients.shape[-1]).T)
    return pulled.T.reshape(*gradients.shape[:-1], len(solution.program.design.samples), -1)


def _generators(d: int) -> np.ndarray:
    """(3, 3, 3) [eₖ], (1, 2, 2) in the plane: small turns about the fixed axes."""
    if d == 2:
        return np.array([[[0.0, -1.0], [1.0, 0.0]]])
    found = np.zeros((3, 3, 3))
    for k, (i, j) in enumerate(((2, 1), (0, 2), (1, 0))):
        found[k, i, j], found[k, j, i] = 1.0, -1.0
    return found


def _turning(linear: np.ndarray) -> np.ndarray:
    """(N, 3 or 1, d²) the turn of the polar factor by the entries of A (N, d, d), about the fixed axes."""
    d, (rotation, stretch, _) = linear.shape[-1], polar_factors(linear)
    generators = _generators(d)
    # dA = [w] M S + M dS: with B = dA Mᵀ and P = M S Mᵀ, B − Bᵀ = [w] P + P [w].
    p = rotation @ stretch @ np.swapaxes(rotation, 1, 2)
    matrix = np.trace(p, axis1=1, axis2=2)[:, None, None] * np.eye(len(generators)) - (p if d == 3 else 0.0)
    entries = np.einsum("kij,njl->nkil", generators, rotation).reshape(len(linear), len(generators), -1)
    return np.linalg.solve(matrix, entries)


def _of_sizes(samples: Keyframes, place: float, turn: float) -> np.ndarray:
    """(M, d² + d, d² + d) the covariances of samples with places and turns off by standard deviations."""
    d, m = samples.dimension, len(samples)
    spun = np.einsum("kij,mjl->mkil", _generators(d), samples.linear).reshape(m, -1, d * d)
    found = np.zeros((m, d * d + d, d * d + d))
    found[:, : d * d, : d * d] = turn**2 * np.swapaxes(spun, 1, 2) @ spun
    found[:, d * d :, d * d :] = place**2 * np.eye(d)
    return read_only(found)
