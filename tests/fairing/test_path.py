from typing import Any

import numpy as np
import pytest

import symmotion as sm
from symmotion.fairing import FairingStatus, Jumps, fair, fairing_path
from symmotion.motions import PoseMotion, noisy_net, smooth_net
from symmotion.motions.quaternions import QuaternionMotion, product
from symmotion.splines import BSplineBasis, Spline

SMOOTH = smooth_net(12)
ROW, COLUMN = np.indices((12, 12))
HALF = 0.5 * np.deg2rad(3.0) * np.sin(np.pi / 3 * ROW) * np.sin(np.pi / 3 * COLUMN)
RIPPLES = np.stack([np.cos(HALF), 0 * HALF, 0 * HALF, np.sin(HALF)], axis=-1)
TRUTH = SMOOTH.with_controls(product(SMOOTH.real, RIPPLES), None)
SIGMA = 0.01
NOISY = noisy_net(TRUTH, SIGMA, seed=2)
loose: Any = fair


def test_the_path_is_that_of_single_solves():
    path = fairing_path(NOISY)
    assert (np.diff(path.fairness) > 0).all()
    assert (np.diff(path.displacement) < 0).all()
    for weight in (0.003, 0.2, 7.0):
        r = fair(NOISY, "least-squares", weight=weight)
        g, d = path.at(weight)
        assert g == pytest.approx(r.final, rel=5e-3)
        assert d == pytest.approx(np.sum(r.displacement**2), rel=3e-3)
    h = 1e-4
    d = [np.sum(fair(NOISY, "least-squares", weight=w).displacement ** 2) for w in (1 + h, 1 - h)]
    one = fairing_path(NOISY, weights=[0.5, 1.0, 2.0])
    assert one.slopes[1] == pytest.approx((d[0] - d[1]) / (2 * h), rel=1e-5)


def test_the_discrepancy_moves_as_far_as_the_noise():
    count = 4 * 100
    r = fair(NOISY, noise=SIGMA)
    assert r.method == "least-squares"
    assert np.sum(r.displacement**2) == pytest.approx(count * SIGMA**2, rel=3e-3)
    assert fairing_path(NOISY).discrepancy(SIGMA) == pytest.approx(r.weight, rel=0.02)

    def error(motion):
        return np.linalg.norm(motion.real - TRUTH.real)

    assert error(r.motion) < 0.75 * error(NOISY)
    # Fairer than that is too fair here: the truth has ripples.
    assert error(fair(NOISY, "least-squares", weight=1e-4).motion) > 1.2 * error(r.motion)


def test_the_corner_is_where_solves_for_many_weights_are_bent_most():
    w = np.linspace(np.log(1e-5), np.log(1e3), 80)
    solved = [fair(NOISY, "least-squares", weight=float(x)) for x in np.exp(w)]
    x = np.gradient(np.log([np.sum(r.displacement**2) for r in solved]), w)
    y = np.gradient(np.log([r.final for r in solved]), w)
    turn = (x * np.gradient(y, w) - y * np.gradient(x, w)) / (x * x + y * y) ** 1.5
    turn[np.abs(x) < 1e-2] = 0.0
    corner = fairing_path(NOISY, count=33).corner()
    assert np.log(corner) == pytest.approx(w[1:-1][np.argmin(turn[1:-1])], abs=0.7)
    faired = fair(NOISY, "least-squares", weight=corner)
    assert np.linalg.norm(faired.motion.real - TRUTH.real) < 0.8 * np.linalg.norm(NOISY.real - TRUTH.real)


def test_noise_of_each_part_is_a_metric():
    net = noisy_net(smooth_net(9, spatial=True), 0.01, translation=0.1, seed=1)
    r = fair(net, noise=(0.01, 0.1), parts="real+translation")
    before, after = net.control_displacements, r.motion.control_displacements
    turned = np.sum((after.real - before.real) ** 2)
    moved = np.sum((after.translation - before.translation) ** 2)
    assert turned / 0.01**2 + moved / 0.1**2 <= 49 * 7 * 1.01


def test_the_papers_stop_rule_fires_where_a_step_changes_little():
    r = fair(NOISY, change=1e-3)
    assert r.status == FairingStatus.STALLED
    changes = np.abs(np.diff(r.history))
    assert changes[-1] < 1e-3 <= changes[:-1].min()
    assert fair(NOISY, change=1e-3, form="program", max_steps=5).history == pytest.approx(r.history[:6], rel=1e-9)


def test_forbidden_steps_are_hardly_tried_again():
    """What is known to be forbidden is left out until that changes: few tries that fail for every step that is made."""
    net = noisy_net(smooth_net(14), 0.02, seed=1, ring=True)
    r = fair(net, tolerance=0.03, max_steps=3000)
    assert r.steps == 3000
    assert r.discarded < r.steps
    assert r.displacement.max() <= 0.03 * (1 + 1e-12)


@pytest.mark.parametrize("step", ["greedy", "orthogonal"])
def test_forbidden_steps_under_conditions_are_hardly_tried_again_either(step):
    net = noisy_net(smooth_net(14), 0.02, seed=1, ring=True)
    keys = [((6.0, 7.0), net(6.0, 7.0)), ((9.5, 4.2), net(9.5, 4.2))]
    conditions: list[dict[str, Any]] = [{"keyframes": keys}, {"weights": np.linspace(1, 2, 14 * 14).reshape(14, 14)}]
    for given in conditions:
        r = fair(net, step, tolerance=0.03, max_steps=1000, **given)
        assert r.steps == 1000 and r.discarded < r.steps
        assert r.displacement.max() <= 0.03 * (1 + 1e-12)


def test_steps_within_tolerances_end_where_they_lead_to_nothing_better():
    net = noisy_net(smooth_net(14), 0.02, seed=1, ring=True)
    r = fair(net, tolerance=0.03)
    assert r.status == FairingStatus.MINIMUM and r.steps == r.best_step + 20 * 100 + 1
    longer = fair(net, tolerance=0.03, max_steps=r.best_step + 100)
    assert longer.final == r.final and longer.status == FairingStatus.CAP


BASIS = BSplineBasis(np.arange(24.0), 3)
RNG = np.random.default_rng(7)
TURNS = np.stack([np.cos(np.linspace(0, 1, 20)), np.sin(np.linspace(0, 1, 20)), np.zeros(20), np.zeros(20)], axis=-1)
CONTROLS = TURNS + 0.01 * RNG.normal(size=(20, 4))
SHAKY = QuaternionMotion(BASIS, CONTROLS / np.linalg.norm(CONTROLS, axis=1, keepdims=True))


def jerk_jumps(motion):
    knots = motion.basis.knots[4 : motion.basis.n]
    return np.linalg.norm(motion.jerk(knots + 1e-9) - motion.jerk(knots - 1e-9), axis=1)


@pytest.mark.parametrize("method", ["greedy", "orthogonal", "least-squares", "bounded"])
def test_quaternion_curves_and_poses_are_faired_through_their_polygons(method):
    options = {"bounded": {"tolerance": 0.03}, "least-squares": {"weight": 0.1}}.get(method, {"max_steps": 30})
    r = loose(SHAKY, method, **options)
    assert isinstance(r.motion, QuaternionMotion)
    np.testing.assert_allclose(np.linalg.norm(r.motion.control_points, axis=1), 1, atol=1e-14)
    assert r.final < 0.5 * r.initial
    assert np.linalg.norm(jerk_jumps(r.motion)) < np.linalg.norm(jerk_jumps(SHAKY))
    assert r.final == pytest.approx(Jumps.of((BASIS,)).fairness(r.motion.control_points[:, None]).sum())
    places = Spline(BASIS, np.linspace(0, 1, 20)[:, None] * [1, 2, 3] + 0.05 * RNG.normal(size=(20, 3)))
    pose = loose(PoseMotion(SHAKY, places), method, **options)
    assert isinstance(pose.motion, PoseMotion)
    assert pose.final < pose.initial
    only = loose(PoseMotion(SHAKY, places), method, parts="translation", **options)
    assert only.motion.orientation == SHAKY


def test_the_target_of_a_curve_is_met_by_unit_quaternions():
    r = fair(SHAKY, "least-squares", target=1e-4)
    assert r.final <= 1e-4
    assert r.status == FairingStatus.TARGET


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: loose(NOISY, noise=0.0), "noise 0.0: a positive number is needed"),
        (lambda: loose(NOISY, noise=0.1, weight=1.0), "noise chooses the weight"),
        (lambda: loose(NOISY, "greedy", noise=0.1), "noise goes with least-squares"),
        (lambda: loose(NOISY, noise=(0.1, 0.2)), "noise .*: a positive number is needed"),
        (lambda: loose(NOISY, noise=0.1, metric=np.eye(4)), "noise and metric"),
        (lambda: loose(NOISY, "least-squares", change=0.1), "change goes with greedy and orthogonal"),
        (lambda: fairing_path(NOISY, weights=[1.0, 1.0, 2.0]), "weights: number 1"),
        (lambda: fairing_path(NOISY).at(1e9), "weight 1000000000.0: within"),
        (lambda: fairing_path(NOISY).discrepancy(1e-9), "all nets of the path move"),
        (lambda: loose(SHAKY, keyframes=[(5.0, SMOOTH(4.0, 4.0))]), "not linear in its controls"),
        (lambda: loose(SHAKY, parts="dual"), "a spherical motion has real parts only"),
        (
            lambda: loose(PoseMotion(SHAKY, Spline(BSplineBasis.clamped([3.0, 8, 20], 3), np.zeros((5, 3))))),
            "orientation and translation have other knots",
        ),
    ],
)
def test_bad_input_is_named(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()
