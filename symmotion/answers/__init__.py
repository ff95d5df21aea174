"""Solutions as answers: what keyframes cost, where knots pay, which minima there are, and how low they can be."""

from symmotion.answers.bounds import LowerBound, lower_bound
from symmotion.answers.explore import Exploration, explore
from symmotion.answers.knots import KnotSearch, auto_knots, auxiliary_keyframes
from symmotion.answers.prices import KeyframePrices, keyframe_prices

__all__ = [
    "Exploration",
    "KeyframePrices",
    "KnotSearch",
    "LowerBound",
    "auto_knots",
    "auxiliary_keyframes",
    "explore",
    "keyframe_prices",
    "lower_bound",
]
