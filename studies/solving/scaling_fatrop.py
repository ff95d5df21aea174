"""The problem as optimal control, for CasADi's fatrop: see `scaling_alternatives`."""

from dataclasses import dataclass
from time import perf_counter

import casadi as ca
import numpy as np
from scipy import sparse

import symmotion as sm
from studies.solving.scaling_alternatives import ENTRIES, NODES, Answer, Tables, rigidity, told
from symmotion.solvers import Seconds


@dataclass(frozen=True)
class Fatrop:
    """CasADi's fatrop on the problem put as optimal control, which its structure exploitation demands.

    Stage k is a span: its state the first three of the span's four control matrices, its input the fourth, and
    the next state the last three. The keyframes are stage conditions. One knot per segment, so two stages each.
    """

    tolerance: float = 1e-8

    @property
    def name(self) -> str:
        return "fatrop"

    def attempt(self, program: sm.program.Program) -> Answer:
        tables, began = Tables.of(program), perf_counter()
        n, count = tables.start.shape[1], tables.targets.shape[1]
        spans, state = n - 3, 3 * ENTRIES
        if spans != 2 * (count - 1):
            raise sm.InputError("as optimal control the problem is written for one knot per segment: refine=1")
        x = ca.MX.sym("x", spans * (state + ENTRIES) + state)
        stages = ca.reshape(x[: spans * (state + ENTRIES)], state + ENTRIES, spans)
        last = x[spans * (state + ENTRIES) :]
        cost = _stage_cost().map(spans)(stages, *_local(tables, spans))
        following = ca.horzcat(stages[:state, 1:], last)
        gaps = following - stages[ENTRIES:, :]
        # At a knot three B-splines are not zero: those of the state there.
        at = _values_at(tables.keys, 2 * np.arange(count))
        states = ca.horzcat(stages[:state, ::2], last)
        reached = sum((_scaled(states, at, j) for j in range(3)), -ca.DM(tables.targets))
        ordered = ca.vec(ca.vertcat(gaps[:, ::2], reached[:, :-1], gaps[:, 1::2]))
        conditions = ca.vertcat(ordered, reached[:, -1])
        start = np.concatenate(
            [tables.start[:, k : k + 4].T.ravel() for k in range(spans)] + [tables.start.T[-3:].ravel()]
        )
        built = perf_counter()
        options = {
            "structure_detection": "auto",
            "equality": [True] * conditions.numel(),
            "print_time": False,
            "fatrop": {"print_level": 0, "tol": 1e-4 * self.tolerance},
        }
        solver = ca.nlpsol("solver", "fatrop", {"x": x, "f": ca.sum2(cost), "g": conditions}, options)
        compiled = perf_counter()
        result = solver(x0=start, lbg=0, ubg=0)
        seconds = Seconds(built - began, compiled - built, perf_counter() - compiled)
        found = np.asarray(result["x"]).ravel()
        whole = found[: spans * (state + ENTRIES)].reshape(spans, -1)
        controls = np.concatenate([whole[:, :ENTRIES].ravel(), found[-state:]])
        lam = np.asarray(result["lam_g"]).ravel()
        inner = lam[:-ENTRIES].reshape(count - 1, -1)[:, state : state + ENTRIES]
        multipliers = np.concatenate([inner.ravel(), lam[-ENTRIES:]])
        return Answer(controls, multipliers, seconds, *told(solver), len(found))


def _stage_cost() -> ca.Function:
    """The rigidity over one span, of its four control matrices and the basis values there."""
    P = ca.SX.sym("P", ENTRIES, 4)
    values, rates = ca.SX.sym("values", 4, NODES), ca.SX.sym("rates", 4, NODES)
    weights = ca.SX.sym("weights", 1, NODES)
    cost = rigidity(P @ values, P @ rates, weights)
    return ca.Function("cost", [ca.vec(P), ca.vec(values), ca.vec(rates), weights.T], [cost])


def _local(tables: Tables, spans: int) -> tuple[ca.DM, ca.DM, ca.DM]:
    """Values, rates (4 · NODES, spans) and weights (NODES, spans) of the four B-splines of each span."""
    column = np.repeat(np.arange(spans), NODES)
    rows = column[:, None] + np.arange(4)
    nodes = np.arange(spans * NODES)[:, None]
    values, rates = (np.asarray(m.tocsr()[rows, nodes].todense()) for m in (tables.basis, tables.rates))
    weights = tables.weights.reshape(spans, NODES)
    return ca.DM(values.reshape(spans, -1).T), ca.DM(rates.reshape(spans, -1).T), ca.DM(weights.T)


def _values_at(keys: sparse.csc_array, first: np.ndarray) -> np.ndarray:
    """(3, M) what the three control matrices from `first` on contribute at each keyframe."""
    rows = first + np.arange(3)[:, None]
    return np.asarray(keys.tocsr()[rows, np.arange(len(first))].todense())


def _scaled(states: ca.MX, at: np.ndarray, j: int) -> ca.MX:
    """(9, M) matrix j of each state times its basis value."""
    return states[j * ENTRIES : (j + 1) * ENTRIES, :] * ca.DM(np.tile(at[j], (ENTRIES, 1)))
