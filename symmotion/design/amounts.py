"""How much to smooth: the weight of a roughness by generalised cross-validation, or by the noise where it is known."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from symmotion.splines import BSplineBasis
from symmotion.splines.instants import distinct
from symmotion.splines.penalised import Factor, banded, cholesky, gram, log_det, natural, solved

# Steps of log λ, over times of length 1: from all of the noise to none but a polynomial.
EXPONENTS = np.linspace(-50.0, 10.0, 31)
STEP = 1e-3
HOPELESS = 1e300  # a score that no other exceeds, and a number all the same
ORDERS = (2, 3)


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
    basis: BSplineBasis, times: np.ndarray, values: np.ndarray, order: int, noise: float | None = None
) -> Amount:
    """The weight for samples (M, c) at times (M,) over a basis that serves them.

    Least of GCV(λ) = M RSS(λ)/(M − tr H(λ))² (Craven and Wahba 1979), or with the noise σ of a coordinate of
    Mallows' RSS + 2σ² c tr H. The trace is n − d log det(BᵀB + λP)/d log λ: banded Cholesky factors are all it takes,
    so that a value costs O(n).

    values: (M, c); order: of the derivative, 2 or 3.

    Raises InputError for an order above the degree of the basis.

    >>> t = np.linspace(0, 1, 30)
    >>> basis = sm.splines.BSplineBasis.clamped(np.linspace(0, 1, 20), 3)
    >>> from symmotion.smoothing import amount
    >>> found = amount(basis, t, np.sin(9 * t)[:, None], 2, noise=0.01)
    >>> 2 < found.freedom < 30
    True
    """
    problem = _Penalised(basis, times, values, order)
    scores = np.array([problem.score(exponent, noise) for exponent in EXPONENTS])
    best = int(np.argmin(scores))
    low, high = EXPONENTS[max(best - 1, 0)], EXPONENTS[min(best + 1, len(EXPONENTS) - 1)]
    from scipy.optimize import minimize_scalar  # here: see Spline._scipy

    found = minimize_scalar(problem.score, args=(noise,), bounds=(low, high), method="bounded", options={"xatol": 0.02})
    exponent = float(found.x) if found.fun <= scores[best] else float(EXPONENTS[best])
    freedom, squares = problem.freedom(exponent), problem.squares(exponent)
    left = max(len(times) - freedom, 1e-6) * values.shape[1]
    weight = float(np.exp(exponent)) * problem.length ** (2 * order - 1)
    return Amount(order, weight, freedom, float(np.sqrt(squares / left)), problem.score(exponent, noise))


def controls_of(basis: BSplineBasis, times: np.ndarray, values: np.ndarray, chosen: Amount) -> np.ndarray:
    """(n, c) the controls of the spline that an amount leads to."""
    problem = _Penalised(basis, times, values, chosen.order)
    exponent = float(np.log(chosen.weight / problem.length ** (2 * chosen.order - 1)))
    found = problem.unknowns(exponent)
    return (found if problem.whole is None else problem.whole @ found) + values.mean(axis=0)


class _Penalised:
    """Σ ‖x(t_i) − x_i‖² + λ ∫ ‖x^(order)‖² over a basis, times counted so that they have the length 1."""

    def __init__(self, basis: BSplineBasis, times: np.ndarray, values: np.ndarray, order: int):
        times, basis = times - basis.origin, basis.relative
        a, b = basis.domain
        self.length = b - a
        basis = BSplineBasis((basis.knots - a) / self.length, basis.degree)
        self.design, penalty = basis.matrix(np.clip((times - a) / self.length, 0.0, 1.0)), gram(basis, order)
        # With a knot at every sample these determine all controls but those that natural ends do.
        every = basis.degree == 2 * order - 1 and basis.n > len(distinct(times))
        self.whole = natural(basis, order) if every else None
        if self.whole is not None:
            self.design, penalty = self.design @ self.whole, self.whole.T @ penalty @ self.whole
        self.count = self.design.shape[1]
        self.gram, self.penalty = (banded(m, basis.degree) for m in (self.design.T @ self.design, penalty))
        self.values = values - values.mean(axis=0)
        self.order = order

    @cached_property
    def right(self) -> np.ndarray:
        return self.design.T @ self.values

    def _factor(self, exponent: float) -> Factor:
        return cholesky(self.gram + np.exp(exponent) * self.penalty)

    def unknowns(self, exponent: float) -> np.ndarray:
        """(count, c) the controls, of a spline with natural ends all that are free; of values without their mean."""
        return solved(self._factor(exponent), self.right)

    def squares(self, exponent: float) -> float:
        """RSS, over all coordinates."""
        return float(((self.values - self.design @ self.unknowns(exponent)) ** 2).sum())

    def freedom(self, exponent: float) -> float:
        """tr H."""
        sizes = [log_det(self._factor(exponent + h)) / 2 for h in (-STEP, STEP)]
        return float(np.clip(self.count - (sizes[1] - sizes[0]) / STEP, self.order, len(self.values)))

    def score(self, exponent: float, noise: float | None) -> float:
        """The criterion; large where the factors have no digits left, or nothing is left to tell."""
        try:
            freedom, squares = self.freedom(exponent), self.squares(exponent)
        except np.linalg.LinAlgError:
            return HOPELESS
        m, c = self.values.shape
        if noise is not None:
            return squares / m + 2 * noise**2 * c * freedom / m
        left = m - freedom
        # Where as many controls as samples are free nothing is left to tell noise from motion.
        return float(np.log(max(squares, 1e-300)) - 2 * np.log(left)) if left > 0.05 * m else HOPELESS
