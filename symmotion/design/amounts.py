"""How much to smooth: the weight of a roughness by generalised cross-validation, or by the noise where it is known."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from symmotion import checks
from symmotion.energies import Roughness
from symmotion.errors import InputError
from symmotion.motions import Keyframes
from symmotion.splines import BSplineBasis, Spline
from symmotion.splines.instants import distinct
from symmotion.splines.penalised import Factor, banded, cholesky, gram, log_det, natural, solved

# Steps of log λ, over times of length 1: from all of the noise to none but a polynomial.
EXPONENTS = np.linspace(-50.0, 10.0, 31)
STEP = 1e-3
HOPELESS = 1e300  # a score that no other exceeds, and a number all the same
ORDERS = (2, 3)
FEWEST = 8  # samples of which noise can be estimated
SHARE = 3.0  # controls per degree of freedom
TAKEN = 0.8  # degrees of freedom a sample beyond which what is left hardly tells the noise

Noise: TypeAlias = float | Sequence[float] | None


def noise_levels(noise: Noise, none: str) -> tuple[float, float] | None:
    """(σ of places, σ of turns), None where it is to be estimated; InputError for what is neither.

    none: what to do where there is no noise, as messages say it.
    """
    if noise is None:
        return None
    if isinstance(noise, int | float) and not isinstance(noise, bool) and noise == 0:
        return 0.0, 0.0
    if isinstance(noise, str) or np.shape(noise) != (2,):
        raise InputError(f"noise {checks.told(noise)}: (σ of places, σ of turns in rad), {none}, is needed")
    place, turn = (checks.not_negative(float(value), "noise") for value in np.asarray(noise))
    if (place == 0) != (turn == 0):
        raise InputError(f"noise of one part is 0 and of the other is not: give both, or {none}")
    return place, turn


@dataclass(frozen=True)
class Amount:
    """The weight λ of ∫ ‖x^(order)‖² dt beside Σ ‖x(t_i) − x_i‖², and what comes of it.

    freedom: trace of the matrix that takes samples to the motion's values, between order and M; noise: standard
    deviation of a coordinate that is left; score: the criterion, which compares amounts for the same samples.

    >>> t = np.linspace(0, 1, 30)
    >>> basis = sm.splines.BSplineBasis.clamped(np.linspace(0, 1, 20), 3)
    >>> from symmotion.smoothing import amount
    >>> amount(basis, t, np.sin(9 * t)[:, None], 2, noise=0.01).weight > 0
    True
    """

    order: int
    weight: float
    freedom: float
    noise: float
    score: float


def amount(
    basis: BSplineBasis,
    times: np.ndarray,
    values: np.ndarray,
    order: int,
    noise: float | None = None,
    weights: np.ndarray | None = None,
) -> Amount:
    """The weight for samples (M, c) at times (M,) over a basis that serves them.

    Least of GCV(λ) = M RSS(λ)/(M − tr H(λ))² (Craven and Wahba 1979), or with the noise σ of a coordinate of
    Mallows' RSS + 2σ² c tr H. The trace is n − d log det(BᵀB + λP)/d log λ: banded Cholesky factors are all it takes,
    so that a value costs O(n).

    values: (M, c); order: of the derivative, 2 or 3. weights: (M,) positive, of the samples, ones when left out; the
    noise is that of a sample of weight 1.

    Raises InputError for an order above the degree of the basis.

    >>> t = np.linspace(0, 1, 30)
    >>> basis = sm.splines.BSplineBasis.clamped(np.linspace(0, 1, 20), 3)
    >>> from symmotion.smoothing import amount
    >>> found = amount(basis, t, np.sin(9 * t)[:, None], 2, noise=0.01)
    >>> 2 < found.freedom < 30
    True
    """
    return _Penalised(basis, times, order, weights).amount(values, noise)


def controls_of(
    basis: BSplineBasis, times: np.ndarray, values: np.ndarray, chosen: Amount, weights: np.ndarray | None = None
) -> np.ndarray:
    """(n, c) the controls of the spline that an amount leads to."""
    return _Penalised(basis, times, chosen.order, weights).controls(values, chosen)


@dataclass(frozen=True)
class Smoothing:
    """How much to smooth turn and place of samples of a body in space or the plane, chosen apart.

    count: of the samples; given: whether by their noise, else by cross-validation.
    """

    turn: Amount
    place: Amount
    dimension: int
    count: int
    given: bool

    @staticmethod
    def of(
        samples: Keyframes,
        noise: tuple[float, float] | None,
        basis: BSplineBasis | None = None,
        orders: Sequence[int] = ORDERS,
        weights: np.ndarray | None = None,
    ) -> "Smoothing":
        """What serves samples best, of splines over a basis, else of all: with a knot at every sample.

        weights: (M,) positive, of the samples; the noise is that of a sample of weight 1.
        """
        m, d = len(samples), samples.dimension
        # A turn by a small angle about each axis with σ changes d² entries of A by d(d − 1)σ² in all.
        sigmas = (None, None) if noise is None else (noise[1] * np.sqrt((d - 1) / d), noise[0])
        sites = distinct(samples.times, samples.times[[0, -1]])
        bases = {k: basis or BSplineBasis.clamped(sites, 2 * k - 1) for k in orders if basis or len(sites) > 2 * k}
        problems = [_Penalised(b, samples.times, k, weights) for k, b in bases.items()]
        if not problems:
            raise InputError(f"{m} samples at {len(sites)} times are too few to smooth: 5 or more are needed")
        turn, place = (
            min((problem.amount(part, sigma) for problem in problems), key=lambda found: found.score)
            for part, sigma in zip((samples.linear.reshape(m, -1), samples.translation), sigmas, strict=True)
        )
        return Smoothing(turn, place, d, m, noise is not None)

    @property
    def degree(self) -> int:
        """That of the splines of least roughness."""
        return max(2 * a.order - 1 for a in (self.turn, self.place))

    @property
    def noise(self) -> tuple[float, float]:
        """(σ of places, σ of turns in rad) about each axis, that are left."""
        return self.place.noise, float(self.turn.noise * np.sqrt(self.dimension / (self.dimension - 1)))

    def controls(self, degree: int) -> int:
        """How many serve: three for each degree of freedom, at most one a sample."""
        freedom = max(self.turn.freedom, self.place.freedom)
        return int(min(self.count, max(degree + 2, np.ceil(SHARE * freedom))))

    def roughness(self, spread: float) -> Roughness:
        """The energy beside the mean of ‖Δv + ΔA p‖² over body points p, whose coordinates have the variance spread."""
        turn, place = self.turn, self.place
        return Roughness(turn.weight * spread, place.weight, (turn.order, place.order))

    def start(self, basis: BSplineBasis, samples: Keyframes, weights: np.ndarray | None = None) -> Spline:
        """Over a basis the spline of least roughness and deviation: what the program has its minimum at."""
        values = (samples.linear.reshape(len(samples), -1), samples.translation)
        amounts = self.turn, self.place
        problems = {k: _Penalised(basis, samples.times, k, weights) for k in {a.order for a in amounts}}
        found = [problems[a.order].controls(part, a) for part, a in zip(values, amounts, strict=True)]
        return Spline(basis, np.concatenate(found, axis=1))

    @property
    def how(self) -> str:
        """By what it was chosen."""
        return "by the noise given" if self.given else "by generalised cross-validation"

    def counted(self, degree: int, controls: int) -> str:
        """Which spline follows how many samples."""
        return f"a spline of degree {degree} with {controls} controls follows {self.count} keyframes"

    def notes(self, degree: int, controls: int) -> list[str]:
        """What was chosen, and of which noise it tells."""
        said = [f"{self.counted(degree, controls)}, smoothed {self.how}"]
        place, turn = self.noise
        for chosen, name, part, left in ((self.place, "place", "v", ""), (self.turn, "turn", "A", " rad")):
            said.append(
                f"{name}: λ = {chosen.weight:.3g} on ∫ ‖{part}^({chosen.order})‖², {chosen.freedom:.4g} degrees of "
                f"freedom, σ = {place if part == 'v' else turn:.3g}{left} left"
            )
            if not self.given and chosen.freedom > TAKEN * self.count:
                said[-1] += ", which leaves little to tell noise by: give it where it is known"
        return said


class _Penalised:
    """Σ w_i ‖x(t_i) − x_i‖² + λ ∫ ‖x^(order)‖² over a basis, times counted so that they have the length 1.

    Its methods take the values x_i, (M, c); what is factorised is kept, and serves all of them.
    """

    def __init__(self, basis: BSplineBasis, times: np.ndarray, order: int, weights: np.ndarray | None):
        times, basis = times - basis.origin, basis.relative
        a, b = basis.domain
        self.length, self.order = b - a, order
        basis = BSplineBasis((basis.knots - a) / self.length, basis.degree)
        self.design, penalty = basis.matrix(np.clip((times - a) / self.length, 0.0, 1.0)), gram(basis, order)
        # With a knot at every sample these determine all controls but those that natural ends do.
        every = basis.degree == 2 * order - 1 and basis.n > len(distinct(times))
        self.whole = natural(basis, order) if every else None
        if self.whole is not None:
            self.design, penalty = self.design @ self.whole, self.whole.T @ penalty @ self.whole
        self.roots = np.ones((len(times), 1)) if weights is None else np.sqrt(weights)[:, None]
        self.design = self.design.multiply(self.roots).tocsr()
        self.count = self.design.shape[1]
        self.gram, self.penalty = (banded(m, basis.degree) for m in (self.design.T @ self.design, penalty))
        self._factors: dict[float, Factor] = {}

    def amount(self, values: np.ndarray, noise: float | None) -> Amount:
        """The weight of least score, see `amount`."""
        from scipy.optimize import minimize_scalar  # here: see Spline._scipy

        values = self._scaled(values)
        right = self.design.T @ values
        scores = np.array([self._score(exponent, values, right, noise) for exponent in EXPONENTS])
        best = int(np.argmin(scores))
        bounds = EXPONENTS[max(best - 1, 0)], EXPONENTS[min(best + 1, len(EXPONENTS) - 1)]
        given, options = (values, right, noise), {"xatol": 0.02}
        found = minimize_scalar(self._score, args=given, bounds=bounds, method="bounded", options=options)
        exponent = float(found.x) if found.fun <= scores[best] else float(EXPONENTS[best])
        freedom, squares = self._freedom(exponent), self._squares(exponent, values, right)
        left = max(len(values) - freedom, 1e-6) * values.shape[1]
        weight = float(np.exp(exponent)) * self.length ** (2 * self.order - 1)
        return Amount(self.order, weight, freedom, float(np.sqrt(squares / left)), self._score(exponent, *given))

    def controls(self, values: np.ndarray, chosen: Amount) -> np.ndarray:
        """(n, c) the controls of the spline that an amount leads to."""
        exponent = float(np.log(chosen.weight / self.length ** (2 * self.order - 1)))
        found = solved(self._factor(exponent), self.design.T @ self._scaled(values))
        return (found if self.whole is None else self.whole @ found) + values.mean(axis=0)

    def _scaled(self, values: np.ndarray) -> np.ndarray:
        return self.roots * (values - values.mean(axis=0))

    def _factor(self, exponent: float) -> Factor:
        if exponent not in self._factors:
            self._factors[exponent] = cholesky(self.gram + np.exp(exponent) * self.penalty)
        return self._factors[exponent]

    def _squares(self, exponent: float, values: np.ndarray, right: np.ndarray) -> float:
        """RSS, over all coordinates."""
        return float(((values - self.design @ solved(self._factor(exponent), right)) ** 2).sum())

    def _freedom(self, exponent: float) -> float:
        """tr H."""
        sizes = [log_det(self._factor(exponent + h)) / 2 for h in (-STEP, STEP)]
        return float(np.clip(self.count - (sizes[1] - sizes[0]) / STEP, self.order, len(self.roots)))

    def _score(self, exponent: float, values: np.ndarray, right: np.ndarray, noise: float | None) -> float:
        """The criterion; large where the factors have no digits left, or nothing is left to tell."""
        try:
            freedom, squares = self._freedom(exponent), self._squares(exponent, values, right)
        except np.linalg.LinAlgError:
            return HOPELESS
        m, c = values.shape
        if noise is not None:
            return squares / m + 2 * noise**2 * c * freedom / m
        left = m - freedom
        # Where as many controls as samples are free nothing is left to tell noise from motion.
        return float(np.log(max(squares, 1e-300)) - 2 * np.log(left)) if left > 0.05 * m else HOPELESS
