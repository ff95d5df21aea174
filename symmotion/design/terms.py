"""Energies as terms of programs: their kernels, and how many nodes their integrals need."""

from collections.abc import Callable, Mapping
from typing import TypeVar

import casadi as ca
import numpy as np

from symmotion import checks
from symmotion.energies import Energy, JetEnergy
from symmotion.errors import InputError
from symmotion.jets.jet import AnyJet, as_expression, of_jets, require_closed, said
from symmotion.jets.linear import JetKernel, LinearSpace
from symmotion.program import QUADRATURE, Block, BlockEvaluator

MOST_NODES = 40

T = TypeVar("T")


def as_objective(objective: Energy | None, default: Energy) -> Energy:
    """The objective, `default` for None; InputError unless it is an energy."""
    if objective is None:
        return default
    if not isinstance(objective, Energy):
        if isinstance(objective, type):
            raise InputError(f"objective {objective.__name__} is a class: {objective.__name__}(…) makes one")
        raise InputError(f"objective {objective!r:.80} is no energy, such as Rigidity()")
    return objective


def parts_of(objective: Energy) -> list[tuple[str, float, Energy]]:
    """The terms of an objective that count: a name of their own, weight and energy each."""
    taken: set[str] = set()
    parts = [(checks.text(e.name, f"name of the {type(e).__name__}"), w, e) for w, e in objective.parts if w]
    return [(distinct(name, taken), w, e) for name, w, e in parts]


def distinct(name: str, taken: set[str]) -> str:
    """The name, numbered where it is taken; added to those taken."""
    fresh, k = name, 2
    while fresh in taken:
        fresh, k = f"{name} ({k})", k + 1
    taken.add(fresh)
    return fresh


def expression_of(energy: Energy, weight: float, jet: AnyJet) -> tuple[ca.SX, bool]:
    """The integrand for a jet, or residuals and True where the term is a sum of squares with a positive weight.

    InputError that names the energy where it cannot be said of such a jet.
    """
    who, kind = f"energy {energy.name}", of_jets([jet])
    residuals = said(who, "", kind, lambda: energy.residuals(jet)) if weight > 0 else None
    if residuals is not None:
        return ca.vec(as_expression(who, residuals)), True
    out = as_expression(who, said(who, "", kind, lambda: energy.integrand(jet)))
    if out.numel() != 1:
        raise InputError(
            f"{who} returns shape {out.shape} as integrand: a scalar is needed; a column of residuals, whose squares "
            "add up, is for residuals(jet) or squares=True"
        )
    return out, False


def closed_expression(energy: Energy, weight: float, jet: AnyJet) -> tuple[ca.SX, bool]:
    """As `expression_of`, of a jet made of symbols: InputError too where it holds what is not the jet's."""
    out, squares = expression_of(energy, weight, jet)
    require_closed(f"the integrand of {energy.name}", out, [jet])
    return out, squares


def density_of(energy: Energy, jet: AnyJet) -> ca.SX:
    """The integrand φ of an energy, or of a sum of energies, for a jet made of symbols."""
    found = [(w, *closed_expression(e, 1.0, jet)) for w, e in energy.parts]
    return sum((w * (ca.sumsqr(out) if squares else out) for w, out, squares in found), ca.SX(0))


def kernel_of(energy: Energy, weight: float, space: LinearSpace) -> JetKernel:
    """The kernel of an energy in a linear space; an energy keeps those that were made of it."""

    def make() -> JetKernel:
        out, squares = closed_expression(energy, weight, space.symbols())
        if space.shift is not None:
            out, _ = expression_of(energy, weight, space.jet())
        return JetKernel.of(space, out, f"the integrand of {energy.name}", squares)

    return kept(energy, (space.kind, weight > 0, space.shift is not None), make)


def kept(energy: Energy, key: object, make: Callable[[], T]) -> T:
    """What was made of an energy under a key before, else what `make` gives. An energy is frozen, and no hash of it.

    Not of what users write: it may look at things that change, and kernels of equal text are one all the same.
    """
    if isinstance(energy, JetEnergy) or not type(energy).__module__.startswith("symmotion."):
        return make()
    store = getattr(energy, "__dict__", {}).setdefault("_made", {})
    if key not in store:
        store[key] = make()
    return store[key]


def nodes_for(energy: Energy, weight: float, space: LinearSpace, controls: np.ndarray) -> int:
    """Gauss nodes per span for an energy: the exact number, or enough at these controls to 1e-10."""
    nodes, kernel = energy.nodes(space.basis.degree), kernel_of(energy, weight, space)
    while not (energy.exact or energy.stated) and nodes < MOST_NODES:
        value, finer = (_value(kernel.integral(energy.name, space, n, 1.0), controls) for n in (nodes, 2 * nodes))
        if not abs(finer - value) > QUADRATURE * abs(finer):  # not a number counts as enough: nothing to refine
            break
        nodes = min(MOST_NODES, nodes + space.basis.degree + 1)
    return nodes


def terms_of(
    objective: Energy, space: LinearSpace, controls: np.ndarray, nodes: Mapping[str, int] | None = None
) -> list[Block]:
    """The terms of an objective over a linear space, their nodes enough at these controls (n, width).

    nodes: by term, where they are known.
    """
    known = nodes or {}
    return [
        kernel_of(e, w, space).integral(name, space, known.get(name) or nodes_for(e, w, space, controls), w)
        for name, w, e in parts_of(objective)
    ]


def _value(block: Block, controls: np.ndarray) -> float:
    return BlockEvaluator(block).value(controls)
