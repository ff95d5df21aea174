from typing import Any, cast

import numpy as np
import pytest
from problems import body_points
from scipy.spatial.transform import Rotation

import symmotion as sm
from symmotion.constraints import dense_times
from symmotion.energies import Energy

KEYS = sm.examples.random_keyframes(6, 60, 1)
Condition: Any = sm.constraints.CurveCondition  # also with what a type checker would refuse
POINTS = body_points(3)
OBJECTIVE = sm.Rigidity() + 0.01 * sm.TrajectoryEnergy(POINTS)
CLOSED = KEYS.moved(-1, KEYS.linear[0], KEYS.translation[0])


def program(*constraints, keys=KEYS, objective: Energy = OBJECTIVE, degree=3):
    return sm.affine_program(keys, objective=objective, constraints=constraints, degree=degree)


LINEAR = {
    "velocity": ([sm.constraints.Velocity(2, [1.0, 0.0, -0.5])], KEYS),
    "angular rate": (
        [sm.constraints.AngularRate(0, [0.0, 0.0, 0.0]), sm.constraints.AngularRate(-1, [0.2, 0.0, 1.0])],
        KEYS,
    ),
    "periodic": ([sm.constraints.Periodic()], CLOSED),
    "line": ([sm.constraints.OnLine(2, [1.0, 1.0, 0.0])], KEYS),
    "several": (
        [sm.constraints.Periodic(), sm.constraints.OnLine(3, [0.0, 0.0, 1.0]), sm.constraints.Velocity(1, [0, 0, 0])],
        CLOSED,
    ),
}


@pytest.mark.parametrize("name", LINEAR)
def test_linear_conditions_hold_and_solvers_agree(name):
    constraints, keys = LINEAR[name]
    p = program(*constraints, keys=keys)
    free = sm.ExactNewton().solve(program(keys=keys)).require()
    comparison = sm.compare(p, [sm.ExactNewton(), sm.Ipopt()])
    for s in comparison.solutions:
        s.require(1e-8)
        assert max(comparison.agreement(s) or (1,)) < 1e-6
        motion = s.motion
        for c in constraints:
            if isinstance(c, sm.constraints.Velocity):
                t = keys.times[c.keyframe]
                np.testing.assert_allclose(motion(t, 1).translation, np.asarray(c.velocity), atol=1e-9)
            if isinstance(c, sm.constraints.AngularRate):
                t = keys.times[c.keyframe]
                spin = motion(t, 1).linear @ np.linalg.inv(motion(t).linear)
                w = np.asarray(c.rate)
                expected = [[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]]
                np.testing.assert_allclose(spin, expected, atol=1e-9)
            if isinstance(c, sm.constraints.Periodic):
                for nu in range(3):
                    first, last = (motion(t, nu) for t in motion.domain)
                    np.testing.assert_allclose(first.linear, last.linear, atol=1e-8)
                    np.testing.assert_allclose(first.translation, last.translation, atol=1e-8)
            if isinstance(c, sm.constraints.OnLine):
                i = c.keyframe
                off = motion(keys.times[i]).translation - keys.translation[i]
                assert np.linalg.norm(np.cross(off, np.asarray(c.direction))) < 1e-9
                assert np.linalg.norm(off) > 1e-3
                assert not s.multipliers["keyframes"].translation[i].any()
                np.testing.assert_allclose(motion(keys.times[i]).linear, keys.linear[i], atol=1e-9)
    if name == "line":
        assert comparison.solutions[0].objective < free.objective
    else:
        assert comparison.solutions[0].objective > free.objective


def test_multiplier_of_a_velocity_is_the_change_of_the_optimum():
    step, direction = 1e-5, np.array([0.0, 1.0, 0.0])

    def solve(factor):
        return sm.ExactNewton().solve(program(sm.constraints.Velocity(2, [1.0, 0, 0] + factor * direction))).require()

    slope = (solve(step).objective - solve(-step).objective) / (2 * step)
    assert slope == pytest.approx(-solve(0.0).multipliers["velocity"][0, 1], rel=1e-6)


def test_unit_volume_is_met_between_keyframes():
    times = np.array([0.5, 1.5, 2.5])
    free = sm.ExactNewton().solve(program()).motion
    assert np.abs(np.linalg.det(free(times).linear) - 1).max() > 1e-4
    comparison = sm.compare(program(sm.constraints.UnitVolume(times)), [sm.ExactNewton(), sm.Ipopt()])
    solution = comparison.solutions[0].require(1e-8)
    assert max(comparison.agreement(comparison.solutions[1].require(1e-8)) or (1,)) < 1e-6
    np.testing.assert_allclose(np.linalg.det(solution.motion(times).linear), 1.0, atol=1e-8)
    assert solution.multipliers["unit volume"].shape == (3, 1)


@pytest.mark.parametrize("norm", [False, True])
def test_tolerances_free_the_keyframes_and_lower_the_objective(norm):
    exact = sm.ExactNewton().solve(program()).require()
    solution = sm.Ipopt().solve(program(sm.Tolerance(linear=0.05, translation=0.1, norm=norm))).require(1e-7)
    reached = solution.motion(KEYS.times)
    off = reached.linear - KEYS.linear
    size = np.linalg.norm(off, axis=(1, 2)) if norm else np.abs(off)
    assert 0.049 < size.max() <= 0.05 + 1e-6
    assert solution.objective < exact.objective
    assert solution.inertia == "positive"
    one = sm.Ipopt().solve(program(sm.Tolerance(linear=0.05, norm=norm, keyframes=[2]))).require(1e-7)
    np.testing.assert_allclose(one.motion(KEYS.times[3]).linear, KEYS.linear[3], atol=1e-7)
    assert solution.objective < one.objective < exact.objective


def test_bounds_along_the_motion_hold_where_they_are_asked_for():
    energy = sm.TrajectoryEnergy(POINTS)
    dense = dense_times(KEYS.times, 8, "")
    free = sm.ExactNewton().solve(program(objective=energy)).motion
    assert np.linalg.det(free(dense).linear).min() < 0.85
    upright = sm.Ipopt().solve(program(sm.constraints.NoInversion(0.9), objective=energy)).require(1e-7)
    assert np.linalg.det(upright.motion(dense).linear).min() > 0.9 - 1e-6
    fastest = np.linalg.norm(free(dense, 1).translation, axis=1).max()
    limit = 0.93 * fastest
    slow = sm.Ipopt().solve(program(sm.SpeedBound([0.0, 0.0, 0.0], limit), objective=energy, degree=4)).require(1e-7)
    assert np.linalg.norm(slow.motion(dense, 1).translation, axis=1).max() < limit + 1e-6
    assert slow.multipliers["speed"].min() > -1e-7
    assert slow.multipliers["speed"].max() > 1e-3


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: program(sm.constraints.Velocity(2, [1, 0, 0]), sm.constraints.Velocity(2, [1, 0, 0])),
            r"'velocity \(2\)'.* repeats",
        ),
        (
            lambda: program(sm.constraints.Velocity(2, [1, 0, 0]), sm.constraints.Velocity(2, [1, 1, 0])),
            r"'velocity \(2\)'.* contradicts",
        ),
        (
            lambda: program(
                sm.constraints.Periodic(),
                sm.constraints.AngularRate(0, [0] * 3),
                sm.constraints.AngularRate(-1, [0, 0, 1]),
                keys=CLOSED,
            ),
            r"'angular rate \(2\)'.* contradicts conditions among keyframes, periodic",
        ),
        (
            lambda: program(sm.constraints.Velocity(2, [1, 0, 0]), objective=sm.Rigidity()),
            "velocity is a condition on the transl",
        ),
        (lambda: program(sm.constraints.Velocity(6, [1, 0, 0])), "velocity: keyframe 6 does not exist: there are 6"),
        (lambda: program(sm.constraints.Velocity(0, [1, 0])), r"velocity: velocity of shape \(2,\)"),
        (lambda: program(sm.constraints.AngularRate(0, 1.0)), r"angular rate: rate of shape \(1,\)"),
        (lambda: program(sm.constraints.Periodic()), "the first and the last keyframe differ"),
        (lambda: program(sm.constraints.Periodic(), keys=CLOSED, degree=1), "degree 1 has no derivative"),
        (lambda: program(sm.constraints.UnitVolume([0.5, 9.0])), r"unit volume: time 9 is outside .*\[0, 5\]"),
        (lambda: program(sm.constraints.UnitVolume([1.0])), "time 1 is a keyframe's"),
        (lambda: program(sm.constraints.OnLine(1, [0, 0, 0])), "line: the direction is zero"),
        (lambda: sm.Tolerance(linear=-1.0), r"tolerance: linear -1.0: a positive number"),
        (lambda: cast(Any, sm).Tolerance(linear="x"), "tolerance: linear 'x': a positive number"),
        (lambda: cast(Any, sm).Tolerance(linear=True), "tolerance: linear True: a positive number"),
        (lambda: sm.Tolerance(turn=[[0.1]]), r"tolerance: turn of shape \(1, 1\)"),
        (lambda: program(cast(Any, sm).Tolerance(linear=0.1, keyframes=0)), "tolerance: keyframe 0: a list of whole"),
        (lambda: cast(Any, sm).constraints.NoInversion("x"), "no inversion: least 'x': a finite number"),
        (lambda: cast(Any, sm).constraints.NoInversion(None), "no inversion: least None: a finite number"),
        (lambda: program(cast(Any, sm).constraints.NoInversion(0.1, density="x")), "no inversion: density 'x'"),
        (lambda: cast(Any, sm).SpeedBound(5.0, np.eye(3)), "speed: limit array.*: a positive number"),
        (lambda: cast(Any, sm).SpeedBound(np.eye(3), None), "speed: limit None"),
        (lambda: sm.RateBound(0.0), "bound on the rate: 0.0: a positive number"),
        (lambda: sm.constraints.AccelerationBound(-1.0), "bound on the acceleration: -1.0"),
        (lambda: cast(Any, sm).constraints.TorqueBound("x"), "bound on the torque: 'x'"),
        (lambda: program(cast(Any, sm).constraints.ExactSamples([[1], [2, 3]])), r"exact sample \(1,\) does not exist"),
        (lambda: Condition.at("x", [[0, 0, 0]]), "values: times: a str is no array"),
        (lambda: Condition.at([0.5, 0.6], [[0], [1, 2]]), "values: values: a list is no array"),
        (lambda: Condition.at([0.5], [[0, 0, 0]], order=None), "derivative order None"),
        (lambda: Condition.at([0.5], [[0, 0, 0]], tolerance=[0.1]), r"values: tolerance \[0.1\]"),
        (lambda: Condition.at([0.5], [[0, 0, 0]], side=["left"]), r"values: side \['left'\] is unknown"),
        (lambda: Condition.between([0.5], [[0, 0]], [[1, 1, 1]]), r"bounds of shapes \(1, 2\) and \(1, 3\)"),
        (lambda: Condition.norm_below([0.5], None), "speed: limit: a NoneType is no array"),
        (lambda: Condition.closed("a", "b"), "periodic: start 'a': a finite number"),
        (lambda: Condition.closed(0, 1, 1), "periodic: orders 1: a list of derivative orders"),
        (lambda: Condition.linked([0.5], "x"), "rebound: factor: a str is no array"),
        (lambda: sm.Tolerance(), "a tolerance on the linear part or the translation"),
        (lambda: program(sm.Tolerance(translation=0.1), objective=sm.Rigidity()), "tolerance is a condition on the tr"),
        (lambda: program(sm.constraints.NoInversion(1.5)), "keyframe 0 has determinant 1, below 1.5"),
        (lambda: program(sm.constraints.NoInversion(0.5, density=0)), "density 0"),
        (lambda: program(sm.SpeedBound([0, 0, 0], -1)), "limit -1"),
        (lambda: program(sm.SpeedBound([0, 0], 1)), r"\(P, 3\)"),
        (lambda: sm.affine_program(KEYS, constraints=cast(Any, ["closed"])), "'closed' is no condition"),
        (lambda: sm.Elimination().solve(program(sm.constraints.NoInversion(0.5))), "'no inversion' is an inequality"),
    ],
)
def test_bad_conditions_name_the_culprit(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()


def test_conditions_follow_moved_keyframes():
    p = program(sm.constraints.AngularRate(2, [0, 0, 1.0]))
    turned = KEYS.moved(2, Rotation.from_rotvec([0.1, 0, 0]).as_matrix() @ KEYS.linear[2])
    moved = sm.ExactNewton().solve(p.with_keyframes(turned)).require()
    direct = sm.ExactNewton().solve(program(sm.constraints.AngularRate(2, [0, 0, 1.0]), keys=turned)).require()
    assert moved.objective == pytest.approx(direct.objective, rel=1e-10)


@pytest.mark.parametrize("energy", [sm.StrainRate(), sm.StrainAcceleration()], ids=lambda e: e.name)
def test_strain_measures_are_invariant_and_rigidity_is_not(energy):
    rng = np.random.default_rng(0)
    keys = sm.examples.spatial_keyframes()
    motion = sm.ExactNewton().solve(sm.affine_program(keys)).motion
    frame, turn = rng.normal(size=(3, 3)) + 2 * np.eye(3), Rotation.random(random_state=1).as_matrix()
    value = sm.measure(motion, energy)
    for seen in (motion.linear @ frame, turn @ motion.linear, turn @ motion.linear @ frame):
        other = sm.AffineMotion(motion.basis, seen, motion.translation)
        assert sm.measure(other, energy) == pytest.approx(value, rel=1e-9)
    framed = sm.AffineMotion(motion.basis, motion.linear @ frame)
    assert sm.measure(framed, sm.Rigidity()) != pytest.approx(sm.measure(motion, sm.Rigidity()), rel=1e-2)


def test_strain_measures_are_the_traces_of_their_definition():
    motion = sm.ExactNewton().solve(sm.affine_program(sm.examples.planar_keyframes())).motion
    points, weights = np.polynomial.legendre.leggauss(60)
    ends = motion.basis.breakpoints
    t = (ends[:-1, None] + np.diff(ends)[:, None] * (points + 1) / 2).ravel()
    w = (np.diff(ends)[:, None] * weights / 2).ravel()
    a, da, dda = (motion(t, nu).linear for nu in range(3))
    swap = lambda m: np.swapaxes(m, 1, 2)  # noqa: E731
    g, dg = swap(a) @ a, swap(da) @ a + swap(a) @ da
    ddg = swap(dda) @ a + 2 * swap(da) @ da + swap(a) @ dda
    rate = np.linalg.solve(g, dg)
    acceleration = np.linalg.solve(g, ddg - dg @ rate)
    for energy, matrix in ((sm.StrainRate(), rate), (sm.StrainAcceleration(), acceleration)):
        exact = np.sum(w * np.trace(matrix @ matrix, axis1=1, axis2=2))
        assert sm.measure(motion, energy) == pytest.approx(exact, rel=1e-9)


def test_strain_optimum_is_certified_and_its_quadrature_error_reported():
    p = sm.affine_program(sm.examples.random_keyframes(5, 50, 3), objective=sm.StrainRate() + sm.Rigidity())
    comparison = sm.compare(p, [sm.ExactNewton(), sm.Ipopt()])
    assert all(s.require(1e-8) for s in comparison.solutions)
    best = comparison.solutions[0]
    errors = p.design.quadrature_errors(best.motion, p)
    assert errors["S"] < 1e-8 * best.terms["S"] + 1e-11
    assert errors["R"] < 1e-12


@pytest.mark.parametrize("condition", [sm.Tolerance(translation=0.05), sm.constraints.OnLine(2, [1.0, 0.0, 0.0])])
def test_a_condition_on_keyframes_a_thousand_million_extents_away_says_what_it_says_nearby(condition):
    keys = sm.examples.random_keyframes(5, 60, seed=3)
    # Both sets of places are exact: the programs are the same but for the distance.
    places = np.round(keys.translation / np.abs(keys.translation).max() * 2**8) / 2**8
    objective = sm.Rigidity(2) + sm.TrajectoryEnergy(np.eye(3))
    near, far = (
        sm.ExactNewton().solve(
            sm.affine_program(
                sm.Keyframes(keys.times, keys.linear, places + away), objective=objective, constraints=[condition]
            )
        )
        for away in (0.0, 2.0**30)
    )
    assert far.status == near.status == "solved"
    assert far.objective == pytest.approx(near.objective, rel=1e-9)
    assert np.abs(far.motion.linear - near.motion.linear).max() < 1e-8
