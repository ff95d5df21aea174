"""Quadrature: right values are closed forms, errors are told, and what has no integral is refused by name."""

import pickle
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad

import symmotion as sm
from symmotion.motions.interpolants import polar_blend
from symmotion.splines import BSplineBasis, integrate

KEYS = sm.examples.random_keyframes(3, 50, 3)


def squeezed(least):
    """A plane that is squeezed to `least` of its width and back: det A = least + (1 − least) (2t − 1)²."""
    linear = np.tile(np.eye(2), (3, 1, 1))
    linear[1, 0, 0] = 2 * least - 1
    return sm.AffineMotion(BSplineBasis.clamped([0.0, 1.0], 2), linear)


@pytest.mark.parametrize("least", [0.1, 0.03, 0.01, 1e-4])
def test_strain_of_a_motion_that_is_nearly_singular_has_ten_digits(least):
    rest = 1 - least
    right = 32 * rest * (np.arctan(np.sqrt(rest / least)) / np.sqrt(least * rest) - 1)
    value = sm.measure(squeezed(least), sm.StrainRate())
    assert value == pytest.approx(right, rel=1e-10)
    assert abs(value - right) <= value.error + 1e-12 * right < 1e-9 * right
    assert pickle.loads(pickle.dumps(value)).error == value.error


@pytest.mark.parametrize("least", [0.0, -0.1])
def test_strain_of_a_singular_motion_is_refused_with_its_times(least):
    with pytest.raises(sm.InputError, match=r"S has no value between times 0 and 1: at time 0.*A is singular"):
        sm.measure(squeezed(least), sm.StrainRate())


def test_curves_of_quaternions_that_are_no_splines_are_measured_by_their_rates():
    """Of a slerp the rate is the angle of a step, all the way; of a squad the torque is what SciPy integrates."""
    angles = (KEYS.rotations()[:-1].inv() * KEYS.rotations()[1:]).magnitude()
    turning = sm.JetEnergy(lambda jet: jet.rate, squares=True)
    assert sm.measure(sm.interpolants.slerp_curve(KEYS), turning) == pytest.approx((angles**2).sum(), rel=1e-10)
    squad = sm.interpolants.squad(KEYS)
    spans = [quad(lambda t: float((squad.jet(t).acceleration ** 2).sum()), a, a + 1, epsabs=1e-10)[0] for a in (0, 1)]
    assert sm.measure(squad, sm.Torque()) == pytest.approx(sum(spans), rel=1e-8)


def test_the_digits_of_what_is_too_rough_are_told():
    line = sm.curves.bezier([[0.0], [1.0]])
    rough = sm.JetEnergy(lambda jet: 1 + 1e-3 * ca.sin(1e7 * jet.x[0]))
    with pytest.raises(sm.SolveError, match=r"custom is .* digits only"):
        sm.measure(line, rough)


def test_a_certificate_refuses_a_term_of_which_no_digit_is_known():
    keys = sm.Keyframes([0.0, 1.0], np.tile(np.eye(2), (2, 1, 1)), np.zeros((2, 2)))
    program = sm.affine_program(keys, objective=sm.StrainRate(), degree=2, refine=0)
    x = program.x0.reshape(3, -1).copy()
    x[1, 0] = -1.2  # det A vanishes on the way
    certificate = sm.certify(program, x.ravel(), np.zeros(program.conditions))
    assert not certificate.holds(1e10)
    assert "between keyframes 0 and 1" in certificate.wanting(1e10)
    assert "where A is singular" in certificate.wanting(1e10)


def test_nodes_mean_the_same_for_quaternion_curves():
    def nodes(energy):
        program = sm.orientation_program(KEYS, objective=energy)
        return program.terms[0].count // (len(program.design.space.breakpoints) - 1)

    written = sm.Torque().residuals
    assert nodes(sm.JetEnergy(written, squares=True, gauss_nodes=3)) == 3
    assert nodes(sm.JetEnergy(written, squares=True)) > 6  # as many as ten digits need


def test_a_solution_tells_its_quadrature_error_and_more_nodes_mend_it():
    energy = sm.JetEnergy(lambda jet: jet.acceleration, squares=True, gauss_nodes=3, label="coarse")
    coarse = sm.ExactNewton().solve(sm.orientation_program(KEYS, objective=energy)).require()
    off = abs(coarse.objective - sm.measure(coarse.motion, energy))
    assert coarse.quadrature_error == pytest.approx(off, rel=1e-3)
    assert off > 1e-10 * coarse.objective
    digits = int(-np.log10(off / coarse.objective))
    assert 0 < digits == coarse.certificate.digits < 10
    assert f"(quadrature: {digits} digits)" in repr(coarse)
    assert f"({digits} digits)" in repr(coarse.certificate)
    assert f"the objective has {digits} digits, not ten: program.refined(solution.x)" in coarse.message
    fine = sm.ExactNewton().solve(sm.orientation_program(KEYS, objective=replace(energy, gauss_nodes=None)))
    refined = fine.program.refined(fine.x)
    again = sm.ExactNewton().solve(refined, start=fine).require()
    assert again.quadrature_error < 1e-9 * again.objective
    assert again.objective == pytest.approx(sm.measure(again.motion, energy), rel=1e-9)
    assert "quadrature:" not in repr(again)
    assert not again.message


RIGID = sm.examples.random_keyframes(4, 150, 3)
POSE = sm.Torque() + sm.TrajectoryEnergy(np.eye(3))
THIN = sm.Keyframes([0.0, 1.0, 2.0], [np.eye(2), np.diag([1.0, 1e-6]), np.eye(2)], np.zeros((3, 2)))


@pytest.mark.parametrize(
    ("program", "energy"),
    [
        (lambda: sm.orientation_program(RIGID, objective=sm.Torque((1.0, 2.0, 2.5))), sm.Torque((1.0, 2.0, 2.5))),
        (lambda: sm.pose_program(RIGID, objective=POSE), POSE),
        (lambda: sm.affine_program(THIN, objective=sm.StrainAcceleration()), sm.StrainAcceleration()),
        (lambda: sm.affine_program(RIGID, objective=sm.StrainRate()), sm.StrainRate()),
        (lambda: sm.affine_program(RIGID, objective=sm.StrainAcceleration()), sm.StrainAcceleration()),
    ],
    ids=["torque", "pose", "thin", "S", "S*"],
)
def test_an_objective_has_ten_digits_or_says_how_many(program, energy):
    solution = sm.ExactNewton().solve(program()).require()
    right = sm.measure(solution.motion, energy)
    digits = solution.certificate.digits
    assert abs(solution.objective - right) <= 10.0**-digits * right
    assert ("digits, not ten" in solution.message) == ("± " in repr(solution)) == (digits < 10)
    if digits < 10:
        assert abs(solution.objective - right) > 1e-11 * right


@pytest.mark.parametrize("energy", [sm.StrainRate(), sm.StrainAcceleration()])
def test_a_motion_that_costs_nothing_has_no_digits_to_lose(energy):
    still = sm.Keyframes(np.arange(4.0), np.tile(np.eye(3), (4, 1, 1)), np.arange(12.0).reshape(4, 3))
    solution = sm.ExactNewton().solve(sm.affine_program(still, objective=energy)).require()
    assert 0 <= solution.objective <= solution.certificate.rounding < 1e-25
    assert not solution.message


def test_what_is_exact_has_no_quadrature_error():
    solution = sm.ExactNewton().solve(sm.affine_program(sm.examples.planar_keyframes()))
    assert solution.quadrature_error == 0
    assert "quadrature" not in repr(solution)


@pytest.mark.parametrize("energy", [sm.Rigidity(), sm.Rigidity(2)])
def test_a_rigid_motion_is_rigid_up_to_rounding_and_not_looked_at_for_long(energy):
    motion = polar_blend(sm.examples.random_keyframes(5, 70, 2), rotation="slerp")
    asked = []

    def series(t, order):
        asked.append(len(t))
        return motion.series(t, order)

    value = sm.measure(replace(motion, series=series), energy)
    # What is known of it is that it is no more than rounding: 2e5 evaluations would not tell more.
    assert 0 <= value < 1e-25
    assert value.error > 0.1 * value
    assert sum(asked) < 5_000


def test_noise_is_told_and_not_halved_without_end():
    rng, asked = np.random.default_rng(0), []

    def noisy(t):
        asked.append(len(t))
        return t**4 * rng.normal(size=t.shape) ** 2

    found = integrate(noisy, np.array([0.0, 1.0]), np.array([1.0, 2.0]))
    assert abs(found.value - 6.4) < found.error
    assert sum(asked) < 5_000
