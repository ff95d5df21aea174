"""Motion curves: constructors that give splines, rational quadratics, symbolic B-splines, and timing."""

from symmotion.curves.bezier import RationalQuadratic, bernstein, bezier, de_casteljau
from symmotion.curves.curve import Curve
from symmotion.curves.hermite import catmull_rom, hermite_spline, kochanek_bartels
from symmotion.curves.segments import basis_matrix, blending_functions, constraint_matrix, polynomial_segment
from symmotion.curves.symbolic import SymbolicSpline, symbolic_basis
from symmotion.curves.timing import (
    ArcParameter,
    Retimed,
    arc_length,
    constant_speed,
    slow_in_out,
    smooth_step,
    speed,
)

__all__ = [
    "ArcParameter",
    "Curve",
    "RationalQuadratic",
    "Retimed",
    "SymbolicSpline",
    "arc_length",
    "basis_matrix",
    "bernstein",
    "bezier",
    "blending_functions",
    "catmull_rom",
    "constant_speed",
    "constraint_matrix",
    "de_casteljau",
    "hermite_spline",
    "kochanek_bartels",
    "polynomial_segment",
    "slow_in_out",
    "smooth_step",
    "speed",
    "symbolic_basis",
]
