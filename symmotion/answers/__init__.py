"""Solutions as answers: what keyframes and times cost, how well fits are known, and where knots pay."""

from symmotion.answers.covariance import Band, FitCovariance, fit_covariance, noise_of
from symmotion.answers.knots import KnotSearch, auto_knots, auxiliary_keyframes
from symmotion.answers.optimum import optimum_function
from symmotion.answers.prices import KeyframePrices, keyframe_prices
from symmotion.answers.times import TimePrices, time_prices

__all__ = [
    "Band",
    "FitCovariance",
    "KeyframePrices",
    "KnotSearch",
    "TimePrices",
    "auto_knots",
    "auxiliary_keyframes",
    "fit_covariance",
    "keyframe_prices",
    "noise_of",
    "optimum_function",
    "time_prices",
]
