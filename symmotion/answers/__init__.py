"""Solutions as answers: what keyframes cost, and where knots pay."""

from symmotion.answers.knots import KnotSearch, auto_knots, auxiliary_keyframes
from symmotion.answers.prices import KeyframePrices, keyframe_prices

__all__ = [
    "KeyframePrices",
    "KnotSearch",
    "auto_knots",
    "auxiliary_keyframes",
    "keyframe_prices",
]
