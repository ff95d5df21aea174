"""B-spline bases, splines as values, quadrature and interpolation. NumPy and SciPy only."""

from symmotion.splines.basis import BSplineBasis
from symmotion.splines.cumulative import cumulative
from symmotion.splines.instants import same_times, unified
from symmotion.splines.interpolation import check_times, closest, cubic_interpolant, least_squares
from symmotion.splines.quadrature import Integral, gauss, integrate
from symmotion.splines.spline import Spline

__all__ = [
    "BSplineBasis",
    "Integral",
    "Spline",
    "check_times",
    "closest",
    "cubic_interpolant",
    "cumulative",
    "gauss",
    "integrate",
    "least_squares",
    "same_times",
    "unified",
]
