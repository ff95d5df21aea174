"""Jumps of the third derivative at the knots of bicubic nets and cubic curves, and the tables of local steps."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from symmotion.brief import in_a_line, instant
from symmotion.errors import InputError
from symmotion.splines import BSplineBasis

Step = Literal["nine", "orthogonal"]
NAMES = "uv"


@dataclass(frozen=True, eq=False)
class Direction:
    """One direction of a net: jumps and values at its K interior knots.

    knots: (K,) their parameters; jumps: (K, n) the coefficients a_i of the jump X‴(u⁻) − X‴(u⁺);
    values: (K, n) the B-splines N_i at the knots. ring: whether the first and the last control stay.
    """

    knots: np.ndarray
    jumps: np.ndarray
    values: np.ndarray
    ring: tuple[bool, bool] = (True, True)

    __repr__ = in_a_line

    @staticmethod
    def of(basis: BSplineBasis, name: str = "u") -> "Direction":
        """a_i = −6 (u_{i+4} − u_i) / Π_{s = i…i+4, s ≠ k} (u_k − u_s) for i = k−4 … k (PCG (15)).

        Raises InputError unless the basis is cubic and open with interior knots, all simple.
        """
        if basis.degree != 3 or basis.periodic:
            kind = "periodic" if basis.periodic else f"of degree {basis.degree}"
            raise InputError(f"the basis in {name} is {kind}: fairing takes cubic open ones")
        n, knots, basis = basis.n, basis.knots, basis.relative
        if n < 5:
            raise InputError(f"{n} controls in {name} have no interior knot to fair: at least 5 are needed")
        inner = np.arange(4, n)
        twice = (knots[inner] == knots[inner - 1]) | (knots[inner] == knots[inner + 1])
        if twice.any():
            raise InputError(
                f"interior knot {instant(float(knots[inner[twice][0]]))} in {name} is repeated or lies on the end of "
                "the domain: fairing takes simple ones"
            )
        jumps = np.zeros((len(inner), n))
        for row, k in enumerate(inner):
            for i in range(k - 4, k + 1):
                others = np.delete(knots[i : i + 5], k - i)
                jumps[row, i] = -6 * (knots[i + 4] - knots[i]) / np.prod(knots[k] - others)
        # At a simple knot only three functions differ from zero: rounding must not add a fourth.
        values = np.where(np.abs(np.subtract.outer(inner - 2, np.arange(n))) <= 1, basis(knots[inner]), 0.0)
        return Direction(knots[inner], jumps, values)

    @staticmethod
    def single() -> "Direction":
        """The other direction of a curve: one control, nothing to jump."""
        return Direction(np.zeros(1), np.zeros((1, 1)), np.ones((1, 1)))

    @property
    def count(self) -> int:
        """K, the number of interior knots."""
        return len(self.knots)

    @property
    def trivial(self) -> bool:
        return self.jumps.shape[1] == 1

    def moved(self, step: Step) -> np.ndarray:
        """(K, n) the jump coefficients of the controls that a step moves: the inner three, or all inside the ring."""
        if self.trivial:
            return self.jumps
        if step == "nine":
            return np.where(self.values != 0, self.jumps, 0.0)
        inside = np.ones(self.jumps.shape[1])
        inside[[0, -1]] = np.logical_not(self.ring)
        return self.jumps * inside


@dataclass(frozen=True, eq=False)
class Jumps:
    """The jumps of a net (n, m, C) at its knots (K, L): Δ_uuu = a X Nᵀ and Δ_vvv = N X bᵀ.

    A curve is a net of m = 1 with Δ_uuu only.

    >>> net = sm.motions.smooth_net(7)
    >>> jumps = sm.fairing.Jumps.of((net.u, net.v))
    >>> jumps.fairness(net.real).shape
    (3, 3)
    """

    u: Direction
    v: Direction

    __repr__ = in_a_line

    @staticmethod
    def of(bases: Sequence[BSplineBasis]) -> "Jumps":
        """The jumps over one basis (a curve) or two; InputError names the direction that cannot be faired."""
        directions = [Direction.of(b, name) for b, name in zip(bases, NAMES, strict=False)]
        return Jumps(directions[0], directions[1] if len(directions) > 1 else Direction.single())

    def with_ring(self, ring: Mapping[str, bool]) -> "Jumps":
        """The same jumps with what stays of the outermost controls by side, "u0", "u1", "v0", "v1"."""
        u = replace(self.u, ring=(ring["u0"], ring["u1"]))
        return Jumps(u, self.v if self.v.trivial else replace(self.v, ring=(ring["v0"], ring["v1"])))

    @property
    def shape(self) -> tuple[int, int]:
        """Knots in u and in v."""
        return self.u.count, self.v.count

    @property
    def kinds(self) -> int:
        """Jumps per knot: two, for a curve one."""
        return 1 if self.v.trivial else 2

    def at(self, net: np.ndarray) -> np.ndarray:
        """(K, L, kinds, C) the jumps of a net (n, m, C)."""
        u, v = self.u, self.v
        found = [np.einsum("ki,ijc,lj->klc", u.jumps, net, v.values, optimize=True)]
        if self.kinds == 2:
            found.append(np.einsum("ki,ijc,lj->klc", u.values, net, v.jumps, optimize=True))
        return np.stack(found, axis=2)

    def fairness(self, net: np.ndarray) -> np.ndarray:
        """(K, L) the local measure L = |Δ_uuu|² + |Δ_vvv|² (PCG (16)); its sum is G (PCG (17))."""
        return np.sum(self.at(net) ** 2, axis=(2, 3))

    def spread(self, multipliers: np.ndarray, step: Step | None = None) -> np.ndarray:
        """(n, m, C) Σ over the knots of (ā_i N_j λ + N_i b̄_j μ), minus the move of steps with these multipliers.

        multipliers: (K, L, kinds, C); step: whose moved coefficients ā, b̄ are; None for all.
        """
        u, v = self.u, self.v
        a, b = (d.jumps if step is None else d.moved(step) for d in (u, v))
        moves = np.einsum("ki,klc,lj->ijc", a, multipliers[:, :, 0], v.values, optimize=True)
        if self.kinds == 2:
            moves += np.einsum("ki,klc,lj->ijc", u.values, multipliers[:, :, 1], b, optimize=True)
        return moves


@dataclass(frozen=True, eq=False)
class StepTables:
    """What a local step at one knot does to the jumps at the others.

    The step at (k, l) moves d_ij by −(ā_i N_j λ + N_i b̄_j μ) with M (λ, μ)ᵀ = (Δ_uuu, Δ_vvv)ᵀ, the least
    move that makes both jumps zero: PCG (18), (19).

    reach: how many knots away, (3, 3) for nine moved controls, (4, 4) for all 21; solve: (K, L,
    kinds, kinds) M⁻¹.

    >>> net = sm.motions.smooth_net(9)
    >>> sm.fairing.StepTables(sm.fairing.Jumps.of((net.u, net.v)), "nine").solve[2, 2].round(4)
    array([[ 0.0308, -0.0064],
           [-0.0064,  0.0308]])
    """

    jumps: Jumps
    step: Step

    __repr__ = in_a_line

    @property
    def reach(self) -> tuple[int, int]:
        """How many knots away jumps change, in u and in v; in v none where the net is a curve."""
        far = 3 if self.step == "nine" else 4
        return far, 0 if self.jumps.v.trivial else far

    @cached_property
    def solve(self) -> np.ndarray:
        """(K, L, kinds, kinds) M⁻¹, from the jumps at a knot to the multipliers of its step."""
        u, v = self.jumps.u, self.jumps.v
        a, b = u.moved(self.step), v.moved(self.step)
        matrix = np.empty((*self.jumps.shape, self.jumps.kinds, self.jumps.kinds))
        matrix[..., 0, 0] = np.outer(np.sum(a * a, axis=1), np.sum(v.values**2, axis=1))
        if self.jumps.kinds == 2:
            matrix[..., 1, 1] = np.outer(np.sum(u.values**2, axis=1), np.sum(b * b, axis=1))
            mixed = np.outer(np.sum(a * u.values, axis=1), np.sum(b * v.values, axis=1))
            matrix[..., 0, 1] = matrix[..., 1, 0] = mixed
        return np.linalg.inv(matrix)

    @cached_property
    def change(self) -> np.ndarray:
        """(K, L, (2r + 1)(2s + 1) kinds, kinds) change of the jumps around a knot per (Δ_uuu, Δ_vvv) there.

        Zero for knots beyond the border. With nine moved controls 45 knots change at most.
        """
        u, v = self.jumps.u, self.jumps.v
        r, s = self.reach
        a, b = u.moved(self.step), v.moved(self.step)
        uu = [_near(x, y, r) for x, y in ((u.jumps, a), (u.jumps, u.values), (u.values, a), (u.values, u.values))]
        vv = [_near(x, y, s) for x, y in ((v.values, v.values), (v.values, b), (v.jumps, v.values), (v.jumps, b))]
        kinds, solve = self.jumps.kinds, -self.solve
        change = np.empty((*self.jumps.shape, 2 * r + 1, 2 * s + 1, kinds, kinds))
        for i in range(kinds):
            # In the products of a step's moves with the jumps of kind i, one factor of each direction.
            effects = [uu[2 * i + q][:, None, :, None] * vv[2 * i + q][:, None] for q in range(kinds)]
            for j in range(kinds):
                change[..., i, j] = sum(e * solve[:, :, None, None, q, j] for q, e in enumerate(effects))
        return change.reshape(*self.jumps.shape, -1, kinds)


def _near(rows: np.ndarray, moved: np.ndarray, reach: int) -> np.ndarray:
    """(K, 2 reach + 1) the products of moved[k] with rows[k − reach … k + reach], zero beyond the border."""
    products = np.pad(rows @ moved.T, ((reach, reach), (0, 0)))
    return np.stack([np.diagonal(products, -o) for o in range(2 * reach + 1)], axis=1)
