"""Fairing of a whole net at once: min ΣL + w Σ|d − d⁰|², one sparse linear system."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from symmotion.errors import InputError
from symmotion.fairing.jumps import Jumps

# Weights tried by `for_target`, relative to the largest diagonal entry of the system.
LIGHTEST, HEAVIEST = 1e-14, 1e2


@dataclass(frozen=True, eq=False)
class LeastSquares:
    """min ΣL + w Σ|d_ij − d⁰_ij|² over a box of the controls, the others fixed.

    The normal equations (P_u ⊗ M_v + M_u ⊗ P_v + w) δ = −DᵀΔ⁰, with P = aᵀa and M = NᵀN of each
    direction, are solved by sparse LU with the symmetric ordering.

    net: (n, m, C) d⁰; free: the box.
    """

    jumps: Jumps
    net: np.ndarray
    free: tuple[slice, slice]

    @cached_property
    def matrix(self) -> sparse.csc_array:
        """The Gram matrix of all jumps, without w."""
        (pu, mu), (pv, mv) = (
            (sparse.csr_array(a.T @ a), sparse.csr_array(b.T @ b))
            for a, b in (
                (sparse.csr_array(d.jumps[:, f]), sparse.csr_array(d.values[:, f]))
                for d, f in zip((self.jumps.u, self.jumps.v), self.free, strict=True)
            )
        )
        return sparse.csc_array(sparse.kron(pu, mv) + sparse.kron(mu, pv))

    @cached_property
    def slope(self) -> np.ndarray:
        """(N, C) DᵀΔ⁰, half the gradient of G at the start."""
        spread = self.jumps.spread(self.jumps.at(self.net))[self.free]
        return spread.reshape(-1, spread.shape[-1])

    def solve(self, weight: float) -> np.ndarray:
        """The net (n, m, C) for a weight w > 0."""
        from scipy.sparse.linalg import splu  # here: see Spline

        system = self.matrix + weight * sparse.eye_array(self.matrix.shape[0], format="csc")
        # Positive definite: no pivoting, and an ordering for symmetric patterns.
        factor = splu(system, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        change = factor.solve(-self.slope)
        net = self.net.copy()
        net[self.free] += change.reshape(net[self.free].shape)
        return net

    def for_target(self, target: float) -> tuple[np.ndarray, float]:
        """The net of the largest weight with G ≤ target, and that weight; G grows with w.

        Raises InputError that says how far G can fall where the target is below that.
        """
        from scipy.optimize import brentq  # here: see Spline

        scale = float(np.abs(self.matrix.diagonal()).max())
        tried: dict[float, tuple[np.ndarray, float]] = {}

        def excess(exponent: float) -> float:
            if exponent not in tried:
                net = self.solve(scale * np.exp(exponent))
                tried[exponent] = net, float(self.jumps.fairness(net).sum())
            return float(np.log(max(tried[exponent][1], 1e-300) / target))

        low, high = np.log(LIGHTEST), np.log(HEAVIEST)
        if excess(low) > 0:
            raise InputError(
                f"target {target:g}: with the ring of controls fixed G cannot fall below {tried[low][1]:.3g}"
            )
        if excess(high) <= 0:
            return tried[high][0], scale * HEAVIEST
        brentq(excess, low, high, xtol=1e-3)
        best = max(e for e, (_, value) in tried.items() if value <= target)
        return tried[best][0], scale * float(np.exp(best))
