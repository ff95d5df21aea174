"""symmotion: smooth motions as symbolic constrained programs."""

from symmotion.design import (
    AngularRate,
    NoInversion,
    OnLine,
    Periodic,
    SpeedBound,
    Tolerance,
    UnitVolume,
    Velocity,
    affine_program,
    auto_knots,
    auxiliary_keyframes,
    keyframe_prices,
    measure,
)
from symmotion.energies import (
    Energy,
    Jet,
    JetEnergy,
    Rigidity,
    StrainAcceleration,
    StrainRate,
    TrajectoryEnergy,
)
from symmotion.errors import InputError, SolveError
from symmotion.files import read_keyframes, read_motion, write_keyframes, write_motion
from symmotion.motions import Affine, AffineMotion, Keyframes, examples
from symmotion.program import Certificate, Program
from symmotion.solvers import Comparison, Elimination, ExactNewton, Ipopt, Solution, Status, compare
from symmotion.splines import BSplineBasis, Spline, cubic_interpolant, least_squares

__version__ = "0.1.0"

__all__ = [
    "Affine",
    "AffineMotion",
    "AngularRate",
    "BSplineBasis",
    "Certificate",
    "Comparison",
    "Elimination",
    "Energy",
    "ExactNewton",
    "InputError",
    "Ipopt",
    "Jet",
    "JetEnergy",
    "Keyframes",
    "NoInversion",
    "OnLine",
    "Periodic",
    "Program",
    "Rigidity",
    "Solution",
    "SolveError",
    "SpeedBound",
    "Spline",
    "Status",
    "StrainAcceleration",
    "StrainRate",
    "Tolerance",
    "TrajectoryEnergy",
    "UnitVolume",
    "Velocity",
    "affine_program",
    "auto_knots",
    "auxiliary_keyframes",
    "compare",
    "cubic_interpolant",
    "examples",
    "keyframe_prices",
    "least_squares",
    "measure",
    "read_keyframes",
    "read_motion",
    "write_keyframes",
    "write_motion",
]
