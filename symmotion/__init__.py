"""symmotion: smooth motions as symbolic constrained programs.

The top level has what most programs need; the rest is in groups: `sm.curves`, `sm.quaternions`, `sm.interpolants`,
`sm.files`, `sm.sweeps`, `sm.bodies`, `sm.splines`, `sm.jets`, `sm.energies`, `sm.constraints`, `sm.solvers`,
`sm.batches`, `sm.answers`, `sm.fairing`, `sm.motions`, `sm.program`, `sm.kernels`, `sm.systems`, `sm.views`,
`sm.report`.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from symmotion.renamed import moved
from symmotion.version import __version__ as __version__

if TYPE_CHECKING:
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
        report,
        solvers,
        splines,
        sweeps,
        systems,
        views,
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

# All is imported when it is first asked for: the whole takes most of a second, and few programs need the whole.
GROUPS = (
    "answers",
    "batches",
    "bodies",
    "constraints",
    "curves",
    "energies",
    "fairing",
    "files",
    "jets",
    "kernels",
    "motions",
    "motions.examples",
    "motions.interpolants",
    "motions.quaternions",
    "program",
    "report",
    "solvers",
    "splines",
    "sweeps",
    "systems",
    "views",
)
PLACES = {
    "answers": "explore lower_bound",
    "batches": "solve_many",
    "constraints": "JetConstraint RateBound SpeedBound Tolerance excess",
    "design": """
        affine_program curve_program fit_program free_times_program join measure orientation_program
        pose_program
    """,
    "energies": "JetEnergy Rigidity StrainAcceleration StrainRate Torque TrajectoryEnergy",
    "errors": "InputError SolveError",
    "fairing": "fair",
    "files": "read_keyframes write_keyframes write_motion",
    "loading": "load",
    "motions": "Affine AffineMotion Keyframes",
    "smoothing": "smooth",
    "solvers": "Elimination ExactNewton Ipopt Solution compare",
    "systems": "certify",
}

# The names that 0.1.0 had at the top level, and where they are.
MOVED = {
    "answers": "auto_knots auxiliary_keyframes keyframe_prices",
    "batches": "Failed ResultsFile Tally solve_each",
    "bodies": "Mesh",
    "constraints": "AngularRate CurveCondition NoInversion OnLine Periodic UnitVolume Velocity",
    "curves": """
        RationalQuadratic Retimed SymbolicSpline arc_length bernstein bezier catmull_rom constant_speed
        de_casteljau hermite_spline kochanek_bartels polynomial_segment slow_in_out speed symbolic_basis
    """,
    "energies": "Energy",
    "fairing": "FairingResult",
    "files": """
        Skeleton WrittenMotion joint_trajectories read_bvh read_gltf_keyframes read_motion
        read_two_parameter write_gltf write_mesh write_two_parameter write_usd
    """,
    "interpolants": """
        component_cubic log_blend polar_blend shoemake_bezier shoemake_interpolant slerp slerp_curve squad
        steady_morph
    """,
    "jets": "Jet",
    "motions": """
        DualQuaternions PoseMotion RationalMotion TwoParameterMotion copy_deviations keyframes_from_copies
        orthonormalise
    """,
    "program": "Program",
    "quaternions": "QuaternionMotion interpolate_quaternions",
    "solvers": "Comparison Status",
    "splines": "BSplineBasis Spline cubic_interpolant least_squares",
    "sweeps": """
        CharacteristicCurve MovingEllipsoid SweepSurface SweptVolume characteristic_curves sweep_surface
        swept_volume
    """,
    "systems": "Certificate",
    "views": "write_animation",
}
GONE = {
    "Limits": "constraints=[RateBound(…), AccelerationBound(…), TorqueBound(…)]",
    "measure_torque": "measure(motion, Torque(inertia))",
}


def __getattr__(name: str) -> object:
    group = next((g for g in GROUPS if g.rpartition(".")[2] == name), None)
    place = next((module for module, names in PLACES.items() if name in names.split()), None)
    if group is not None:
        found = import_module(f"symmotion.{group}")
    elif place is not None:
        found = getattr(import_module(f"symmotion.{place}"), name)
    else:
        return moved(__name__, MOVED, GONE)(name)
    globals()[name] = found
    return found


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
