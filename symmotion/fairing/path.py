"""How much to fair: G against displacement for all weights, its corner, and the discrepancy with a noise."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.errors import InputError
from symmotion.fairing.borders import Borders, Freedom
from symmotion.fairing.coordinates import Coordinates, Fairable
from symmotion.fairing.jumps import Jumps
from symmotion.fairing.keyframes import Asked, held
from symmotion.fairing.least_squares import LeastSquares
from symmotion.fairing.metrics import Metric

# Weights of a path, relative to `LeastSquares.scale`; points of the curve that are looked at.
LIGHTEST, HEAVIEST, FINE = 1e-11, 1e1, 2001
# Slope of log D by log w below which there is nothing to weigh any more.
STILL = 1e-2


@dataclass(frozen=True, eq=False)
class FairingPath:
    """The nets of min ΣL + w Σ|d − d⁰|², for all w: cubics in log w through a few solves and their slopes.

    G and the displacement D = Σ|d − d⁰|² are monotone in w, and dG = −w dD along the path.

    weights: (P,) increasing; fairness: (P,) G; displacement: (P,) D; slopes: (P,) dD / d log w; coordinates: N, free.

    Raises InputError for weights outside of the path.

    >>> path = sm.fairing.fairing_path(sm.motions.noisy_net(sm.motions.smooth_net(7), 0.01, seed=1), count=5)
    >>> bool((np.diff(path.displacement) <= 1e-9).all())
    True
    """

    weights: np.ndarray
    fairness: np.ndarray
    displacement: np.ndarray
    slopes: np.ndarray
    coordinates: int

    def __repr__(self) -> str:
        w, g, d = (f"{part[0]:.3g} to {part[-1]:.3g}" for part in (self.weights, self.fairness, self.displacement))
        return f"FairingPath({len(self.weights)} weights, {w}; G {g}, Σ|d − d⁰|² {d}, {self.coordinates} coordinates)"

    def at(self, weight: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """G and D at weights within the path, between its solves by the cubic of their logarithms."""
        from scipy.interpolate import CubicHermiteSpline  # here: see Spline

        w = np.log(checks.numbers(weight, "weight"))
        known = np.log(self.weights)
        if not ((w >= known[0] - 1e-9) & (w <= known[-1] + 1e-9)).all():
            raise InputError(f"weight {checks.told(weight)}: within {self.weights[0]:.3g} and {self.weights[-1]:.3g}")
        found = []
        for values, slopes in ((self.fairness, -self.weights * self.slopes), (self.displacement, self.slopes)):
            found.append(np.exp(CubicHermiteSpline(known, np.log(values), slopes / values)(w)))
        return found[0], found[1]

    def corner(self) -> float:
        """The weight at the corner of the L-curve, where (log D, log G) is bent most."""
        w = np.linspace(np.log(self.weights[0]), np.log(self.weights[-1]), FINE)
        g, d = (np.log(x) for x in self.at(np.exp(w[1:-1])))
        dg, dd = np.gradient(g, w[1:-1]), np.gradient(d, w[1:-1])
        bend = dd * np.gradient(dg, w[1:-1]) - dg * np.gradient(dd, w[1:-1])
        curvature = bend / np.maximum(dd * dd + dg * dg, 1e-300) ** 1.5
        # As w grows log D falls and log G rises: the corner of the L is the turn to the right.
        # Where the displacement hardly changes any more the curve has come to its end, in rounding.
        curvature[np.abs(dd) < STILL] = 0.0
        return float(np.exp(w[1 + int(np.argmin(curvature[2:-2])) + 2]))

    def discrepancy(self, noise: float) -> float:
        """The weight at which D = N σ², the lightest where all nets are nearer; InputError where all are further."""
        square = self.coordinates * checks.positive(noise, "noise") ** 2
        w = np.linspace(np.log(self.weights[0]), np.log(self.weights[-1]), FINE)
        d = self.at(np.exp(w))[1]
        if d[-1] > square:
            least = np.sqrt(d[-1] / self.coordinates)
            raise InputError(f"noise {noise:g}: all nets of the path move by {least:.3g} a coordinate or more")
        return float(np.exp(np.interp(-np.log(square), -np.log(d), w)))


def fairing_path(
    motion: Fairable,
    *,
    weights: ArrayLike | None = None,
    count: int = 17,
    region: object = None,
    parts: str | None = None,
    length: float = 1.0,
    keyframes: Sequence[Asked] = (),
    borders: Borders = "ring",
    metric: ArrayLike | None = None,
    control_weights: ArrayLike | None = None,
) -> FairingPath:
    """The path of the least squares over their weight, at the cost of a factorisation for each of a few weights.

    weights: (P,) those to solve for, `count` over twelve decades when left out; the others as for `fair`, whose
    `weights` are `control_weights` here.

    motion, region, parts, length, keyframes, borders, metric: as for `fair`. Raises InputError as it does, and for
    a net that is fair already.

    >>> import symmotion as sm
    >>> net = sm.motions.noisy_net(sm.motions.smooth_net(8), 0.01)
    >>> path = sm.fairing.fairing_path(net)
    >>> faired = sm.fair(net, "least-squares", weight=path.corner())
    """
    coordinates = Coordinates.of(motion, parts, length)
    jumps = Jumps.of(coordinates.bases)
    net = coordinates.net
    freedom = Freedom.of(coordinates, jumps, region, borders)
    form = Metric.of(net.shape, control_weights, metric)
    problem = LeastSquares(jumps, net, freedom, held(coordinates, keyframes), form)
    if weights is None:
        given = problem.scale * np.geomspace(LIGHTEST, HEAVIEST, checks.whole(count, 3, "count"))
    else:
        given = checks.times(weights, "weights", least=3)
        checks.positive(float(given[0]), "weights")
    found = [problem.along(float(w)) for w in given]
    fairness = np.array([float(jumps.fairness(f.net).sum()) for f, _ in found])
    displacement = np.array([problem.displaced(f.net) for f, _ in found])
    if not (displacement > 0).all() or not (fairness > 0).all():
        raise InputError("a net that is fair already has no path: no weight moves it")
    count_free = freedom.u.shape[1] * freedom.v.shape[1] * net.shape[-1]
    return FairingPath(given, fairness, displacement, np.array([s for _, s in found]) * given, count_free)
