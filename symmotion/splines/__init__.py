"""B-spline bases, splines as values, quadrature and interpolation. NumPy and SciPy only."""

from symmotion.splines.basis import BSplineBasis, from_origin
from symmotion.splines.cumulative import CumulativeBasis, cumulative
from symmotion.splines.instants import same_times, unified
from symmotion.splines.interpolation import amid, check_times, closest, cubic_interpolant, least_squares
from symmotion.splines.quadrature import Integral, gauss, integrate
from symmotion.splines.spline import Spline, SplineLike

__all__ = [
    "BSplineBasis",
    "CumulativeBasis",
    "Integral",
    "Spline",
    "SplineLike",
    "amid",
    "check_times",
    "closest",
    "cubic_interpolant",
    "cumulative",
    "from_origin",
    "gauss",
    "integrate",
    "least_squares",
    "same_times",
    "unified",
]
