"""Fairing of a whole net at once: min ΣL + w Σ|d − d⁰|² subject to keyframes and borders, one sparse linear system."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from symmotion.errors import InputError
from symmotion.fairing.borders import Freedom
from symmotion.fairing.independence import independent
from symmotion.fairing.jumps import Jumps
from symmotion.fairing.keyframes import Held
from symmotion.fairing.metrics import Metric

if TYPE_CHECKING:
    from scipy.sparse.linalg import SuperLU

# Weights tried by `for_target` and `for_displacement`, relative to `LeastSquares.scale`.
LIGHTEST, HEAVIEST = 1e-14, 1e2
# The lightest that leaves the part of the net without jumps some digits, where there is nothing lighter to be had.
LIGHT = 1e-10


@dataclass(frozen=True, eq=False)
class Faired:
    """A net (n, m, C), its weight w, and the multipliers of the keyframes' equations (E,), those of the objective."""

    net: np.ndarray
    weight: float
    multipliers: np.ndarray


@dataclass(frozen=True, eq=False)
class _System:
    """What does not depend on w, in the coordinates y in which the metric is diagonal over the channels.

    gram: (N, N) of all jumps; weigh: (N, N) of the displacement; values: (C',) the factor of `weigh` in each channel;
    axes: (C, C) the channels, None for those of the net; rows: (K, N) the combinations that keyframes read; forms: C'
    matrices (E, K); flat: whether all channels are one, of N = N₀ C unknowns.
    """

    gram: sparse.csc_array
    weigh: sparse.csc_array
    values: np.ndarray
    axes: np.ndarray | None
    rows: sparse.csr_array
    forms: Sequence[sparse.csr_array]
    flat: bool

    def inward(self, y: np.ndarray) -> np.ndarray:
        return y.reshape(-1, 1) if self.flat else y if self.axes is None else y @ self.axes

    def outward(self, y: np.ndarray, channels: int) -> np.ndarray:
        return y.reshape(-1, channels) if self.flat else y if self.axes is None else y @ self.axes.T

    def asked(self, y: np.ndarray) -> np.ndarray:
        """(E,) the left sides of the keyframes' equations."""
        return np.sum([f @ (self.rows @ y[:, c]) for c, f in enumerate(self.forms)], axis=0)


@dataclass(frozen=True, eq=False)
class LeastSquares:
    """min ΣL + w Σ (d_ij − d⁰_ij)ᵀ W_ij (d_ij − d⁰_ij) over what borders leave free, subject to keyframes.

    Without keyframes the normal equations (P_u ⊗ M_v + M_u ⊗ P_v + w) δ = −DᵀΔ⁰, with P = aᵀa and M = NᵀN of each
    direction, are solved by sparse LU with the symmetric ordering. Keyframes Cδ = e make them a saddle, solved by
    the same factor and the small dense C K⁻¹ Cᵀ.

    net: (n, m, C) d⁰. Raises InputError for keyframes that are not independent.
    """

    jumps: Jumps
    net: np.ndarray
    freedom: Freedom
    keyframes: tuple[Held, ...] = ()
    metric: Metric = field(default_factory=Metric)

    @cached_property
    def start(self) -> np.ndarray:
        """(n, m, C) the net with what continued borders ask for."""
        return self.net if self.freedom.shift is None else self.net + self.freedom.shift

    @cached_property
    def gram(self) -> sparse.csc_array:
        """The Gram matrix of all jumps, without w."""
        (pu, mu), (pv, mv) = (
            (sparse.csr_array(a.T @ a), sparse.csr_array(b.T @ b))
            for a, b in (
                (sparse.csr_array(sparse.csr_array(d.jumps) @ z), sparse.csr_array(sparse.csr_array(d.values) @ z))
                for d, z in ((self.jumps.u, self.freedom.u), (self.jumps.v, self.freedom.v))
            )
        )
        return sparse.csc_array(sparse.kron(pu, mv) + sparse.kron(mu, pv))

    @cached_property
    def scale(self) -> float:
        """The weight at which displacements count as much as jumps, by the largest diagonal entries of the two."""
        jumps, system = float(self.gram.diagonal().max(initial=0.0)), self._system
        return (jumps or 1.0) / float(system.weigh.diagonal().max(initial=0.0) * system.values.max() or 1.0)

    @property
    def nearest(self) -> float:
        """The weight by which of nets that are equally fair the nearest is taken."""
        return LIGHT * self.scale

    @cached_property
    def slope(self) -> np.ndarray:
        """(N, C) DᵀΔ⁰, half the gradient of G at the start."""
        return self.freedom.drop(self.jumps.spread(self.jumps.at(self.start)))

    @cached_property
    def pull(self) -> np.ndarray:
        """(N, C) half the gradient of the displacement at the start: what borders have moved already."""
        shift = self.freedom.shift
        return np.zeros_like(self.slope) if shift is None else self.freedom.drop(self.metric.times(shift))

    @cached_property
    def active(self) -> tuple[int, ...]:
        """The keyframes that say something: neither met by controls that stay nor said before."""
        return independent(self.keyframes, self.start, self._basis)

    @cached_property
    def missing(self) -> np.ndarray:
        """(E,) what the start lacks of the active keyframes."""
        flat = self.start.reshape(-1, self.start.shape[-1])
        held = (self.keyframes[i] for i in self.active)
        return np.concatenate(
            [np.zeros(0), *(k.target - np.einsum("ekc,kc->e", k.form, k.combos @ flat) for k in held)]
        )

    @cached_property
    def _basis(self) -> sparse.csr_array:
        return sparse.csr_array(sparse.kron(self.freedom.u, self.freedom.v))

    @cached_property
    def _system(self) -> _System:
        n, m, channels = self.net.shape
        held = [self.keyframes[i] for i in self.active]
        rows = sparse.csr_array(sparse.vstack([k.combos for k in held]) @ self._basis) if held else None
        rows = sparse.csr_array((0, self._basis.shape[1])) if rows is None else rows
        axes = self.metric.principal
        forms = [
            sparse.csr_array(sparse.block_diag([f[..., c] for f in _turned(held, axes)]))
            if held
            else sparse.csr_array((0, 0))
            for c in range(channels)
        ]
        if self.metric.forms is not None:
            eye = sparse.eye_array(channels)
            blocks = self.metric.blocks((n, m, channels)).reshape(-1, channels, channels)
            weigh = sparse.bsr_array((blocks, np.arange(n * m), np.arange(n * m + 1)))
            z = sparse.kron(self._basis, eye, format="csr")
            c_flat = sum(sparse.kron(f @ rows, eye.tocsr()[[c]]) for c, f in enumerate(forms))
            flat_rows = sparse.csr_array(c_flat)
            one = [sparse.csr_array(sparse.eye_array(flat_rows.shape[0]))]
            gram = sparse.csc_array(sparse.kron(self.gram, eye))
            return _System(gram, sparse.csc_array(z.T @ weigh @ z), np.ones(1), None, flat_rows, one, True)
        if self.metric.scale is None:
            weigh = sparse.csc_array(sparse.eye_array(self.gram.shape[0]))
        else:
            weigh = sparse.csc_array(self._basis.T @ sparse.diags_array(self.metric.scale.ravel()) @ self._basis)
        values, turn = (np.ones(channels), None) if axes is None else axes
        return _System(self.gram, weigh, values, turn, rows, forms, False)

    def solve(self, weight: float) -> Faired:
        """The net for a weight w > 0."""
        y, nu = self._solved(self._factors(self._system.gram, weight), self.slope + weight * self.pull, self.missing)
        net = self.start + self.freedom.lift(self._system.outward(y, self.net.shape[-1]))
        return Faired(net, weight, 2 * nu)

    def met(self) -> Faired:
        """The least move after which keyframes and borders hold, with the multipliers of half its square."""
        system = self._system
        found = self._solved(self._factors(None, 1.0), self.pull, self.missing)
        net = self.start + self.freedom.lift(system.outward(found[0], self.net.shape[-1]))
        return Faired(net, 1.0, found[1])

    def along(self, weight: float) -> tuple[Faired, float]:
        """The net for a weight w, and dD/dw of D = Σ|d − d⁰|², by two solves with one factor.

        With K = gram + w W and half the gradient of D, W (s + y) = p, along the net: K y' = −p, D' = 2 pᵀ y'.
        """
        factors = self._factors(self._system.gram, weight)
        y, nu = self._solved(factors, self.slope + weight * self.pull, self.missing)
        net = self.start + self.freedom.lift(self._system.outward(y, self.net.shape[-1]))
        pull = self.freedom.drop(self.metric.times(net - self.net))
        change, _ = self._solved(factors, pull, np.zeros(len(self.missing)))
        slope = 2 * float(np.sum(self._system.inward(pull) * change))
        return Faired(net, weight, 2 * nu), slope

    def _factors(self, gram: sparse.csc_array | None, weight: float) -> "dict[float, SuperLU]":
        """The factor of gram + w value W for each value of the metric's channels."""
        weigh = self._system.weigh
        return {
            value: _factor(weight * value * weigh if gram is None else gram + weight * value * weigh)
            for value in np.unique(self._system.values).tolist()
        }

    def _solved(
        self, factors: "dict[float, SuperLU]", slope: np.ndarray, missing: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """min yᵀ K y / 2 + slopeᵀ y subject to the keyframes' equations C y = missing: y, and their multipliers."""
        system = self._system
        if not system.gram.shape[0]:
            return np.zeros((0, len(system.values))), np.zeros(len(missing))
        y = system.inward(-slope)
        y = np.column_stack([factors[value].solve(y[:, c]) for c, value in enumerate(system.values.tolist())])
        nu = np.zeros(len(missing))
        if len(nu):
            dense = system.rows.T.toarray()
            reached = {value: factor.solve(dense) for value, factor in factors.items()}
            small = {value: system.rows @ r for value, r in reached.items()}
            schur = sum(f @ (f @ small[value].T).T for f, value in zip(system.forms, system.values, strict=True))
            nu = np.linalg.solve(schur, system.asked(y) - missing)
            y = y - np.column_stack(
                [reached[value] @ (f.T @ nu) for f, value in zip(system.forms, system.values, strict=True)]
            )
            y = self._polished(y, missing)
        return y, nu

    def _polished(self, y: np.ndarray, missing: np.ndarray) -> np.ndarray:
        """The nearest y at which the keyframes hold to rounding."""
        system = self._system
        both = (system.rows @ system.rows.T).toarray()
        gram = sum(f @ (f @ both).T for f in system.forms)
        for _ in range(2):
            step = np.linalg.solve(gram, missing - system.asked(y))
            y = y + np.column_stack([system.rows.T @ (f.T @ step) for f in system.forms])
        return y

    def for_target(self, target: float) -> Faired:
        """The net of the largest weight with G ≤ target; G grows with w.

        Raises InputError that says how far G can fall where the target is below that.
        """

        def excess(found: Faired) -> float:
            return float(np.log(max(float(self.jumps.fairness(found.net).sum()), 1e-300) / target))

        low, found = self._where(excess)
        if found is None:
            least = float(self.jumps.fairness(low.net).sum())
            raise InputError(f"target {target:g}: with the ring of controls fixed G cannot fall below {least:.3g}")
        return found

    def displaced(self, net: np.ndarray) -> float:
        """Σ (d − d⁰)ᵀ W (d − d⁰) of a net."""
        moved = net - self.net
        return float(np.sum(moved * self.metric.times(moved)))

    def for_displacement(self, square: float) -> Faired:
        """The net of the smallest weight with Σ|d − d⁰|² ≤ square; that of the lightest weight where all are nearer.

        Raises InputError where keyframes and borders alone ask for more.
        """

        def room(found: Faired) -> float:
            return float(np.log(square / max(self.displaced(found.net), 1e-300)))

        heaviest = self.met()
        if room(heaviest) < 0:
            raise InputError(
                f"noise: keyframes and borders alone move the controls by {self.displaced(heaviest.net) ** 0.5:.3g} in "
                f"all, the noise is {square**0.5:.3g}"
            )
        low, found = self._where(lambda f: -room(f), LIGHT)
        return low if found is None else found

    def _where(self, excess: Callable[[Faired], float], lightest: float = LIGHTEST) -> tuple[Faired, Faired | None]:
        """The net of the lightest weight, and of the weight where a monotone excess(w) changes its sign.

        The second is on the side of excess ≤ 0, None where there is none.
        """
        from scipy.optimize import brentq  # here: see Spline

        scale = self.scale
        tried: dict[float, tuple[Faired, float]] = {}

        def at(exponent: float) -> float:
            if exponent not in tried:
                found = self.solve(scale * np.exp(exponent))
                tried[exponent] = found, excess(found)
            return tried[exponent][1]

        low, high = float(np.log(lightest)), float(np.log(HEAVIEST))
        first, last = at(low), at(high)
        rising = last > first
        if (first if rising else last) > 0:
            return tried[low][0], None
        if (last if rising else first) <= 0:
            return tried[low][0], tried[high if rising else low][0]
        brentq(at, low, high, xtol=1e-3)
        good = [e for e, (_, value) in tried.items() if value <= 0]
        return tried[low][0], tried[max(good) if rising else min(good)][0]


def _turned(held: Sequence[Held], axes: tuple[np.ndarray, np.ndarray] | None) -> list[np.ndarray]:
    """The forms (e, k, C) of keyframes in the metric's channels."""
    return [k.form if axes is None else k.form @ axes[1] for k in held]


def _factor(matrix: sparse.csc_array) -> "SuperLU":
    """Positive definite: no pivoting, and an ordering for symmetric patterns."""
    from scipy.sparse.linalg import splu  # here: see Spline

    return splu(
        sparse.csc_array(matrix), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
