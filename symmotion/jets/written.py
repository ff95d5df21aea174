"""A user's function of jets as text: what becomes of a lambda when it goes to another process."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from inspect import signature
from itertools import product
from typing import Any

import casadi as ca

from symmotion.errors import InputError
from symmotion.jets.affine import HIGHEST_ORDER, affine_jet
from symmotion.jets.curve import NET_ORDERS, curve_jet, net_jet
from symmotion.jets.jet import AnyJet
from symmotion.jets.rigid import rigid_jet

ORDERS = HIGHEST_ORDER + 1


def jets_of_all_kinds() -> list[AnyJet]:
    """A jet of symbols of every kind: affine in the plane and in space, orientation, pose, curves and nets up to 8D."""

    def symbols(count: int) -> ca.SX:
        return ca.SX.sym("jet", count)

    affine = [affine_jet(symbols(ORDERS * (d * d + d) + 1), d) for d in (2, 3)]
    rigid = [rigid_jet(symbols(23 if pose else 11), pose) for pose in (False, True)]
    curves = [curve_jet(symbols(ORDERS * size + 1), (size, 1)) for size in range(1, 9)]
    nets = [net_jet(symbols(len(NET_ORDERS) * size + 1), size, count) for size in (4, 8) for count in (1, 2)]
    return [*affine, *rigid, *curves, *nets]


def tuples_of_jets(count: int) -> Iterable[Sequence[AnyJet]]:
    """Tuples of jets of every kind; of more than two, which are those of one motion, only of one kind each."""
    kinds = [jets_of_all_kinds() for _ in range(count)]
    return product(*kinds) if count <= 2 else zip(*kinds, strict=True)


def positional(function: Callable[..., object], otherwise: int) -> int:
    """How many arguments a function needs by position; `otherwise` where its signature leaves that open."""
    try:
        parameters = signature(function).parameters.values()
    except (TypeError, ValueError):
        return otherwise
    if any(p.kind is p.VAR_POSITIONAL for p in parameters):
        return otherwise
    return sum(p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD) and p.default is p.empty for p in parameters)


@dataclass(frozen=True)
class Written:
    """A function of jets by the text of its CasADi expression for each kind of jet; called like the function.

    codes: pairs of the kinds of the jets and a serialised `Function` of their entries and of what else it is handed.

    Raises InputError for a kind of jet that it was not written for.

    >>> import pickle
    >>> floor = sm.JetConstraint(lambda jet: jet.v[-1], lower=0.0, upper=np.inf, name="floor")
    >>> again = pickle.loads(pickle.dumps(floor))
    >>> type(again.function).__name__
    'Written'
    """

    codes: tuple[tuple[tuple[str, ...], str], ...]

    def __repr__(self) -> str:
        return f"Written({', '.join(' and '.join(kinds) for kinds, _ in self.codes)})"

    @staticmethod
    def of(
        function: Callable[..., Any],  # a function of the user's own
        arguments: Iterable[Sequence[AnyJet]] | None = None,
        more: Sequence[ca.SX] = (),
        hand: Callable[[Sequence[ca.SX]], Sequence[object]] = tuple,
    ) -> "Written":
        """The text of a function for the jets of `arguments`, one jet of every kind when left out.

        more: symbols that it is handed beside the jets, in the form that `hand` gives them.
        """
        if isinstance(function, Written):
            return function
        codes, refusal = [], None
        for jets in ([jet] for jet in jets_of_all_kinds()) if arguments is None else arguments:
            try:
                out = ca.SX(function(*jets, *hand(more)))
            except Exception as error:  # a function may well be of one kind of jet only, and says so as it likes
                refusal = error
            else:
                inputs = _symbols_for(jets)
                code = ca.Function("jet", [*inputs, *more], [out]).serialize()
                codes.append((tuple(jet.kind for jet in jets), code))
        if not codes and refusal is not None:
            raise refusal
        return Written(tuple(codes))

    # Any: jets, and symbols behind them.
    def __call__(self, *arguments: Any) -> ca.SX:
        jets = [a for a in arguments if hasattr(a, "entries")]
        kinds = tuple(jet.kind for jet in jets)
        code = dict(self.codes).get(kinds)
        if code is None:
            known = ", ".join(" and ".join(k) for k, _ in self.codes)
            raise InputError(
                f"this function of a jet came from another process and takes jets of the kinds {known}, not "
                f"{' and '.join(kinds)}"
            )
        more = [ca.vec(ca.SX(a)) for a in arguments[len(jets) :]]
        return ca.SX(ca.Function.deserialize(code)(*(jet.entries for jet in jets), *more))


def same_text(one: Callable[[], Written], other: Callable[[], Written]) -> bool:
    """Whether two functions are the same expression of every kind of jet that both are written for.

    One may be written for fewer kinds than the other; functions that cannot be written are not the same.
    """
    try:
        mine, theirs = dict(one().codes), dict(other().codes)
    except InputError:
        return False
    fewer, more = sorted((mine, theirs), key=len)
    return bool(fewer) and fewer.keys() <= more.keys() and all(more[kinds] == code for kinds, code in fewer.items())


def _symbols_for(jets: Sequence[AnyJet]) -> list[ca.SX]:
    for jet in jets:
        if not jet.entries.is_valid_input():
            raise InputError(f"a jet of kind {jet.kind} is made of expressions, not of symbols")
    return [jet.entries for jet in jets]
