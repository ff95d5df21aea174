"""Solutions as answers: prices of keyframes and times, where knots pay, how well fits are known, all minima."""

from symmotion.answers.bounds import LowerBound, lower_bound
from symmotion.answers.covariance import Band, FitCovariance, fit_covariance, noise_of
from symmotion.answers.explore import Exploration, explore
from symmotion.answers.knots import KnotSearch, auto_knots, auxiliary_keyframes
from symmotion.answers.optimum import optimum_function
from symmotion.answers.prices import KeyframePrices, keyframe_prices
from symmotion.answers.times import TimePrices, time_prices

__all__ = [
    "Band",
    "Exploration",
    "FitCovariance",
    "KeyframePrices",
    "KnotSearch",
    "LowerBound",
    "TimePrices",
    "auto_knots",
    "auxiliary_keyframes",
    "explore",
    "fit_covariance",
    "keyframe_prices",
    "lower_bound",
    "noise_of",
    "optimum_function",
    "time_prices",
]
