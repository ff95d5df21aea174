"""symmotion: smooth motions as symbolic constrained programs."""

from symmotion.design import affine_program, measure
from symmotion.energies import Energy, Jet, JetEnergy, Rigidity, TrajectoryEnergy
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
    "Program",
    "Rigidity",
    "Solution",
    "SolveError",
    "Spline",
    "Status",
    "TrajectoryEnergy",
    "affine_program",
    "compare",
    "cubic_interpolant",
    "examples",
    "least_squares",
    "measure",
    "read_keyframes",
    "read_motion",
    "write_keyframes",
    "write_motion",
]
