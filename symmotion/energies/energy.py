"""Energies: functionals ∫ φ(jet) dt of a motion, which add and scale."""

from collections.abc import Callable
from dataclasses import dataclass
from numbers import Real
from typing import Any, TypeAlias

import casadi as ca
import numpy as np

from symmotion import checks
from symmotion.brief import in_a_line
from symmotion.errors import InputError
from symmotion.jets import Written
from symmotion.jets.jet import as_expression, said
from symmotion.jets.written import same_text
from symmotion.values import adopt, restore, same, same_fields, settle

# Any: of the kind that an energy is written for, which it says itself.
OwnJet: TypeAlias = Any


class Energy:
    """A functional ∫ φ(jet) dt of a motion. A subclass states `residuals` (φ their sum of squares) or `integrand`.

    The jet is that of whatever motion the energy is asked of: `Jet`, `RigidJet`, `CurveJet`. Arrays in the fields of
    a subclass that is a dataclass are copied, and refuse writes.

    Raises InputError where it states neither, and for weights that are negative or not finite.

    >>> class Drift(sm.energies.Energy):
    ...     def residuals(self, jet):
    ...         return jet.dv
    >>> motion = sm.interpolants.component_cubic(sm.examples.quarter_turn())
    >>> round(sm.measure(motion, Drift()), 6)
    9.0
    """

    def __init_subclass__(cls, **options: object):
        super().__init_subclass__(**options)
        adopt(cls, settle)

    def __post_init__(self):
        settle(self)

    __repr__ = in_a_line

    @property
    def name(self) -> str:
        """The short name under which the term appears in programs and reports."""
        return type(self).__name__

    def residuals(self, jet: OwnJet) -> ca.SX | None:
        """A column (C, 1) whose sum of squares is the integrand, or None where there is none.

        Gauss–Newton convexification and the exact line search follow from it. The jet is of the kind that the
        subclass is written for.
        """
        return None

    def integrand(self, jet: OwnJet) -> ca.SX:
        """(1, 1) φ(jet)."""
        residuals = self.residuals(jet)
        if residuals is None:
            raise InputError(f"energy {self.name} states neither residuals nor an integrand: write one of the two")
        return ca.sumsqr(residuals)

    def nodes(self, degree: int) -> int:
        """Gauss nodes per span for a motion of this degree, in every kind of program those to begin with.

        A program takes more of them until ten digits of its start's value are right, and `program.refined` those of a
        solution; not where `exact` or `stated` says that these are the ones to take.
        """
        return 2 * degree

    @property
    def exact(self) -> bool:
        """Whether `nodes` are enough where the coordinates are splines, the integrand being a polynomial of them."""
        return False

    @property
    def stated(self) -> bool:
        """Whether `nodes` are taken as they are, whatever the error: it is told in the solution."""
        return False

    @property
    def divides_by_volume(self) -> bool:
        """Whether the integrand has no value where det A vanishes, as between keyframes of both orientations."""
        return False

    @property
    def parts(self) -> "tuple[tuple[float, Energy], ...]":
        """The (weight, energy) pairs that this is the sum of."""
        return ((1.0, self),)

    def __add__(self, other: "Energy") -> "EnergySum":
        if not isinstance(other, Energy):
            return NotImplemented
        return EnergySum(self.parts + other.parts)

    def __radd__(self, other: object) -> "Energy":
        # What `sum` begins with.
        return self if other == 0 else NotImplemented

    def __sub__(self, other: "Energy") -> "EnergySum":
        if not isinstance(other, Energy):
            return NotImplemented
        left = list(self.parts)
        for weight, energy in other.parts:
            alike = next((k for k, (_, mine) in enumerate(left) if same(mine, energy)), None)
            if alike is None:
                left.append((-weight, energy))
            else:
                left[alike] = (left[alike][0] - weight, energy)
        return EnergySum(tuple(left))

    def __mul__(self, factor: Real | float) -> "EnergySum":
        if not isinstance(factor, Real):
            return NotImplemented
        if not np.isfinite(float(factor)) or float(factor) < 0:
            name = self.parts[0][1].name
            raise InputError(f"weight {float(factor):g} of {name}: weights must be finite and not negative")
        return EnergySum(tuple((float(factor) * weight, energy) for weight, energy in self.parts))

    __rmul__ = __mul__

    def __truediv__(self, divisor: Real | float) -> "EnergySum":
        if not isinstance(divisor, Real):
            return NotImplemented
        return self * (1.0 / checks.positive(divisor, f"divisor of {self.name}"))

    def __eq__(self, other: object) -> bool:
        return same_fields(self, other)

    __hash__ = None  # pyright: ignore[reportAssignmentType] - arrays inside: nothing hashes an energy

    def __getstate__(self) -> dict[str, object]:
        # Kernels that were made of it are made again where they are asked for.
        return {name: value for name, value in self.__dict__.items() if name != "_made"}

    __setstate__ = restore


@dataclass(frozen=True, eq=False)
class EnergySum(Energy):
    """A weighted sum of energies; its weights are finite and not all zero, negative only in differences `a - b`.

    Raises InputError for weights that are not finite or all zero.

    >>> total = sm.Rigidity() + 0.1 * sm.Rigidity(2)
    >>> [(weight, part.name) for weight, part in total.parts]
    [(1.0, 'R'), (0.1, 'R*')]
    """

    weighted: tuple[tuple[float, Energy], ...]

    def __post_init__(self):
        pairs = self.weighted if isinstance(self.weighted, tuple | list) else (self.weighted,)
        for pair in pairs:
            if not (isinstance(pair, tuple | list) and len(pair) == 2 and isinstance(pair[1], Energy)):
                raise InputError(f"sum of energies: {checks.told(pair)}: pairs of a weight and an energy are needed")
            checks.number(pair[0], f"weight of {pair[1].name}:")
        if not any(weight for weight, _ in self.weighted):
            raise InputError("all weights of the energies are zero")

    @property
    def parts(self) -> tuple[tuple[float, Energy], ...]:
        return self.weighted

    @property
    def name(self) -> str:
        return " + ".join(e.name if w == 1 else f"{w:g} {e.name}" for w, e in self.weighted)

    def __repr__(self) -> str:
        return " + ".join(repr(e) if w == 1 else f"{w:g} * {e!r}" for w, e in self.weighted)

    def integrand(self, jet: OwnJet) -> ca.SX:
        return sum((w * e.integrand(jet) for w, e in self.weighted), ca.SX(0))

    def nodes(self, degree: int) -> int:
        return max(e.nodes(degree) for _, e in self.weighted)


@dataclass(frozen=True, eq=False)
class JetEnergy(Energy):
    """∫ φ(jet) dt for a CasADi expression of the user's own.

    function: from a jet to a scalar φ, or, with `squares`, to a column of residuals whose
        sum of squares is φ (preferred where it exists: the solver then has a Gauss–Newton matrix).
    label: its name in programs and reports.
    gauss_nodes: per span; when left out, as many as the quadrature error asks for.

        JetEnergy(lambda jet: jet.ddv, squares=True, label="acceleration of the origin")

    Raises InputError where the function fails or returns no expression of the jet.

    >>> import casadi as ca
    >>> slow = sm.JetEnergy(lambda jet: jet.dv, squares=True, label="speed")
    >>> motion = sm.interpolants.component_cubic(sm.examples.quarter_turn())
    >>> round(sm.measure(motion, slow), 6)
    9.0
    """

    function: Callable[[OwnJet], ca.SX]
    squares: bool = False
    label: str = "custom"
    gauss_nodes: int | None = None

    def __post_init__(self):
        if not callable(self.function):
            raise InputError(f"function {self.function!r}: a function of a jet is needed")
        if self.gauss_nodes is not None:
            checks.whole(self.gauss_nodes, 1, "gauss_nodes")
        checks.text(self.label, "label")

    def __copy__(self) -> "JetEnergy":
        return self

    def __deepcopy__(self, memo: object) -> "JetEnergy":
        return self

    def __getstate__(self) -> dict[str, object]:
        # A lambda does not pickle, the expression that it makes does.
        return {**super().__getstate__(), "function": self._written()}

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, JetEnergy) or not same_fields(self, other, but="function"):
            return False
        return same(self.function, other.function) or same_text(self._written, other._written)

    __hash__ = None  # pyright: ignore[reportAssignmentType] - as of every energy

    def _written(self) -> Written:
        return said(f"energy {self.name}", "", "jets of every kind", lambda: Written.of(self.function))

    @property
    def name(self) -> str:
        return self.label

    def residuals(self, jet: OwnJet) -> ca.SX | None:
        return ca.vec(self._expression(jet)) if self.squares else None

    def integrand(self, jet: OwnJet) -> ca.SX:
        return super().integrand(jet) if self.squares else self._expression(jet)

    def _expression(self, jet: OwnJet) -> ca.SX:
        return as_expression(f"energy {self.name}", self.function(jet))

    def nodes(self, degree: int) -> int:
        return self.gauss_nodes or 2 * degree

    @property
    def stated(self) -> bool:
        return self.gauss_nodes is not None
