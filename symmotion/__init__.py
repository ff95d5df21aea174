"""symmotion: smooth motions as symbolic constrained programs.

The top level has what most programs need; the rest is in groups: `sm.curves`, `sm.quaternions`, `sm.interpolants`,
`sm.files`, `sm.sweeps`, `sm.bodies`, `sm.splines`, `sm.jets`, `sm.energies`, `sm.constraints`, `sm.solvers`,
`sm.batches`, `sm.answers`, `sm.fairing`, `sm.motions`, `sm.program`, `sm.kernels`, `sm.systems`, `sm.views`,
`sm.report`.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from symmotion import (
    answers,
    batches,
    bodies,
    constraints,
    curves,
    energies,
    fairing,
    files,
    jets,
    kernels,
    motions,
    program,
    solvers,
    splines,
    sweeps,
    systems,
)
from symmotion.answers import explore, lower_bound
from symmotion.batches import solve_many
from symmotion.constraints import JetConstraint, RateBound, SpeedBound, Tolerance, excess
from symmotion.design import (
    affine_program,
    curve_program,
    fit_program,
    free_times_program,
    join,
    measure,
    orientation_program,
    pose_program,
)
from symmotion.energies import JetEnergy, Rigidity, StrainAcceleration, StrainRate, Torque, TrajectoryEnergy
from symmotion.errors import InputError, SolveError
from symmotion.fairing import fair
from symmotion.files import read_keyframes, write_keyframes, write_motion
from symmotion.loading import load
from symmotion.motions import Affine, AffineMotion, Keyframes, examples, interpolants, quaternions
from symmotion.smoothing import smooth
from symmotion.solvers import Elimination, ExactNewton, Ipopt, Solution, compare
from symmotion.systems import certify
from symmotion.version import __version__ as __version__

if TYPE_CHECKING:
    from symmotion import report, views

# Matplotlib takes long to import, and few programs draw.
LATE = ("report", "views")

# The names that 0.1.0 had at the top level, and where they are.
MOVED = {
    "AngularRate": "constraints",
    "BSplineBasis": "splines",
    "Certificate": "systems",
    "CharacteristicCurve": "sweeps",
    "Comparison": "solvers",
    "CurveCondition": "constraints",
    "DualQuaternions": "motions",
    "Energy": "energies",
    "Failed": "batches",
    "FairingResult": "fairing",
    "Jet": "jets",
    "Mesh": "bodies",
    "MovingEllipsoid": "sweeps",
    "NoInversion": "constraints",
    "OnLine": "constraints",
    "Periodic": "constraints",
    "PoseMotion": "motions",
    "Program": "program",
    "QuaternionMotion": "quaternions",
    "RationalMotion": "motions",
    "RationalQuadratic": "curves",
    "ResultsFile": "batches",
    "Retimed": "curves",
    "Skeleton": "files",
    "Spline": "splines",
    "Status": "solvers",
    "SweepSurface": "sweeps",
    "SweptVolume": "sweeps",
    "SymbolicSpline": "curves",
    "Tally": "batches",
    "TwoParameterMotion": "motions",
    "UnitVolume": "constraints",
    "Velocity": "constraints",
    "WrittenMotion": "files",
    "arc_length": "curves",
    "auto_knots": "answers",
    "auxiliary_keyframes": "answers",
    "bernstein": "curves",
    "bezier": "curves",
    "catmull_rom": "curves",
    "characteristic_curves": "sweeps",
    "component_cubic": "interpolants",
    "constant_speed": "curves",
    "copy_deviations": "motions",
    "cubic_interpolant": "splines",
    "de_casteljau": "curves",
    "hermite_spline": "curves",
    "interpolate_quaternions": "quaternions",
    "joint_trajectories": "files",
    "keyframe_prices": "answers",
    "keyframes_from_copies": "motions",
    "kochanek_bartels": "curves",
    "least_squares": "splines",
    "log_blend": "interpolants",
    "orthonormalise": "motions",
    "polar_blend": "interpolants",
    "polynomial_segment": "curves",
    "read_bvh": "files",
    "read_gltf_keyframes": "files",
    "read_motion": "files",
    "read_two_parameter": "files",
    "shoemake_bezier": "interpolants",
    "shoemake_interpolant": "interpolants",
    "slerp": "interpolants",
    "slerp_curve": "interpolants",
    "slow_in_out": "curves",
    "solve_each": "batches",
    "speed": "curves",
    "squad": "interpolants",
    "steady_morph": "interpolants",
    "sweep_surface": "sweeps",
    "swept_volume": "sweeps",
    "symbolic_basis": "curves",
    "write_animation": "views",
    "write_gltf": "files",
    "write_mesh": "files",
    "write_two_parameter": "files",
    "write_usd": "files",
}
GONE = {
    "Limits": "constraints=[RateBound(…), AccelerationBound(…), TorqueBound(…)]",
    "measure_torque": "measure(motion, Torque(inertia))",
}


def __getattr__(name: str) -> object:
    if name in LATE:
        return import_module(f"symmotion.{name}")
    if name in MOVED:
        raise AttributeError(f"sm.{name} is sm.{MOVED[name]}.{name} from 0.2.0 on")
    if name in GONE:
        raise AttributeError(f"sm.{name} is {GONE[name]} from 0.2.0 on")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])


__all__ = [
    "Affine",
    "AffineMotion",
    "Elimination",
    "ExactNewton",
    "InputError",
    "Ipopt",
    "JetConstraint",
    "JetEnergy",
    "Keyframes",
    "RateBound",
    "Rigidity",
    "Solution",
    "SolveError",
    "SpeedBound",
    "StrainAcceleration",
    "StrainRate",
    "Tolerance",
    "Torque",
    "TrajectoryEnergy",
    "affine_program",
    "answers",
    "batches",
    "bodies",
    "certify",
    "compare",
    "constraints",
    "curve_program",
    "curves",
    "energies",
    "examples",
    "excess",
    "explore",
    "fair",
    "fairing",
    "files",
    "fit_program",
    "free_times_program",
    "interpolants",
    "jets",
    "join",
    "kernels",
    "load",
    "lower_bound",
    "measure",
    "motions",
    "orientation_program",
    "pose_program",
    "program",
    "quaternions",
    "read_keyframes",
    "report",
    "smooth",
    "solve_many",
    "solvers",
    "splines",
    "sweeps",
    "systems",
    "views",
    "write_keyframes",
    "write_motion",
]
