"""The terms and constraints of fairing programs: each a small kernel, applied at all knots, controls or keyframes."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, TypeAlias

import casadi as ca
import numpy as np
from scipy import sparse

from symmotion.fairing.borders import Freedom
from symmotion.fairing.jumps import Jumps
from symmotion.fairing.keyframes import Held
from symmotion.fairing.metrics import Metric
from symmotion.jets.space import UNKNOWN
from symmotion.kernels import Kernel
from symmotion.program import WHOLE, Block, Constraint

KEYFRAMES = "keyframes"


class KeyframePlace(NamedTuple):
    """Where the multipliers of a keyframe are: in a row of a constraint; covector: (e, d) its equations on D."""

    name: str
    row: int
    covector: np.ndarray


KeyframePlaces: TypeAlias = tuple[KeyframePlace | None, ...]


def fairness_block(jumps: Jumps, channels: int) -> Block:
    """ΣL: row by row the jumps of one knot, then those of the next."""
    u, v, kinds = jumps.u, jumps.v, jumps.kinds
    parts_of = [sparse.kron(u.jumps, v.values), sparse.kron(u.values, v.jumps)][:kinds]
    order = np.arange(kinds * parts_of[0].shape[0]).reshape(kinds, -1).T.ravel()
    operator = sparse.csr_array(sparse.vstack(parts_of, format="csr")[order])
    operator.eliminate_zeros()
    z, other = ca.SX.sym("z", kinds * channels), ca.SX.sym("none", 0)
    count = operator.shape[0] // kinds
    kernel = Kernel(z, other, z, channels, squares=True)
    return Block("fairness", kernel, UNKNOWN, slice(0, channels), operator, 1, np.ones(count), np.zeros((count, 0)))


def closeness_block(net: np.ndarray, free: np.ndarray, weight: float, metric: Metric) -> Block:
    """w Σ (d − d⁰)ᵀ W (d − d⁰) over the controls `free`, counted row by row."""
    n, m, channels = net.shape
    start = net.reshape(-1, channels)[free]
    scale = np.full(len(free), weight)
    if metric.scale is not None:
        scale = scale * metric.scale.ravel()[free]
    kernel, table = _distance(metric, net.shape, free, channels)
    squares = Kernel(kernel.z, kernel.data, kernel.out, channels, squares=True)
    rows = sparse.csr_array(sparse.eye_array(n * m, format="csr")[free])
    return Block("closeness", squares, UNKNOWN, slice(0, channels), rows, 1, scale, np.column_stack([start, table]))


def change_block(net: np.ndarray, controls: np.ndarray, metric: Metric) -> Block:
    """½ Σ (d − d⁰)ᵀ W (d − d⁰) of a local step, whose unknowns are the controls that move."""
    whole = closeness_block(net, controls, 0.5, metric)
    return replace(whole, name="change", operator=sparse.csr_array(sparse.eye_array(len(controls))))


def kept_constraint(rows: np.ndarray) -> Constraint:
    """Rows (E, P C) of a local step's unknowns that stay as they are."""
    z, now = ca.SX.sym("z"), ca.SX.sym("now")
    operator = sparse.csr_array(rows)
    block = Block(
        "conditions",
        Kernel(z, now, z - now, 1),
        WHOLE,
        slice(0, 1),
        operator,
        1,
        np.ones(len(rows)),
        np.zeros((len(rows), 1)),
    )
    return Constraint.equality(block)


def bounds_constraint(net: np.ndarray, free: np.ndarray, limit: np.ndarray, metric: Metric) -> Constraint:
    """|d − d⁰|²/δ² ≤ 1 at the controls `free`, δ (free,), lengths in the metric."""
    n, m, channels = net.shape
    if metric.scale is not None:
        limit = limit / np.sqrt(metric.scale.ravel()[free])
    kernel, table = _distance(metric, net.shape, free, channels)
    data = ca.vertcat(kernel.data, ca.SX.sym("limit"))
    square = Kernel(kernel.z, data, ca.sumsqr(kernel.out / data[-1]), channels)
    rows = sparse.csr_array(sparse.eye_array(n * m, format="csr")[free])
    table = np.column_stack([net.reshape(-1, channels)[free], table, limit])
    block = Block("bounds", square, UNKNOWN, slice(0, channels), rows, 1, np.ones(len(free)), table)
    return Constraint(block, np.full((len(free), 1), -np.inf), np.ones((len(free), 1)))


def _distance(
    metric: Metric, shape: tuple[int, int, int], free: np.ndarray, channels: int
) -> tuple[Kernel, np.ndarray]:
    """Fᵀ(z − d⁰) with the metric's form FFᵀ, but for its scale; the numbers of F at the controls `free`."""
    z, other = ca.SX.sym("z", channels), ca.SX.sym("other", channels)
    if metric.form is None and metric.forms is None:
        return Kernel(z, other, z - other, channels), np.zeros((len(free), 0))
    forms = Metric(None, metric.form, metric.forms).blocks(shape).reshape(-1, channels, channels)[free]
    factors = np.linalg.cholesky(forms).reshape(len(free), -1)
    f = ca.SX.sym("factor", channels * channels)
    # Row by row F is, as CasADi reads it column by column, Fᵀ.
    moved = ca.mtimes(ca.reshape(f, channels, channels), z - other)
    return Kernel(z, ca.vertcat(other, f), moved, channels), factors


def fixed_constraint(start: np.ndarray, fixed: np.ndarray) -> Constraint:
    """d = start at the controls `fixed`, counted row by row of (n m, C)."""
    channels = start.shape[1]
    return _at("fixed", sparse.eye_array(len(start), format="csr")[fixed], start[fixed], channels)


def border_constraints(freedom: Freedom, start: np.ndarray) -> list[Constraint]:
    """The borders that are held or continued, as far as controls that move are in them."""
    found = []
    (n, _), (m, _) = freedom.u.shape, freedom.v.shape
    moving = sparse.diags_array(freedom.free.ravel() * 1.0)
    for side, edge in freedom.edges.items():
        factors = (edge.rows, sparse.eye_array(m)) if side[0] == "u" else (sparse.eye_array(n), edge.rows)
        rows = sparse.csr_array(sparse.kron(*map(sparse.csr_array, factors)))
        # Two borders say the same of the controls at their corner: the first one does.
        rows = rows[np.abs(rows @ moving).sum(axis=1) > 0]
        if rows.shape[0]:
            found.append(_at(f"border {side}", rows, rows @ start, start.shape[1]))
    return found


def _at(name: str, rows: sparse.csr_array, target: np.ndarray, channels: int) -> Constraint:
    z, other = ca.SX.sym("z", channels), ca.SX.sym("other", channels)
    kernel = Kernel(z, other, z - other, channels)
    rows = sparse.csr_array(rows)
    return Constraint.equality(
        Block(name, kernel, UNKNOWN, slice(0, channels), rows, 1, np.ones(rows.shape[0]), target)
    )


def keyframe_constraints(
    keyframes: Sequence[Held], active: Sequence[int], shift: np.ndarray
) -> tuple[list[Constraint], KeyframePlaces]:
    """The keyframes' equations Σ form (combos x) = target, a block of all that read and ask as much as each other.

    shift: (C,) what was subtracted from each control.
    """
    channels = len(shift)
    groups: dict[tuple[int, int], list[int]] = {}
    for i in active:
        groups.setdefault(keyframes[i].form.shape[:2], []).append(i)
    places: list[KeyframePlace | None] = [None] * len(keyframes)
    found = []
    for (e, k), members in groups.items():
        name = KEYFRAMES if len(groups) == 1 else f"{KEYFRAMES}, {e} equations of {k}"
        z, data = ca.SX.sym("z", k * channels), ca.SX.sym("data", e * k * channels + e)
        # Row by row (e, k C) is column by column its transpose.
        form = ca.reshape(data[: e * k * channels], k * channels, e)
        kernel = Kernel(z, data, ca.mtimes(form.T, z) - data[e * k * channels :], channels)
        rows = sparse.csr_array(sparse.vstack([keyframes[i].combos for i in members]))
        table = np.stack([np.concatenate([keyframes[i].form.ravel(), _from(keyframes[i], shift)]) for i in members])
        block = Block(name, kernel, UNKNOWN, slice(0, channels), rows, 1, np.ones(len(members)), table)
        found.append(Constraint.equality(block))
        for row, i in enumerate(members):
            places[i] = KeyframePlace(name, row, keyframes[i].covector)
    return found, tuple(places)


def _from(keyframe: Held, shift: np.ndarray) -> np.ndarray:
    """(e,) the target of a keyframe's equations for controls from which a shift (C,) was subtracted."""
    return keyframe.target - np.einsum("ekc,k,c->e", keyframe.form, keyframe.combos.sum(axis=1), shift)


def on_displacements(covectors: Sequence[np.ndarray | None], multipliers: Sequence[np.ndarray | None]) -> np.ndarray:
    """(M, d) the multipliers of keyframes' equations as forms on D(u, v); zero of those that add nothing."""
    d = next((c.shape[1] for c in covectors if c is not None), 0)
    found = np.zeros((len(covectors), d))
    for i, (covector, values) in enumerate(zip(covectors, multipliers, strict=True)):
        if covector is not None and values is not None:
            found[i] = values @ covector
    return found
