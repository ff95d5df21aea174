"""symmotion: smooth motions as symbolic constrained programs."""

from typing import TYPE_CHECKING

from symmotion.answers import auto_knots, auxiliary_keyframes, keyframe_prices
from symmotion.batches import Failed, ResultsFile, Tally, solve_each, solve_many
from symmotion.bodies import Mesh
from symmotion.curves import (
    RationalQuadratic,
    Retimed,
    SymbolicSpline,
    arc_length,
    bernstein,
    bezier,
    catmull_rom,
    constant_speed,
    de_casteljau,
    hermite_spline,
    kochanek_bartels,
    polynomial_segment,
    slow_in_out,
    speed,
    symbolic_basis,
)
from symmotion.design import (
    AngularRate,
    CurveCondition,
    Limits,
    NoInversion,
    OnLine,
    Periodic,
    SpeedBound,
    Tolerance,
    UnitVolume,
    Velocity,
    affine_program,
    curve_program,
    fit_program,
    free_times_program,
    measure,
    measure_torque,
    orientation_program,
    pose_program,
)
from symmotion.energies import Energy, JetEnergy, Rigidity, StrainAcceleration, StrainRate, TrajectoryEnergy
from symmotion.errors import InputError, SolveError
from symmotion.fairing import FairingResult, fair
from symmotion.files import (
    Skeleton,
    WrittenMotion,
    joint_trajectories,
    read_bvh,
    read_gltf_keyframes,
    read_keyframes,
    read_motion,
    read_two_parameter,
    write_gltf,
    write_keyframes,
    write_mesh,
    write_motion,
    write_two_parameter,
    write_usd,
)
from symmotion.jets import Jet
from symmotion.motions import (
    Affine,
    AffineMotion,
    DualQuaternions,
    Keyframes,
    PoseMotion,
    RationalMotion,
    TwoParameterMotion,
    copy_deviations,
    examples,
    keyframes_from_copies,
    orthonormalise,
)
from symmotion.motions.interpolants import (
    component_cubic,
    log_blend,
    polar_blend,
    shoemake_bezier,
    shoemake_interpolant,
    slerp,
    slerp_curve,
    squad,
    steady_morph,
)
from symmotion.motions.quaternions import QuaternionMotion, interpolate_quaternions
from symmotion.program import Program
from symmotion.solvers import Comparison, Elimination, ExactNewton, Ipopt, Solution, Status, compare
from symmotion.splines import BSplineBasis, Spline, cubic_interpolant, least_squares
from symmotion.sweeps import (
    CharacteristicCurve,
    MovingEllipsoid,
    SweepSurface,
    SweptVolume,
    characteristic_curves,
    sweep_surface,
    swept_volume,
)
from symmotion.systems import Certificate

if TYPE_CHECKING:
    from symmotion.views.films import write_animation

__version__ = "0.1.0"


def __getattr__(name: str):
    # Matplotlib takes long to import, and few programs make films.
    if name == "write_animation":
        from symmotion.views.films import write_animation

        return write_animation
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


__all__ = [
    "Affine",
    "AffineMotion",
    "AngularRate",
    "BSplineBasis",
    "Certificate",
    "CharacteristicCurve",
    "Comparison",
    "CurveCondition",
    "DualQuaternions",
    "Elimination",
    "Energy",
    "ExactNewton",
    "Failed",
    "FairingResult",
    "InputError",
    "Ipopt",
    "Jet",
    "JetEnergy",
    "Keyframes",
    "Limits",
    "Mesh",
    "MovingEllipsoid",
    "NoInversion",
    "OnLine",
    "Periodic",
    "PoseMotion",
    "Program",
    "QuaternionMotion",
    "RationalMotion",
    "RationalQuadratic",
    "ResultsFile",
    "Retimed",
    "Rigidity",
    "Skeleton",
    "Solution",
    "SolveError",
    "SpeedBound",
    "Spline",
    "Status",
    "StrainAcceleration",
    "StrainRate",
    "SweepSurface",
    "SweptVolume",
    "SymbolicSpline",
    "Tally",
    "Tolerance",
    "TrajectoryEnergy",
    "TwoParameterMotion",
    "UnitVolume",
    "Velocity",
    "WrittenMotion",
    "affine_program",
    "arc_length",
    "auto_knots",
    "auxiliary_keyframes",
    "bernstein",
    "bezier",
    "catmull_rom",
    "characteristic_curves",
    "compare",
    "component_cubic",
    "constant_speed",
    "copy_deviations",
    "cubic_interpolant",
    "curve_program",
    "de_casteljau",
    "examples",
    "fair",
    "fit_program",
    "free_times_program",
    "hermite_spline",
    "interpolate_quaternions",
    "joint_trajectories",
    "keyframe_prices",
    "keyframes_from_copies",
    "kochanek_bartels",
    "least_squares",
    "log_blend",
    "measure",
    "measure_torque",
    "orientation_program",
    "orthonormalise",
    "polar_blend",
    "polynomial_segment",
    "pose_program",
    "read_bvh",
    "read_gltf_keyframes",
    "read_keyframes",
    "read_motion",
    "read_two_parameter",
    "shoemake_bezier",
    "shoemake_interpolant",
    "slerp",
    "slerp_curve",
    "slow_in_out",
    "solve_each",
    "solve_many",
    "speed",
    "squad",
    "steady_morph",
    "sweep_surface",
    "swept_volume",
    "symbolic_basis",
    "write_animation",
    "write_gltf",
    "write_keyframes",
    "write_mesh",
    "write_motion",
    "write_two_parameter",
    "write_usd",
]
