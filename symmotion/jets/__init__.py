"""Jets: a motion and its derivatives at one parameter, as CasADi symbols."""

from symmotion.jets.affine import HIGHEST_ORDER, Jet
from symmotion.jets.written import Written

__all__ = [
    "HIGHEST_ORDER",
    "Jet",
    "Written",
]
