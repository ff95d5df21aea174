"""No door takes entries that are masked or complex, in arrays or in lists; none holds on to the caller's array."""

from dataclasses import fields, is_dataclass
from typing import Any, cast

import numpy as np
import pytest

import symmotion as sm
from symmotion.motions.nets import smooth_net
from symmotion.motions.quaternions import OrientationKeys

RNG = np.random.default_rng(0)
KEYS = sm.examples.random_keyframes(4, 40, 2)
T, A, V = (np.array(a) for a in (KEYS.times, KEYS.linear, KEYS.translation))
Q = np.roll(KEYS.rotations().as_quat(), 1, axis=1)
BASIS = sm.splines.BSplineBasis.clamped([0, 1, 2], 3)
SPLINE = sm.splines.Spline(BASIS, RNG.normal(size=(5, 3)))
AFFINE = sm.AffineMotion(BASIS, RNG.normal(size=(5, 3, 3)), SPLINE.control_points)
NET = smooth_net(6, spatial=True)
DUAL = sm.motions.DualQuaternions
C, D = sm.constraints, sm.constraints.CurveCondition
INSIDE, POINTS, INERTIA = np.array([0.5, 1.5]), np.eye(3), np.diag([1.0, 2.0, 2.5])
AFFINE_PROGRAM = sm.affine_program(KEYS, objective=sm.Rigidity() + sm.TrajectoryEnergy(POINTS))
PARAMETRIC = sm.affine_program(
    KEYS,
    objective=sm.TrajectoryEnergy(POINTS),
    constraints=[sm.JetConstraint(lambda jet, p: jet.dv - p.a, at=0.01, parameters={"a": V[0]})],
)
ORIENTATION, POSE = sm.orientation_program(KEYS), sm.pose_program(KEYS)
JET = cast(Any, ORIENTATION.design).space.symbols()


def with_constraint(constraint):
    return sm.affine_program(KEYS, objective=sm.TrajectoryEnergy(POINTS), constraints=[constraint])


# A function, and good arrays that it takes.
DOORS: dict[str, tuple[Any, ...]] = {
    "Keyframes": (sm.Keyframes, T, A, V),
    "Keyframes.of": (sm.Keyframes.of, T, Q, V),
    "Keyframes.parametrised": (lambda a, v, p: sm.Keyframes.parametrised(a, v, points=p), A, V, POINTS),
    "with_times": (KEYS.with_times, T),
    "moved": (lambda a, v: KEYS.moved(1, a, v), A[1], V[1]),
    "OrientationKeys": (OrientationKeys.of, T, Q),
    "affine_program, knots": (lambda k: sm.affine_program(KEYS, knots=k), T[1:-1]),
    "affine_program, rates": (
        lambda a, v: sm.affine_program(KEYS, ends="clamped", end_rates=sm.motions.Affine(a, v)),
        A[:2],
        V[:2],
    ),
    "fit_program": (
        lambda w, p, k: sm.fit_program(KEYS, degree=1, knots=k, weights=w, points=p),
        np.ones(4),
        np.concatenate([POINTS, -POINTS]),
        T[1:2],
    ),
    "orientation_program": (sm.orientation_program, T, Q),
    "orientation_program, turns": (lambda n: sm.orientation_program(T, Q, turns=n), np.zeros(3)),
    "pose_program": (sm.pose_program, T, Q, V),
    "curve_program": (
        lambda d, b, k: sm.curve_program(KEYS, domain=d, breaks=b, knots=k),
        T[[0, -1]],
        T[1:2],
        T[1:-1],
    ),
    "with_keyframes": (lambda q, v: POSE.with_keyframes((T, q, v)), Q, V),
    "with_parameters": (lambda a: PARAMETRIC.with_parameters(a=a), V[0]),
    "start": (lambda x: sm.ExactNewton(max_iterations=1).solve(AFFINE_PROGRAM, start=x), AFFINE_PROGRAM.x0),
    "certify": (
        lambda x, y: sm.certify(AFFINE_PROGRAM, x, y),
        AFFINE_PROGRAM.x0,
        np.zeros(AFFINE_PROGRAM.conditions),
    ),
    "CurveCondition.at": (D.at, T, V),
    "CurveCondition.between": (D.between, T, V, V + 1),
    "CurveCondition.norm_below": (D.norm_below, T, np.ones(4)),
    "CurveCondition.linked": (D.linked, T[1:-1], np.ones(2)),
    "JetConstraint": (
        lambda low, high, at, data, p: sm.JetConstraint(
            lambda jet: jet.v, lower=low, upper=high, at=at, data=data, parameters={"a": p}
        ),
        np.zeros(3),
        np.ones(3),
        T,
        V,
        V,
    ),
    "Velocity": (lambda v: with_constraint(sm.constraints.Velocity(1, v)), V[0]),
    "AngularRate": (lambda v: with_constraint(C.AngularRate(1, v)), V[0]),
    "OnLine": (lambda v: with_constraint(C.OnLine(1, v)), V[0]),
    "UnitVolume": (lambda t: with_constraint(C.UnitVolume(t)), T[:1] + 0.01),
    "SpeedBound": (lambda p: with_constraint(sm.SpeedBound(p, 9.0)), POINTS),
    "EndRates": (lambda a, v: with_constraint(C.EndRates((a, v))), A[:2], V[:2]),
    "Tolerance": (lambda turn: sm.Tolerance(turn=turn), np.ones(4)),
    "Torque": (sm.Torque, INERTIA),
    "jet.torque": (JET.torque, INERTIA),
    "TrajectoryEnergy": (lambda p, m: sm.TrajectoryEnergy(p, masses=m), POINTS, np.ones(3)),
    "Rigidity": (lambda w: sm.Rigidity(weights=w), np.ones((3, 3))),
    "BSplineBasis": (lambda k: sm.splines.BSplineBasis(k, 3), np.array(BASIS.knots)),
    "clamped": (lambda b: sm.splines.BSplineBasis.clamped(b, 3), np.arange(3.0)),
    "closed": (lambda b: sm.splines.BSplineBasis.closed(b, 1), np.arange(4.0)),
    "basis, called": (BASIS, INSIDE),
    "with_knots": (BASIS.with_knots, INSIDE),
    "Spline": (lambda c: sm.splines.Spline(BASIS, c), np.array(SPLINE.control_points)),
    "spline, called": (SPLINE, INSIDE),
    "refined": (SPLINE.refined, INSIDE),
    "cubic_interpolant": (lambda t, v, s: sm.splines.cubic_interpolant(t, v, "clamped", s), T, V, V[:2]),
    "closest": (lambda t: sm.splines.closest(BASIS, SPLINE, t), np.arange(3.0)),
    "AffineMotion": (lambda a, v: sm.AffineMotion(BASIS, a, v), np.array(AFFINE.linear), np.array(AFFINE.translation)),
    "trajectory": (AFFINE.trajectory, POINTS, INSIDE),
    "QuaternionMotion": (lambda q: sm.quaternions.QuaternionMotion(BASIS, q), Q[[0, 1, 2, 3, 2]]),
    "interpolate_quaternions": (sm.quaternions.interpolate_quaternions, T, Q),
    "ProductMotion": (lambda q: sm.quaternions.ProductMotion.over(BASIS, q), Q[[0, 1, 2, 3, 2]]),
    "monotone_curve": (sm.interpolants.monotone_curve, T, Q),
    "barry_goldman": (sm.interpolants.barry_goldman, T, Q),
    "slerp_bspline": (lambda q: sm.interpolants.slerp_bspline(BASIS, q), Q[[0, 1, 2, 3, 2]]),
    "product": (sm.quaternions.product, Q, Q),
    "exp": (sm.quaternions.exp, V),
    "log": (sm.quaternions.log, Q),
    "rotate": (sm.quaternions.rotate, Q, V),
    "conjugate": (sm.quaternions.conjugate, Q),
    "to_rotation": (sm.quaternions.to_rotation, Q),
    "slerp": (sm.interpolants.slerp, Q[0], Q[1], INSIDE),
    "squad": (sm.interpolants.squad, T, Q),
    "shoemake_bezier": (sm.interpolants.shoemake_bezier, Q),
    "bezier": (sm.curves.bezier, V, np.array([0.0, 1.0])),
    "hermite_spline": (sm.curves.hermite_spline, T, V, V),
    "kochanek_bartels": (sm.curves.kochanek_bartels, T, V, np.zeros(4), np.zeros(4), np.zeros(4)),
    "speed": (lambda t: sm.curves.speed(SPLINE, t), INSIDE),
    "DualQuaternions": (DUAL, Q, np.zeros((4, 4))),
    "DualQuaternions.of": (DUAL.of, Q, np.zeros((4, 4))),
    "from_parts": (DUAL.from_parts, Q, V),
    "from_axis_angle": (DUAL.from_axis_angle, V + 1, np.ones(4), V),
    "from_matrices": (DUAL.from_matrices, A, V),
    "Affine": (lambda a, v, p: sm.motions.Affine(a, v)(p), np.eye(3), np.zeros(3), POINTS),
    "Affine.of": (sm.motions.Affine.of, np.eye(4)),
    "TwoParameterMotion": (
        lambda q, d: sm.motions.TwoParameterMotion(NET.u, NET.v, q, d),
        np.array(NET.real),
        np.array(NET.dual),
    ),
    "rodrigues": (lambda r: NET.rodrigues(3.2, 3.2, reference=r), Q[0]),
    "orthonormalise": (lambda t: sm.motions.orthonormalise(sm.interpolants.component_cubic(KEYS), t), T),
    "measure": (lambda t: sm.measure(sm.interpolants.polar_blend(KEYS), sm.Rigidity(), times=t), T),
    "Body.of": (sm.bodies.Body.of, np.array([[0.0, 0], [1, 0], [1, 1]])),
    "Mesh": (lambda v: sm.bodies.Mesh(v, np.array([[0, 1, 2]])), POINTS),
    "MovingEllipsoid": (lambda a: sm.sweeps.MovingEllipsoid(AFFINE, a), np.ones(3)),
}


def spoiled(good):
    masked = np.ma.array(good.copy(), mask=np.zeros(good.shape, dtype=bool))
    masked.mask.flat[-1] = True
    yield "masked", masked
    if good.ndim > 1:
        yield "masked", list(masked)
    yield "complex|is no ", good + 0j
    yield "complex|is no ", (good + 0j).tolist()


@pytest.mark.parametrize("door", DOORS)
def test_masked_and_complex_entries_are_refused(door):
    function, *arrays = DOORS[door]
    function(*arrays)
    for i, good in enumerate(arrays):
        for message, bad in spoiled(good):
            with pytest.raises(sm.InputError, match=message):
                function(*arrays[:i], bad, *arrays[i + 1 :])


def held_by(made: object):
    if is_dataclass(made):
        made = [getattr(made, f.name) for f in fields(made)]
    if isinstance(made, np.ndarray):
        yield made
    elif isinstance(made, list | tuple):
        for part in made:
            yield from held_by(part)


@pytest.mark.parametrize("door", DOORS)
def test_what_is_made_of_arrays_does_not_follow_them(door):
    function, *arrays = DOORS[door]
    given = [np.array(a) for a in arrays]
    for array in given:
        array.flags.writeable = False
    made = function(*given)
    before = [np.array(a) for a in held_by(made)]
    for array in given:
        array.flags.writeable = True
        array[...] = 77
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(held_by(made), before, strict=True))
