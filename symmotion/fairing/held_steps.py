"""Local steps that respect conditions: the least move in any metric that keeps keyframes and borders as they are."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy import sparse

from symmotion.fairing.borders import Edge
from symmotion.fairing.independence import equations
from symmotion.fairing.jumps import StepTables
from symmotion.fairing.keyframes import Held
from symmotion.fairing.metrics import Metric

# Singular values, relative to the largest, that are as good as zero.
FLAT = 1e-10
# The part of a free step's room that conditions must leave of a jump for it to be made zero: moves are then at most ten
# times as large.
ROOM = 1e-2


@dataclass(frozen=True, eq=False)
class LocalStep:
    """The step at one knot, linear in the jumps there.

    solve: (kinds C, kinds C) from the jumps to their multipliers; move: (a, b, C, kinds C) from the multipliers to the
    controls from `place` on; rows, prices: the conditions read (E,) and (E, kinds C) their multipliers; clears:
    whether both jumps are zero afterwards.
    """

    solve: np.ndarray
    move: np.ndarray
    place: tuple[slice, slice]
    rows: np.ndarray
    prices: np.ndarray
    clears: bool


@dataclass(frozen=True, eq=False)
class HeldSteps:
    """The steps that conditions C δ = 0 or a metric of its own at every control change.

    Least δᵀWδ with both jumps zero and C δ = 0: with H = W⁻¹ − W⁻¹Cᵀ(C W⁻¹ Cᵀ)⁺C W⁻¹ and J the jumps of the controls
    that move, (J H Jᵀ) λ = Δ and δ = −H Jᵀ λ. Where the conditions leave too little room for both jumps to vanish,
    what there is room for does.

    conditions: (E, n m C) sparse, row by row of the net; shape: (n, m, C).
    """

    tables: StepTables
    shape: tuple[int, int, int]
    conditions: sparse.csr_array
    metric: Metric
    made: dict[tuple[int, int], LocalStep] = field(default_factory=dict, repr=False)

    @staticmethod
    def of(
        tables: StepTables,
        shape: tuple[int, int, int],
        keyframes: Sequence[Held],
        edges: Sequence[tuple[str, Edge]],
        metric: Metric,
    ) -> "HeldSteps | None":
        """The steps that keyframes, borders and the metric change; None where there are none."""
        rows = [equations(k) for k in keyframes if len(k.target)] + [_border(shape, side, edge) for side, edge in edges]
        if not rows and metric.uniform:
            return None
        empty = sparse.csr_array((0, int(np.prod(shape))))
        conditions = sparse.csr_array(sparse.vstack(rows)) if rows else empty
        return HeldSteps(tables, shape, conditions, metric)

    @cached_property
    def touched(self) -> np.ndarray:
        """(K, L) whether the step at a knot is one of these."""
        if not self.metric.uniform:
            return np.ones(self.tables.jumps.shape, dtype=bool)
        n, m, c = self.shape
        read = np.zeros(n * m)
        read[np.unique(self.conditions.indices // c)] = 1.0
        read = read.reshape(n, m)
        u, v = self.tables.jumps.u, self.tables.jumps.v
        a, b = (np.abs(d.moved(self.tables.step)) > 0 for d in (u, v))
        near = (a * 1.0) @ read @ (v.values != 0).T
        if self.tables.jumps.kinds == 2:
            near = near + (u.values != 0) @ read @ (b * 1.0).T
        return near > 0

    @cached_property
    def _columns(self) -> sparse.csc_array:
        return sparse.csc_array(self.conditions)

    @cached_property
    def _blocks(self) -> np.ndarray:
        return np.linalg.inv(self.metric.blocks(self.shape))

    def at(self, k: int, l: int) -> LocalStep:  # noqa: E741 - PCG's letters
        """The step at a knot, made where it is first asked for."""
        if (k, l) not in self.made:
            self.made[k, l] = self._new(k, l)
        return self.made[k, l]

    def _new(self, k: int, l: int) -> LocalStep:  # noqa: E741
        _, m, c = self.shape
        u, v, kinds, step = self.tables.jumps.u, self.tables.jumps.v, self.tables.jumps.kinds, self.tables.step
        place = slice(k, k + 5), slice(0, 1) if v.trivial else slice(l, l + 5)
        a, w = u.moved(step)[k, place[0]], v.values[l, place[1]]
        rows = [np.outer(a, w)]
        if kinds == 2:
            rows.append(np.outer(u.values[k, place[0]], v.moved(step)[l, place[1]]))
        window = rows[0].shape
        moved = np.flatnonzero(np.any(rows, axis=0).ravel())
        i, j = (x[moved] for x in np.indices(window).reshape(2, -1))
        controls = (place[0].start + i) * m + place[1].start + j
        jac = np.kron(np.stack([r.ravel()[moved] for r in rows]), np.eye(c))
        back = np.zeros((len(moved), c, len(moved), c))
        back[np.arange(len(moved)), :, np.arange(len(moved))] = self._blocks.reshape(-1, c, c)[controls]
        back = back.reshape(len(moved) * c, -1)
        columns = (controls[:, None] * c + np.arange(c)).ravel()
        read = self._columns[:, columns]
        which = np.unique(read.indices)
        held = read.tocsr()[which].toarray()
        size = np.linalg.norm(held, axis=1)
        scaled = held / size[:, None]
        # Rows of length 1: a condition that hardly reads a control counts like the others.
        inverse = (
            np.linalg.pinv(scaled @ back @ scaled.T, rcond=FLAT, hermitian=True) if len(which) else np.zeros((0, 0))
        )
        lowered = back @ jac.T
        prices = -inverse @ (scaled @ lowered)
        reach = lowered + back @ (scaled.T @ prices)
        small = jac @ reach
        values = np.linalg.eigvalsh((small + small.T) / 2)
        whole = np.trace(jac @ lowered) / len(jac)
        kept = int((values > ROOM * whole).sum())
        rcond = ROOM * whole / max(values[-1], ROOM * whole)
        solve = np.linalg.pinv((small + small.T) / 2, rcond=rcond, hermitian=True)
        move = np.zeros((window[0] * window[1], c, len(jac)))
        move[moved] = -reach.reshape(len(moved), c, -1)
        shaped = move.reshape(*window, c, len(jac))
        return LocalStep(solve, shaped, place, which, prices / size[:, None], kept == len(jac))

    def kept(self, controls: np.ndarray) -> np.ndarray:
        """(E, P C) independent rows of what a move of some controls, counted row by row, has to keep."""
        c = self.shape[2]
        read = self._columns[:, (controls[:, None] * c + np.arange(c)).ravel()]
        held = read.tocsr()[np.unique(read.indices)].toarray()
        if not len(held):
            return held
        _, s, vt = np.linalg.svd(held / np.linalg.norm(held, axis=1, keepdims=True))
        return vt[: int((s > FLAT * s[0]).sum())]

    @cached_property
    def _padded(self) -> tuple[np.ndarray, ...]:
        """The jumps and values of u, then of v, with rows of zeros beyond the border."""
        reach, jumps = self.tables.reach, self.tables.jumps
        return tuple(
            np.pad(x, ((r, r), (0, 0)))
            for d, r in zip((jumps.u, jumps.v), reach, strict=True)
            for x in (d.jumps, d.values)
        )

    def effect(self, k: int, l: int, local: LocalStep, move: np.ndarray) -> np.ndarray:  # noqa: E741
        """(2r + 1, 2s + 1, kinds, C) the change of the jumps around a knot by a move (a, b, C)."""
        r, s = self.tables.reach
        ju, nu, jv, nv = self._padded
        rows, columns = slice(k, k + 2 * r + 1), slice(l, l + 2 * s + 1)
        i, j = local.place
        found = [np.einsum("ka,abc,lb->klc", ju[rows, i], move, nv[columns, j], optimize=True)]
        if self.tables.jumps.kinds == 2:
            found.append(np.einsum("ka,abc,lb->klc", nu[rows, i], move, jv[columns, j], optimize=True))
        return np.stack(found, axis=2)

    def split(self, multipliers: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Multipliers (K, L, kinds, C) without those of these steps; the move (n, m, C) of these; their prices (E,)."""
        plain, move = multipliers.copy(), np.zeros(self.shape)
        prices = np.zeros(self.conditions.shape[0])
        for k, l in np.argwhere(self.touched & multipliers.any(axis=(2, 3))):  # noqa: E741
            local, given = self.at(int(k), int(l)), multipliers[k, l].ravel()
            move[local.place] += local.move @ given
            prices[local.rows] += local.prices @ given
            plain[k, l] = 0.0
        return plain, move, prices


def _border(shape: tuple[int, int, int], side: str, edge: Edge) -> sparse.csr_array:
    """(E, n m C) the rows of a border, of every control along it and every channel."""
    n, m, c = shape
    factors = (edge.rows, sparse.eye_array(m)) if side[0] == "u" else (sparse.eye_array(n), edge.rows)
    return sparse.csr_array(sparse.kron(sparse.kron(*map(sparse.csr_array, factors)), sparse.eye_array(c)))
