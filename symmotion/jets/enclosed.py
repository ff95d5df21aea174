"""Expressions of jets as functions of time on pieces: polynomials, their quotients and roots, with bounds of errors."""

import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isfinite

import casadi as ca
import numpy as np

from symmotion.splines.pieces import Poly

# Powers that are multiplied out.
MOST_POWER = 24
# Degrees beyond which a polynomial is dearer than samples.
MOST_DEGREE = 160


class NotPolynomialError(Exception):
    """An expression that is no polynomial, quotient or root of one."""


@dataclass(frozen=True, eq=False)
class Form:
    """top / bottom, or with a scale offset + scale √(top / bottom); bottom None for 1."""

    top: Poly
    bottom: Poly | None = None
    scale: float | None = None
    offset: float = 0.0

    @staticmethod
    def constant(value: float) -> "Form":
        return Form(Poly.constant(value))

    @property
    def number(self) -> float | None:
        """Its value where it is a constant."""
        top = self.top
        plain = self.bottom is None and self.scale is None and top.scaled.shape == (1, 1) and not top.error.any()
        return float(top.scaled[0, 0]) if plain else None

    @property
    def degree(self) -> int:
        return max(self.top.degree, self.bottom.degree if self.bottom else 0)

    def _rootless(self) -> "Form":
        if self.scale is not None:
            raise NotPolynomialError
        return self

    def __neg__(self) -> "Form":
        if self.scale is not None:
            return Form(self.top, self.bottom, -self.scale, -self.offset)
        return Form(-self.top, self.bottom)

    def __add__(self, other: "Form") -> "Form":
        for one, two in ((self, other), (other, self)):
            if one.scale is not None and two.number is not None:
                return Form(one.top, one.bottom, one.scale, one.offset + two.number)
        a, b = self._rootless(), other._rootless()
        if a.bottom is b.bottom:
            return Form(a.top + b.top, a.bottom)
        if a.bottom is None or b.bottom is None:
            whole, part = (a, b) if a.bottom is None else (b, a)
            assert part.bottom is not None
            return Form(whole.top * part.bottom + part.top, part.bottom)
        return Form(a.top * b.bottom + b.top * a.bottom, a.bottom * b.bottom)  # pyright: ignore[reportOperatorIssue]

    def __sub__(self, other: "Form") -> "Form":
        return self + (-other)

    def __mul__(self, other: "Form") -> "Form":
        for one, two in ((self, other), (other, self)):
            if one.scale is not None and two.number is not None:
                return Form(one.top, one.bottom, one.scale * two.number, one.offset * two.number)
        if self.scale is not None and self is other and not self.offset:
            return Form(self.top, self.bottom) * Form.constant(self.scale**2)
        a, b = self._rootless(), other._rootless()
        if a.degree + b.degree > MOST_DEGREE:
            raise NotPolynomialError
        bottom = a.bottom if b.bottom is None else b.bottom if a.bottom is None else a.bottom * b.bottom
        return Form(a.top * b.top, bottom)

    def inverse(self) -> "Form":
        if self.number is not None:
            if self.number == 0:
                raise NotPolynomialError
            return Form.constant(1 / self.number)
        a = self._rootless()
        return Form(a.bottom or Poly.constant(1.0), a.top)

    def __truediv__(self, other: "Form") -> "Form":
        return self * other.inverse()

    def root(self) -> "Form":
        a = self._rootless()
        if a.number is not None:
            if a.number < 0:
                raise NotPolynomialError
            return Form.constant(a.number**0.5)
        return Form(a.top, a.bottom, 1.0)

    def power(self, other: "Form") -> "Form":
        exponent = other.number
        if exponent == 0.5:
            return self.root()
        if exponent is None or exponent != int(exponent) or abs(exponent) > MOST_POWER:
            raise NotPolynomialError
        result, base = Form.constant(1.0), self if exponent >= 0 else self.inverse()
        for _ in range(abs(int(exponent))):
            result = result * base
        return result


TWO: dict[int, Callable[[Form, Form], Form]] = {
    ca.OP_ADD: operator.add,
    ca.OP_SUB: operator.sub,
    ca.OP_MUL: operator.mul,
    ca.OP_DIV: operator.truediv,
    ca.OP_POW: Form.power,
    ca.OP_CONSTPOW: Form.power,
}
ONE: dict[int, Callable[[Form], Form]] = {
    ca.OP_ASSIGN: lambda a: a,
    ca.OP_NEG: operator.neg,
    ca.OP_SQ: lambda a: a * a,
    ca.OP_TWICE: lambda a: a * Form.constant(2.0),
    ca.OP_SQRT: Form.root,
    ca.OP_INV: Form.inverse,
}


@dataclass(frozen=True)
class Tape:
    """The instructions of a function of one column, of which `needed` entries are read."""

    steps: tuple[tuple[int, tuple[int, ...], int, float], ...]
    needed: tuple[int, ...]
    outputs: int

    @staticmethod
    def of(entries: ca.SX, out: ca.SX) -> "Tape":
        """Of an expression (C, 1) of the symbols `entries`."""
        function = ca.Function("tape", [entries], [ca.cse(ca.densify(out))])
        steps, needed = [], set[int]()
        for k in range(function.n_instructions()):
            code = function.instruction_id(k)
            if code == ca.OP_CONST:
                steps.append((code, (), function.instruction_output(k)[0], function.instruction_constant(k)))
                continue
            inputs, outputs = tuple(function.instruction_input(k)), function.instruction_output(k)
            if code == ca.OP_INPUT:
                needed.add(inputs[1])
            # An output names the result and the place in it.
            steps.append((code, inputs, outputs[1] if code == ca.OP_OUTPUT else outputs[0], 0.0))
        return Tape(tuple(steps), tuple(sorted(needed)), function.numel_out(0))

    @property
    def algebraic(self) -> bool:
        """Whether all operations are those that a `Form` has."""
        plain = {ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT}
        return all(code in plain or code in TWO or code in ONE for code, *_ in self.steps)

    def on(self, entries: Mapping[int, Poly]) -> list[Form]:
        """The outputs for entries on pieces; NotPolynomialError where an operation is none of theirs."""
        work: dict[int, Form] = {}
        found = [Form.constant(0.0)] * self.outputs
        for code, inputs, target, value in self.steps:
            if code == ca.OP_CONST:
                if not isfinite(value):
                    raise NotPolynomialError
                work[target] = Form.constant(value)
            elif code == ca.OP_INPUT:
                work[target] = Form(entries[inputs[1]])
            elif code == ca.OP_OUTPUT:
                found[target] = work[inputs[0]]
            elif code in TWO:
                work[target] = TWO[code](work[inputs[0]], work[inputs[1]])
            elif code in ONE:
                work[target] = ONE[code](work[inputs[0]])
            else:
                raise NotPolynomialError
        return found


def values(entries: ca.SX, out: ca.SX) -> Callable[[np.ndarray], np.ndarray]:
    """An expression (C, 1) of the symbols `entries` as a function of numbers (N, entries), which returns (N, C)."""
    function = ca.Function("values", [entries], [ca.densify(out)])

    def at(numbers: np.ndarray) -> np.ndarray:
        return np.asarray(function.map(len(numbers))(ca.DM(numbers.T))).T

    return at
