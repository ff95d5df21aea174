"""Times and orientations of keyframes, in programs of every kind."""

from typing import Any, cast

import numpy as np
import pytest

import symmotion as sm
from symmotion.constraints import CurveCondition, NoInversion, UnitVolume
from symmotion.program import Evaluator

KEYS = sm.examples.random_keyframes(5, 30, seed=4).with_times([0.0, 1.0, 2.0, 3.0, 4.0])
OFF = 2 - 2e-16
ENERGY = sm.Rigidity() + 0.1 * sm.TrajectoryEnergy(np.eye(3))
PLACES = CurveCondition.at([0, 1.0, 2, 4], [[0, 0], [1, 2], [3, 2], [4, 0.0]])
PROGRAMS = {
    "affine": lambda keys: sm.affine_program(keys, objective=ENERGY),
    "free times": lambda keys: sm.free_times_program(keys, least_step=1e-12),
    "orientation": sm.orientation_program,
    "pose": sm.pose_program,
    "curve": sm.curve_program,
}
ALL = pytest.mark.parametrize("make", PROGRAMS.values(), ids=PROGRAMS)


def solved(program):
    return sm.ExactNewton().solve(program).require()


def test_an_inactive_bound_at_a_time_off_by_rounding_changes_nothing():
    """Natural spline through four points: least ∫ x″² by the tridiagonal system of its second derivatives."""
    times, values = PLACES.times[:, 0], PLACES.target
    h, slope = np.diff(times), np.diff(values, axis=0) / np.diff(times)[:, None]
    system = np.array([[2 * (h[0] + h[1]), h[1]], [h[1], 2 * (h[1] + h[2])]])
    bends = np.vstack([np.zeros(2), np.linalg.solve(system, 6 * np.diff(slope, axis=0)), np.zeros(2)])
    least = (h[:, None] / 3 * (bends[:-1] ** 2 + bends[:-1] * bends[1:] + bends[1:] ** 2)).sum()
    for at in (2.0, OFF, 2 + 4e-16):
        program = sm.curve_program([PLACES, CurveCondition.norm_below([at], 9.0)])
        assert sm.Ipopt().solve(program).objective == pytest.approx(least, rel=1e-8)
        assert set(program.design.basis.breakpoints) == {0.0, 1.0, 2.0, 4.0}


def test_curves_take_breaks_knots_ends_and_equalities_off_by_rounding_for_those_meant():
    slopes, off = CurveCondition.at([OFF], [[1.0, 0]], order=1), CurveCondition.linked([OFF], -0.5)
    ends = {"domain": (1e-16, 4 + 8e-16)}
    for exact, rounded in (
        (([PLACES, CurveCondition.at([2.0], [[1.0, 0]], order=1)], {}), ([PLACES, slopes], ends)),
        (([PLACES, CurveCondition.linked([2.0], -0.5)], {"breaks": [2.0]}), ([PLACES, off], {"breaks": [2 + 4e-16]})),
        (([PLACES], {"knots": [1.0, 2.0]}), ([PLACES], {"knots": [1 - 1e-16, OFF]})),
        (
            ([PLACES, sm.JetConstraint(lambda jet: jet.dx, at=[0.0, 2.0], name="still")], {}),
            ([PLACES, sm.JetConstraint(lambda jet: jet.dx, at=[-1e-16, OFF], name="still")], {}),
        ),
    ):
        a, b = (sm.curve_program(conditions, **cast(Any, more)) for conditions, more in (exact, rounded))
        assert (a.unknowns, a.conditions) == (b.unknowns, b.conditions)
        assert solved(b).objective == pytest.approx(solved(a).objective, rel=1e-10)
    with pytest.raises(sm.InputError, match="time 2 is given twice"):
        CurveCondition.at([2.0, OFF], [[0, 0], [0, 0]])
    with pytest.raises(sm.InputError, match="follows from the conditions before it"):
        sm.curve_program([PLACES, CurveCondition.at([OFF], [[3, 2.0]], name="again")])


def test_a_constraint_off_by_rounding_is_met_on_the_side_of_the_knot_that_is_meant():
    """The third derivative jumps at a knot."""
    found = []
    for at in (1.0, 1 - 1e-16):
        jump = sm.JetConstraint(lambda jet: jet.dddv, at=at, name="jerk")
        solution = solved(sm.affine_program(KEYS, objective=ENERGY, constraints=[jump]))
        found.append(solution.objective)
        assert np.abs(solution.motion(1.0, 3).translation).max() < 1e-6
    assert found[0] == pytest.approx(found[1], rel=1e-9)
    with pytest.raises(sm.InputError, match="time 1 is a keyframe's"):
        sm.affine_program(KEYS, constraints=[UnitVolume([1 - 1e-16])])
    beyond = sm.JetConstraint(lambda jet: jet.dv, at=[-1e-16, 4 + 8e-16], name="rest")
    solved(sm.affine_program(KEYS, objective=ENERGY, constraints=[beyond]))
    with pytest.raises(sm.InputError, match="outside the motion's domain"):
        sm.affine_program(KEYS, constraints=[sm.JetConstraint(lambda jet: jet.dA, at=4 + 1e-9)])


def test_coupled_bodies_have_times_in_common_up_to_rounding():
    late = KEYS.with_times(np.array(KEYS.times) * (1 - 1e-16) - 1e-16)
    apart = sm.JetConstraint(lambda a, b: a.v - b.v, lower=-9.0, upper=9.0, name="apart")
    met = sm.JetConstraint(lambda a, b: a.dv - b.dv, at=4.0, name="met")
    counts = []
    for other in (KEYS, late):
        bodies = {name: sm.affine_program(k, objective=ENERGY) for name, k in (("a", KEYS), ("b", other))}
        counts.append(sm.join(bodies, [apart, met]).conditions)
    assert counts[0] == counts[1]


def test_given_knots_and_starts_off_by_rounding_are_those_of_the_keyframes():
    inner = np.array([1 + 2e-16, 1.5, OFF, 3.0])
    exact = solved(sm.affine_program(KEYS, knots=[1.0, 1.5, 2.0, 3.0]))
    rounded = sm.affine_program(KEYS, knots=inner)
    assert list(rounded.design.basis.breakpoints) == [0, 1, 1.5, 2, 3, 4]
    basis = sm.splines.BSplineBasis.clamped([0, *inner, 4 + 8e-16], 3)
    start = sm.AffineMotion(basis, exact.motion.linear, exact.motion.translation)
    np.testing.assert_allclose(
        sm.ExactNewton().solve(rounded, start=start).log[0].objective, exact.objective, rtol=1e-12
    )
    turning = sm.orientation_program(KEYS, knots=inner)
    assert len(turning.design.space.breakpoints) == 6
    fit = sm.fit_program(KEYS, degree=1, knots=[OFF])
    assert fit.design.basis.breakpoints[1] == 2.0


@ALL
def test_keyframes_of_the_same_times_up_to_rounding_take_the_place_of_others(make):
    program = make(KEYS)
    again = program.with_keyframes(KEYS.with_times(np.array([1e-16, 1 - 1e-16, OFF, 3, 4 + 8e-16])))
    x = program.x0
    assert Evaluator(again).objective(x) == pytest.approx(Evaluator(program).objective(x), rel=1e-9)
    with pytest.raises(sm.InputError, match="keeps the"):
        program.with_keyframes(KEYS.with_times(np.array([1e-6, 1, 2, 3, 4])))


def test_free_times_start_from_a_motion_whose_ends_are_off_by_rounding():
    program = sm.free_times_program(KEYS)
    motion = program.design.motion({"controls": program.x0.reshape(program.design.n, -1)})
    knots = np.array(motion.basis.knots)
    knots[knots == 4.0] = 4 + 8e-16
    moved = sm.AffineMotion(sm.splines.BSplineBasis(knots, 3), motion.linear, motion.translation)
    np.testing.assert_allclose(program.design.unknowns(moved)["controls"].ravel(), program.x0, atol=1e-12)
    with pytest.raises(sm.InputError, match="is not more than least_step"):
        sm.free_times_program(KEYS.with_times([0, 0.1, 0.1 + 0.2, 3, 4]), least_step=0.2)


@ALL
def test_keyframes_that_crowd_are_named_with_what_merges_them(make):
    still = KEYS.moved(2, KEYS.linear[1], KEYS.translation[1])
    crowded = still.with_times([0.0, 1.0, 1.0 + 5e-7, 2.0, 3.0])
    message = r"keyframes 1 and 2 \(times 1.0 and 1.0000005\) are 5.0e-07 of the median step apart.*keys.merged\(\)"
    with pytest.raises(sm.InputError, match=message):
        make(crowded)
    assert make(crowded.merged()).notes == ()
    close = make(still.with_times([0.0, 1.0, 1.0 + 5e-4, 2.0, 3.0]))
    (note,) = close.notes
    assert "keyframes 1 and 2 (times 1.0 and 1.0005) are 5.0e-04 of the median step" in note
    assert f"  note        {note}" in str(close) == repr(close)
    assert make(still.with_times([0.0, 1.0, 1.0 + 2e-3, 2.0, 3.0])).notes == ()


def test_times_that_their_size_does_not_resolve_are_named():
    far = KEYS.with_times(1e10 + 4e-6 * np.arange(5))
    with pytest.raises(sm.InputError, match="closer than times of that size can tell: count from a nearer"):
        sm.affine_program(far)


def test_samples_of_a_fit_may_crowd_but_exact_ones_get_controls_of_their_own():
    samples = KEYS.with_times([0.0, 1.0, 1.0 + 1e-9, 2.0, 3.0])
    assert sm.fit_program(samples, degree=1, controls=2).notes == ()
    with pytest.raises(sm.InputError, match=r"exact samples 1 and 2 .* 2.0e-09 of the median"):
        sm.fit_program(samples, degree=1, controls=4, exact=[1, 2, 3])


def test_uneven_steps_up_to_ten_thousand_to_one_are_solved():
    even = [0.0, 1.0, 2.0, 3.0, 4.0]
    for times in ([0.0, 1.0, 1.0 + 1e-4, 2.0, 3.0], [0.0, 1e-4, 2e-4, 1.0, 2.0], even):
        slow = sm.Keyframes(times, KEYS.linear, np.outer(times, [1.0, 2.0, 0.0]))
        path = sm.affine_program(slow, objective=sm.TrajectoryEnergy(np.zeros((1, 3))))
        assert solved(sm.affine_program(slow, objective=sm.Rigidity())).violation < 1e-8
        assert path.conditions == 5 * 12


def mirrored(which):
    linear = KEYS.linear.copy()
    linear[which] = linear[which] @ np.diag([1, 1, -1.0])
    return sm.Keyframes(KEYS.times, linear, KEYS.translation)


@pytest.mark.parametrize(
    "make",
    [sm.affine_program, sm.free_times_program, lambda keys: sm.fit_program(keys, degree=1, controls=3)],
    ids=["affine", "free times", "fit"],
)
def test_keyframes_that_reflect_each_other_are_a_note(make):
    (note,) = make(mirrored([2])).notes
    assert "keyframes 1 and 2 have determinants 1 and -1, opposite orientations: between them det A passes zero" in note
    assert make(mirrored([0, 1, 2, 3, 4])).notes == make(KEYS).notes == ()


def test_where_the_volume_divides_or_must_not_vanish_they_are_an_error():
    keys = mirrored([2])
    for energy in (sm.StrainRate(), sm.StrainAcceleration(), sm.Rigidity() + sm.StrainRate()):
        for make in (
            lambda e: sm.affine_program(keys, objective=e),
            lambda e: sm.free_times_program(keys, objective=e),
            lambda e: sm.fit_program(keys, degree=1, controls=3, objective=e),
        ):
            with pytest.raises(sm.InputError, match="keyframe 2 has determinant -1 and keyframe 0 1: between them"):
                make(energy)
    assert sm.fit_program(keys, degree=1, controls=3, objective=sm.StrainRate(), weights=[1.0, 1, 0, 1, 1]).notes == ()
    with pytest.raises(sm.InputError, match=r"no inversion: keyframe 2 has determinant -1 and keyframe \d 1: "):
        sm.affine_program(keys, constraints=[NoInversion(0.1)])
    with pytest.raises(sm.InputError, match=r"keyframe \d has determinant -1, below 0\.1"):
        sm.affine_program(mirrored([0, 1, 2, 3, 4]), constraints=[NoInversion(0.1)])


def test_notes_of_bodies_are_told_by_body():
    bodies = {"arm": sm.affine_program(KEYS), "hand": sm.affine_program(mirrored([1]))}
    (note,) = sm.join(bodies).notes
    assert note.startswith("hand: keyframes 0 and 1 have determinants")


@pytest.mark.parametrize("moments", [(1, 2, 4), np.diag([4.0, 1, 2]), (1.0, 1.0, 2.0001)])
def test_moments_that_no_body_has_are_refused(moments):
    bound = sm.constraints.TorqueBound(1.0, moments)
    jet = cast(Any, sm.orientation_program(KEYS).design).space.symbols()
    for ask in (
        lambda: sm.Torque(moments),
        lambda: sm.orientation_program(KEYS, constraints=[bound]),
        lambda: jet.torque(moments),
    ):
        with pytest.raises(sm.InputError, match=r"inertia of moments 1, .*no body has one that exceeds the sum"):
            ask()


def test_moments_of_bodies_are_taken():
    """Of random clouds of mass points, by J = Σ m (|x|² I − x xᵀ), flat ones among them."""
    rng = np.random.default_rng(0)
    for extent in ((1.0, 1, 1), (1.0, 0.5, 0), (1.0, 0.01, 0.01)):
        x, m = rng.normal(size=(20, 3)) * extent, rng.uniform(0.1, 1, 20)
        inertia = (m * (x**2).sum(axis=1)).sum() * np.eye(3) - (x.T * m) @ x
        np.testing.assert_array_equal(sm.Torque(inertia).inertia, inertia)
