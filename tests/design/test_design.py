from typing import Any, cast

import numpy as np
import pytest

import symmotion as sm
from symmotion.design.affine import refined_times
from symmotion.program import Evaluator

KEYS = sm.examples.spatial_keyframes()


def start_motion(program) -> sm.AffineMotion:
    return program.design.motion(program.unpack(program.x0))


@pytest.mark.parametrize("refine", [0, 1, 3])
def test_cubic_start_is_the_interpolating_spline_refined_exactly(refine):
    program = sm.affine_program(KEYS, refine=refine)
    motion = start_motion(program)
    spline = sm.splines.cubic_interpolant(KEYS.times, KEYS.linear)
    t = np.linspace(*motion.domain, 201)
    assert np.abs(motion(t).linear - spline(t)).max() < 1e-12
    assert motion.basis.n == len(KEYS) + 2 + refine * (len(KEYS) - 1)
    np.testing.assert_allclose(motion.basis.breakpoints, refined_times(KEYS.times, refine))


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5, 7])
@pytest.mark.parametrize("refine", [0, 1, 2])
def test_start_meets_the_keyframes_at_every_degree(degree, refine):
    program = sm.affine_program(KEYS, degree=degree, refine=refine)
    motion = start_motion(program)
    assert motion.degree == degree
    np.testing.assert_allclose(motion(KEYS.times).linear, KEYS.linear, atol=1e-11)
    np.testing.assert_allclose(motion(KEYS.times).translation, KEYS.translation, atol=1e-11)
    assert np.abs(Evaluator(program).values(program.x0)).max() < 1e-11


def test_two_keyframes_without_knots_start_from_the_linear_motion():
    keys = sm.examples.sheared_turn()
    for degree in range(1, 6):
        motion = start_motion(sm.affine_program(keys, degree=degree, refine=0))
        assert motion.basis.n == degree + 1
        t = np.linspace(0, 1, 11)
        linear = (1 - t)[:, None, None] * keys.linear[0] + t[:, None, None] * keys.linear[1]
        np.testing.assert_allclose(motion(t).linear, linear, atol=1e-12)


@pytest.mark.parametrize("ends", ["natural", "not-a-knot", "clamped", "periodic"])
def test_ends_of_the_start(ends):
    keys, rates = KEYS, None
    if ends == "periodic":
        keys = KEYS.moved(-1, KEYS.linear[0], KEYS.translation[0])
    if ends == "clamped":
        rates = sm.Affine(np.zeros((2, 3, 3)), np.ones((2, 3)))
    motion = start_motion(sm.affine_program(keys, ends=ends, end_rates=rates))
    a, b = motion.domain
    if ends == "natural":
        assert np.abs(motion([a, b], 2).linear).max() < 1e-9
    if ends == "clamped":
        np.testing.assert_allclose(motion([a, b], 1).translation, 1.0, atol=1e-9)
    if ends == "periodic":
        for nu in range(3):
            np.testing.assert_allclose(motion(a, nu).linear, motion(b, nu).linear, atol=1e-9)
    if ends == "not-a-knot":
        inner = KEYS.times[1]
        jump = motion(inner + 1e-9, 3).linear - motion(inner - 1e-9, 3).linear
        assert np.abs(jump).max() < 1e-8


def test_translation_that_the_objective_does_not_see_keeps_its_spline():
    solution = sm.ExactNewton().solve(sm.affine_program(KEYS)).require()
    a, b = solution.motion.domain
    t = np.linspace(a, b, 50)
    spline = sm.splines.cubic_interpolant(KEYS.times, KEYS.translation)
    np.testing.assert_allclose(solution.motion(t).translation, spline(t), atol=1e-12)


def test_energy_alone_recovers_the_natural_spline():
    """The cubic interpolant of least ∫ ‖ẍ‖² is the natural one, for every body point."""
    points = np.concatenate([np.zeros((1, 3)), np.eye(3)])
    program = sm.affine_program(KEYS, objective=sm.TrajectoryEnergy(points), ends="not-a-knot")
    solution = sm.ExactNewton().solve(program).require()
    natural = start_motion(sm.affine_program(KEYS))
    t = np.linspace(*natural.domain, 101)
    np.testing.assert_allclose(solution.motion(t).linear, natural(t).linear, atol=1e-10)


def test_more_knots_never_cost_more():
    values, motion = [], None
    for refine in (1, 3, 7):
        program = sm.affine_program(KEYS, refine=refine)
        solution = sm.ExactNewton().solve(program, start=motion).require()
        motion = solution.motion
        values.append(solution.objective)
    assert values[0] > values[1] > values[2]


def test_given_knots_and_stages():
    program = sm.affine_program(KEYS, knots=np.sort(np.r_[KEYS.times[1:-1], 0.1, 0.2]))
    assert program.start["controls"].shape[0] == len(KEYS) + 2 + 2
    assert [p.start["controls"].shape[0] for p in sm.affine_program(KEYS, degree=4).design.stages("degree")] == [
        7,
        8,
        9,
    ]
    assert [p.start["controls"].shape[0] for p in sm.affine_program(KEYS, refine=3).design.stages("knots")] == [8, 10]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sm.affine_program(KEYS, degree=0), "degree 0"),
        (lambda: sm.affine_program(KEYS, degree=cast(Any, 2.5)), r"degree 2\.5"),
        (lambda: sm.affine_program(KEYS, refine=-1), "refine -1"),
        (lambda: sm.affine_program(KEYS, objective=cast(Any, "R")), "'R' is no energy"),
        (lambda: sm.affine_program(KEYS[:3], ends="not-a-knot"), "3 keyframes are too few for not-a-knot"),
        (lambda: sm.affine_program(KEYS, ends="open"), "'open' is unknown"),
        (lambda: sm.affine_program(KEYS, ends="periodic"), "last keyframe equal to the first"),
        (lambda: sm.affine_program(KEYS, degree=1, knots=[]), r"keyframes 0 to 2 .* are more conditions"),
        (lambda: sm.affine_program(KEYS, knots=[2.0]), "knots"),
        (lambda: sm.affine_program(KEYS).with_keyframes(sm.examples.planar_keyframes()), "2D for a program in 3D"),
        (lambda: sm.affine_program(KEYS).with_keyframes(KEYS.with_times("uniform")), "keeps the times"),
        (lambda: list(sm.affine_program(KEYS).design.stages("time")), "there are degree, knots"),
    ],
)
def test_bad_input_names_the_culprit(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()


@pytest.mark.parametrize("program", [sm.affine_program, sm.free_times_program])
@pytest.mark.parametrize("energy", [sm.StrainRate(), 0.1 * sm.StrainAcceleration() + sm.Rigidity()], ids=["S", "S*"])
def test_keyframes_of_both_orientations_are_named_where_the_energy_divides_by_the_volume(program, energy):
    keys = sm.Keyframes([0, 1.0, 2.0], [np.eye(2), np.diag([-1.0, 1.0]), np.eye(2)], np.zeros((3, 2)))
    with pytest.raises(sm.InputError, match=r"^keyframe 1 has determinant -1 .* where S\*? is infinite"):
        program(keys, objective=energy)
    program(keys, objective=sm.Rigidity())  # which does not


@pytest.mark.parametrize("count", [10**7, 10**12, 10**400])
def test_counts_that_no_memory_holds_are_refused_where_they_are_given(count):
    keys, turns = sm.examples.planar_keyframes(), sm.examples.random_keyframes(4, 50, seed=1)
    doors: list[Any] = [
        lambda **more: sm.affine_program(keys, **more),
        lambda **more: sm.orientation_program(turns.times, turns.rotations(), **more),
        lambda **more: sm.pose_program(turns, **more),
    ]
    for door in doors:
        for name in ("refine", "degree"):
            with pytest.raises(sm.InputError, match=f"{name} 1"):
                door(**{name: count})
