"""Programs: a start value, named terms and named constraints, all of them kernels applied many times."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Protocol

import casadi as ca
import numpy as np
from scipy import sparse

from symmotion.errors import InputError
from symmotion.program.block import Block
from symmotion.program.state import made_of


@dataclass(frozen=True, eq=False)
class Constraint:
    """lower ≤ kernel ≤ upper at every node of a block; an equality where both are the same.

    lower, upper: (E, C), one row per node.
    """

    block: Block
    lower: np.ndarray
    upper: np.ndarray

    @staticmethod
    def equality(block: Block) -> "Constraint":
        """kernel = 0 at every node."""
        zero = np.zeros((block.count, block.kernel.out.numel()))
        return Constraint(block, zero, zero)

    @property
    def name(self) -> str:
        return self.block.name

    @property
    def size(self) -> int:
        return self.lower.size

    @property
    def is_equality(self) -> bool:
        return bool((self.lower == self.upper).all())


class Structure(dict[Any, Any]):
    """What is derived from a program's structure, by name. A pickle holds it empty, and once for all that share it."""

    def __reduce__(self):
        return Structure, ()


class Design(Protocol):
    """The question behind a program: how its unknowns read as a motion, and back.

    A design may also know `with_keyframes(program, keyframes)` and `stages(by)`.
    """

    def motion(self, unknowns: Mapping[str, np.ndarray]) -> Any: ...

    def unknowns(self, motion: Any) -> Mapping[str, np.ndarray]: ...

    def multipliers(self, multipliers: Mapping[str, np.ndarray]) -> Mapping[str, Any]: ...


@dataclass(frozen=True, eq=False)
class Program:
    """Minimise Σ terms over the unknowns, subject to constraints that keep their multipliers.

    start: by name, the unknowns' start values, each (n, channels); their shapes define the
        unknowns x, one vector of all of them in this order, row by row.
    terms: blocks whose sum is the objective; constraints: each with a multiplier per component.
    design: a `Design` of some kind; turns x back into a motion. build_seconds: what making the program took.

    The Lagrangian is L = Σ terms + λᵀg, so that the optimum changes by −λ with the data that
    g subtracts.
    """

    start: Mapping[str, np.ndarray]
    terms: tuple[Block, ...]
    constraints: tuple[Constraint, ...]
    design: Any
    build_seconds: float | None = None
    # Derived structure (patterns, null-space bases), shared by programs that differ in data only.
    structure: dict[Any, Any] = field(default_factory=Structure, repr=False)

    __getstate__ = made_of

    @cached_property
    def offsets(self) -> dict[str, int]:
        """Where each unknown begins in x."""
        sizes = [v.size for v in self.start.values()]
        return dict(zip(self.start, np.concatenate([[0], np.cumsum(sizes)]).tolist(), strict=False))

    @property
    def unknowns(self) -> int:
        return sum(v.size for v in self.start.values())

    @property
    def conditions(self) -> int:
        """Scalar constraints, and so multipliers."""
        return sum(c.size for c in self.constraints)

    @property
    def x0(self) -> np.ndarray:
        """(unknowns,) the start value."""
        return self.pack(self.start)

    def pack(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Named arrays as one vector x."""
        return np.concatenate([np.asarray(values[name], dtype=float).ravel() for name in self.start])

    def unpack(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """The vector x as named arrays (views)."""
        return {
            name: x[self.offsets[name] : self.offsets[name] + value.size].reshape(value.shape)
            for name, value in self.start.items()
        }

    def split(self, multipliers: np.ndarray) -> dict[str, np.ndarray]:
        """The multiplier vector λ (conditions,) by constraint, each (E, C)."""
        parts, k = {}, 0
        for c in self.constraints:
            parts[c.name] = multipliers[k : k + c.size].reshape(c.lower.shape)
            k += c.size
        return parts

    @cached_property
    def lower(self) -> np.ndarray:
        return np.concatenate([c.lower.ravel() for c in self.constraints]) if self.constraints else np.empty(0)

    @cached_property
    def upper(self) -> np.ndarray:
        return np.concatenate([c.upper.ravel() for c in self.constraints]) if self.constraints else np.empty(0)

    @property
    def equalities_only(self) -> bool:
        return all(c.is_equality for c in self.constraints)

    @property
    def linear(self) -> bool:
        """Whether all constraints are linear."""
        return all(c.block.kernel.linear for c in self.constraints)

    def constraint(self, name: str) -> Constraint:
        """The constraint of this name; InputError says which exist."""
        for c in self.constraints:
            if c.name == name:
                return c
        raise InputError(f"no constraint {name!r}; there are {', '.join(c.name for c in self.constraints) or 'none'}")

    def with_data(self, name: str, data: np.ndarray, **changes: Any) -> "Program":
        """The same program with other data in one constraint; structure and compiled kernels are kept.

        Structure not where the data are factors of the unknowns: the Jacobian is kept there.
        """
        target = self.constraint(name)
        fresh = replace(target, block=target.block.with_data(data))
        if target.block.kernel.bilinear:
            changes = {"structure": Structure(), **changes}
        return replace(self, constraints=tuple(fresh if c is target else c for c in self.constraints), **changes)

    def with_keyframes(self, keyframes: Any) -> "Program":
        """The same program for other keyframes at the same times; structure and compiled kernels are kept."""
        if not hasattr(self.design, "with_keyframes"):
            raise InputError(f"{type(self.design).__name__} has no keyframes to change: make a new program")
        return self.design.with_keyframes(self, keyframes)

    def stages(self, by: str) -> list["Program"]:
        """Smaller programs that lead to this one, coarsest first, by "degree" or "knots"."""
        if not hasattr(self.design, "stages"):
            raise InputError(f"{type(self.design).__name__} has no stages")
        return list(self.design.stages(by))

    def nlp(self) -> dict[str, Any]:
        """The plain CasADi problem, for whoever brings a solver of their own.

        Keys: x, f, g (MX), x0, lbg, ubg (arrays). `nlpsol(name, plugin, {k: nlp[k] for k in "xfg"})`.
        """
        x = ca.MX.sym("x", self.unknowns)
        f = sum((self._symbolic(b, x, None) for b in self.terms), ca.MX(0))
        g = [self._symbolic(c.block, x, c) for c in self.constraints]
        return {
            "x": x,
            "f": f,
            "g": ca.vertcat(*g) if g else ca.MX(0, 1),
            "x0": self.x0,
            "lbg": self.lower,
            "ubg": self.upper,
        }

    def _symbolic(self, block: Block, x: ca.MX, constraint: Constraint | None) -> ca.MX:
        shape = self.start[block.variable].shape
        begin = self.offsets[block.variable]
        controls = ca.reshape(x[begin : begin + shape[0] * shape[1]], shape[1], shape[0])[block.channels, :]
        z = ca.reshape(controls @ ca.DM(sparse.csc_matrix(block.operator)).T, -1, block.count)
        function = block.kernel.function("value" if constraint is None else "out").map(block.count)
        mu = ca.DM.ones(block.kernel.out.numel() if constraint is None else function.size1_in(2), block.count)
        result = function(z, ca.DM(block.data.T), mu)
        return ca.dot(ca.DM(block.weights), result.T) if constraint is None else ca.vec(result)

    def __str__(self) -> str:
        lines = [f"Program: {self.unknowns} unknowns, {self.conditions} conditions"]
        lines += [f"  unknown     {name}: {v.shape[0]} × {v.shape[1]}" for name, v in self.start.items()]
        lines += [f"  term        {_describe(b)}" for b in self.terms]
        for c in self.constraints:
            kind = "equality" if c.is_equality else "bounds"
            lines.append(f"  constraint  {_describe(c.block)}; {c.size} multipliers, {kind}")
        return "\n".join(lines)


def _describe(block: Block) -> str:
    kernel = block.kernel
    nature = "squares of " if kernel.squares else ""
    order = "linear" if kernel.linear else "quadratic" if kernel.quartic else "nonlinear"
    return (
        f"{block.name}: {block.elements} elements × {block.nodes} nodes, {nature}{kernel.out.numel()} {order} "
        f"expression{'s' * (kernel.out.numel() != 1)} of {kernel.z.numel()} local values"
    )
