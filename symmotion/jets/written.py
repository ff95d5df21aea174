"""A user's function of a jet as text: what becomes of a lambda when it goes to another process."""

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca

from symmotion.errors import InputError
from symmotion.jets.affine import HIGHEST_ORDER, Jet


@dataclass(frozen=True)
class Written:
    """A function of a jet by the text of its CasADi expression in each dimension; called like the function.

    codes: pairs of a dimension and a serialised `Function` of the jet's derivatives, linear parts
    first, and of the time.
    """

    codes: tuple[tuple[int, str], ...]

    @staticmethod
    def of(function: Callable[[Jet], ca.SX]) -> "Written":
        """The text of a function, which is evaluated with symbols in the plane and in space."""
        if isinstance(function, Written):
            return function
        codes, refusal = [], None
        for d in (2, 3):
            jet = Jet(
                tuple(ca.SX.sym("A", d, d) for _ in range(HIGHEST_ORDER + 1)),
                tuple(ca.SX.sym("v", d) for _ in range(HIGHEST_ORDER + 1)),
                ca.SX.sym("t"),
            )
            try:
                out = ca.SX(function(jet))
            except Exception as error:  # a function may well be of one dimension only, and says so as it likes
                refusal = error
            else:
                codes.append((d, ca.Function("jet", [*jet.linear, *jet.translation, jet.t], [out]).serialize()))
        if not codes and refusal is not None:
            raise refusal
        return Written(tuple(codes))

    def __call__(self, jet: Jet) -> ca.SX:
        codes = dict(self.codes)
        if jet.dimension not in codes:
            raise InputError(f"this function of a jet came from another process and works in dimension {[*codes]} only")
        expression = ca.Function.deserialize(codes[jet.dimension])
        return expression(*jet.linear, *jet.translation, jet.t)
