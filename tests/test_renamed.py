"""What 0.1.0 called otherwise says what it is called now, whichever way it is asked for."""

import importlib
import re

import numpy as np
import pytest

import symmotion as sm
from symmotion.renamed import renamed

# What `__all__` was in 0.1.0, at the top level and in the packages.
OLD = {
    "": """
        Affine AffineMotion AngularRate BSplineBasis Certificate CharacteristicCurve Comparison CurveCondition
        DualQuaternions Elimination Energy ExactNewton Failed FairingResult InputError Ipopt Jet JetEnergy Keyframes
        Limits Mesh MovingEllipsoid NoInversion OnLine Periodic PoseMotion Program QuaternionMotion RationalMotion
        RationalQuadratic ResultsFile Retimed Rigidity Skeleton Solution SolveError SpeedBound Spline Status
        StrainAcceleration StrainRate SweepSurface SweptVolume SymbolicSpline Tally Tolerance TrajectoryEnergy
        TwoParameterMotion UnitVolume Velocity WrittenMotion affine_program arc_length auto_knots
        auxiliary_keyframes bernstein bezier catmull_rom characteristic_curves compare component_cubic
        constant_speed copy_deviations cubic_interpolant curve_program de_casteljau examples fair fit_program
        free_times_program hermite_spline interpolate_quaternions joint_trajectories keyframe_prices
        keyframes_from_copies kochanek_bartels least_squares log_blend measure measure_torque orientation_program
        orthonormalise polar_blend polynomial_segment pose_program read_bvh read_gltf_keyframes read_keyframes
        read_motion read_two_parameter shoemake_bezier shoemake_interpolant slerp slerp_curve slow_in_out solve_each
        solve_many speed squad steady_morph sweep_surface swept_volume symbolic_basis write_animation write_gltf
        write_keyframes write_mesh write_motion write_two_parameter write_usd
    """,
    "curves": """
        ArcParameter Curve RationalQuadratic Retimed SymbolicSpline arc_length basis_matrix bernstein bezier
        blending_functions catmull_rom constant_speed constraint_matrix de_casteljau hermite_spline kochanek_bartels
        polynomial_segment slow_in_out smooth_step speed symbolic_basis
    """,
    "design": """
        AffineDesign AngularRate CurveCondition CurveDesign KeyframePrices KnotSearch Limits MotionConstraint
        NoInversion OnLine Periodic SpeedBound Tolerance UnitVolume Velocity affine_program auto_knots
        auxiliary_keyframes curve_program fit_program free_times_program keyframe_prices measure measure_torque
        orientation_program pose_program
    """,
    "energies": """
        HIGHEST_ORDER Energy EnergySum Jet JetEnergy Rigidity StrainAcceleration StrainRate TrajectoryEnergy
    """,
    "fairing": """
        METHODS Coordinates FairingResult FairingStatus Jumps StepTables fair fairing_program local_step_program
    """,
    "files": """
        Skeleton WrittenMotion joint_trajectories read_bvh read_gltf_keyframes read_keyframes read_motion
        read_two_parameter whole_file write_gltf write_keyframes write_mesh write_motion write_two_parameter
        write_usd
    """,
    "motions": """
        Affine AffineMotion CurveMotion DualQuaternions Keyframes PoseMotion QuaternionMotion RationalMotion
        RigidSamples TwoParameterMotion as_rotations component_cubic copy_deviations examples
        interpolate_quaternions keyframes_from_copies log_blend orthonormalise polar_blend shoemake_bezier
        shoemake_interpolant slerp slerp_curve squad steady_morph
    """,
    "program": """
        Block BlockEvaluator Certificate Condensed Constraint Design Evaluator HessianTriangle Kernel Kernels
        Program Saddle available_processors certify gradient_scale kkt_pattern system_of
    """,
    "report": """
        Body Column Figure Player Run Study StudyOptions StudyRecord StudyResult Table Track require_writable
        write_report
    """,
    "solvers": """
        Comparison Elimination ExactNewton Failed Ipopt Iteration ResultsFile Seconds Solution Status Tally compare
        solve_each solve_many solver_by_name
    """,
    "splines": """
        BSplineBasis Spline check_times closest cubic_interpolant gauss least_squares
    """,
    "sweeps": """
        CharacteristicCurve Estimate Mesh MovingEllipsoid SweepSurface SweptVolume characteristic_curves
        sweep_surface swept_volume
    """,
}
NAMES = [(room, name) for room, names in OLD.items() for name in names.split()]


def found(room: str, name: str) -> str:
    """What an old name is now: "" where it is where it was, else what its error says."""
    module = importlib.import_module(f"symmotion.{room}" if room else "symmotion")
    try:
        getattr(module, name)
    except AttributeError as error:
        return re.fullmatch(rf"{room or 'sm'}\.{name} is (.*) from 0\.2\.0 on", str(error))[1]  # pyright: ignore[reportOptionalSubscript]
    return ""


@pytest.mark.parametrize("room", OLD)
def test_every_old_name_is_there_or_says_where(room):
    moved = {name: now for name in OLD[room].split() if (now := found(room, name))}
    for name, now in moved.items():
        group = re.fullmatch(rf"sm\.(\w+)\.{name}", now)
        if group:
            assert name in getattr(sm, group[1]).__all__
        else:
            assert (room, name) in {
                *(("", n) for n in ("Limits", "measure_torque")),
                *(("design", n) for n in ("Limits", "measure_torque")),
                ("program", "gradient_scale"),
                ("files", "whole_file"),
            }


@pytest.mark.parametrize("room", ["", "design", "report"])
def test_an_old_name_says_so_when_it_is_imported(room):
    name, now = {"": ("bezier", "curves"), "design": ("Velocity", "constraints"), "report": ("Body", "bodies")}[room]
    package = f"symmotion.{room}" if room else "symmotion"
    with pytest.raises(ImportError, match=rf"{room or 'sm'}\.{name} is sm\.{now}\.{name} from 0\.2\.0 on"):
        exec(f"from {package} import {name}")
    with pytest.raises(ImportError, match="cannot import name 'nothing'"):
        exec(f"from {package} import nothing")
    assert not hasattr(importlib.import_module(package), name)


def test_an_old_argument_says_what_to_write():
    @renamed(limit="bound, twice as large")
    def double(bound: float) -> float:
        return 2 * bound

    assert double(2.0) == double(bound=2.0) == 4.0
    with pytest.raises(sm.InputError, match=r"double: limit is bound, twice as large from 0\.2\.0 on"):
        double(limit=2.0)  # pyright: ignore[reportCallIssue]
    with pytest.raises(sm.InputError, match="affine_program: keyframes is keys"):
        sm.affine_program(keyframes=np.eye(2))  # pyright: ignore[reportCallIssue]
