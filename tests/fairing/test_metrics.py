from typing import Any

import numpy as np
import pytest

import symmotion as sm
from symmotion.fairing import Jumps, fair, fairing_program
from symmotion.motions import DualQuaternions, noisy_net, smooth_net

SPHERICAL = noisy_net(smooth_net(10, 9), 0.018, seed=0)
SPATIAL = noisy_net(smooth_net(9, 8, spatial=True), 0.02, translation=0.05, seed=1)
RNG = np.random.default_rng(5)
loose: Any = fair


def random_form(c, count=()):
    a = RNG.normal(size=(*count, c, c))
    return a @ np.swapaxes(a, -1, -2) + 0.5 * np.eye(c)


FORMS = {
    "weights": {"weights": RNG.uniform(0.5, 3.0, size=(10, 9))},
    "form": {"metric": random_form(4)},
    "both": {"weights": RNG.uniform(0.5, 3.0, size=(10, 9)), "metric": random_form(4)},
    "each": {"metric": random_form(4, (10, 9))},
}


@pytest.mark.parametrize("given", FORMS.values(), ids=FORMS)
def test_least_squares_in_any_metric_are_their_minimum_and_program(given):
    r = fair(SPHERICAL, "least-squares", weight=0.4, **given)
    jumps, start, net = Jumps.of(SPHERICAL.bases), SPHERICAL.real, r.motion.real
    forms = given.get("metric", np.eye(4)) * given.get("weights", np.ones((10, 9)))[..., None, None]

    forms = np.broadcast_to(forms, (10, 9, 4, 4))
    pull = np.einsum("ijab,ijb->ija", forms, net - start)
    objective = jumps.fairness(net).sum() + 0.4 * np.sum((net - start) * pull)
    gradient = 2 * jumps.spread(jumps.at(net)) + 0.8 * pull
    assert np.abs(gradient[1:-1, 1:-1]).max() < 1e-10
    program = fairing_program(SPHERICAL, weight=0.4, **given)
    solution: Any = sm.ExactNewton().solve(program).require(1e-8)
    np.testing.assert_allclose(solution.motion.real, net, atol=1e-10)
    assert solution.objective == pytest.approx(objective, rel=1e-9)


@pytest.mark.parametrize("given", FORMS.values(), ids=FORMS)
@pytest.mark.parametrize("step", ["greedy", "orthogonal"])
def test_local_steps_in_a_metric_are_programs(step, given):
    options = {"max_steps": 6, "divergence": 1e9, **given}
    closed, program = (loose(SPHERICAL, step, form=form, **options) for form in ("closed", "program"))
    np.testing.assert_allclose(program.history, closed.history, rtol=1e-9)
    np.testing.assert_allclose(program.motion.real, closed.motion.real, atol=1e-12)
    np.testing.assert_allclose(program.multipliers["jumps"], closed.multipliers["jumps"], atol=1e-10)


@pytest.mark.parametrize("step", ["greedy", "orthogonal"])
def test_the_identity_and_any_form_that_all_controls_share_give_the_papers_steps(step):
    plain = loose(SPHERICAL, step, max_steps=60)
    ones = loose(SPHERICAL, step, max_steps=60, metric=np.eye(4), weights=np.full((10, 9), 2.0))
    np.testing.assert_array_equal(ones.motion.real, plain.motion.real)
    form = loose(SPHERICAL, step, max_steps=60, metric=random_form(4))
    np.testing.assert_array_equal(form.motion.real, plain.motion.real)


METHODS = {"greedy": {"max_steps": 50}, "orthogonal": {"max_steps": 50}, "least-squares": {"weight": 0.5}}


@pytest.mark.parametrize("method", METHODS)
def test_turning_either_frame_turns_what_comes_out(method):
    fixed, moving = (DualQuaternions.from_axis_angle(RNG.normal(size=3), a) for a in (1.1, -0.7))
    for net in (SPHERICAL, SPATIAL):
        one = loose(net, method, **METHODS[method]).motion.seen_from(fixed, moving)
        other = loose(net.seen_from(fixed, moving), method, **METHODS[method]).motion
        np.testing.assert_allclose(other.real, one.real, atol=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_one_factor_of_all_quaternions_changes_nothing_but_the_size_of_g(method):
    scaled = SPATIAL.with_controls(3.0 * SPATIAL.real, 3.0 * SPATIAL.control_displacements.dual)
    one, other = (loose(net, method, **METHODS[method]) for net in (SPATIAL, scaled))
    np.testing.assert_allclose(other.motion.real, 3 * one.motion.real, atol=1e-12)
    assert other.final == pytest.approx(9 * one.final, rel=1e-9)


def test_moving_the_origin_is_another_metric():
    """Q⁰ ↦ Q⁰ + ½ f Q is linear: steps and least squares commute with it, but not the choice of a knot or weight."""
    shift = DualQuaternions.from_parts([1.0, 0, 0, 0], [3.0, -1.0, 0.5])
    moved = SPATIAL.seen_from(shift)
    for method, options in (
        ("least-squares", {"weight": 0.5}),
        ("orthogonal", {"max_steps": 1, "divergence": 1e9, "region": ((5.0, 5.0), (4.0, 4.0))}),
    ):
        one = loose(SPATIAL, method, **options).motion.seen_from(shift)
        np.testing.assert_allclose(loose(moved, method, **options).motion.dual, one.dual, atol=1e-12)
    for method, options in (("least-squares", {"target": 0.1}), ("greedy", {"max_steps": 30})):
        one = loose(SPATIAL, method, **options).motion.seen_from(shift)
        assert np.abs(loose(moved, method, **options).motion.dual - one.dual).max() > 1e-6


def test_length_is_a_metric():
    """G and displacements in units of a length: the dual part weighs 1/length², in both."""
    a = loose(SPATIAL, "least-squares", weight=0.5, parts="real+dual", length=2.0)
    b = loose(SPATIAL, "least-squares", weight=0.5, parts="real+dual", length=1.0)
    np.testing.assert_allclose(a.motion.dual, b.motion.dual, atol=1e-12)
    c = loose(SPATIAL, "least-squares", weight=0.5, metric=np.diag([1.0] * 4 + [4.0] * 4))
    assert np.abs(c.motion.dual - b.motion.dual).max() > 1e-5


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"weights": np.ones(3)}, r"weights of shape \(3,\): positive numbers \(10, 9\)"),
        ({"weights": np.zeros((10, 9))}, "weights of shape"),
        ({"metric": np.eye(3)}, r"metric of shape \(3, 3\): \(4, 4\)"),
        ({"metric": np.diag([1.0, 1, 1, -1])}, "metric is not positive definite"),
        ({"metric": np.triu(np.ones((4, 4)))}, "metric is not symmetric"),
        (
            {"metric": np.where(np.arange(10)[:, None, None, None] == 3, 0.0, np.eye(4)) * np.ones((10, 9, 1, 1))},
            r"metric of control \(3, 0\) is not positive definite",
        ),
    ],
)
def test_bad_metrics_are_named(given, message):
    with pytest.raises(sm.InputError, match=message):
        loose(SPHERICAL, "least-squares", **given)
