from typing import Any

import numpy as np
import pytest
from nets import keyframes_near, missed

import symmotion as sm
from symmotion.fairing import Coordinates, Jumps, NetKeyframe, NetPlace, fair, fairing_program
from symmotion.motions import Affine, DualQuaternions, RationalMotion, noisy_net, smooth_net

SPHERICAL = noisy_net(smooth_net(11, 10), 0.018, seed=0)
# Nets of few controls, their tolerances and numbers of keyframes.
FEW = {
    "spherical": (noisy_net(smooth_net(7, 7), 0.018, seed=0), 0.04, 3),
    "spatial": (noisy_net(smooth_net(7, 7, spatial=True), 0.02, translation=0.05, seed=4), 0.03, 3),
    "clamped": (noisy_net(smooth_net(7, 8, knots="clamped"), 0.02, seed=2), 0.1, 2),
}
SMALL = noisy_net(smooth_net(8, 7, spatial=True), 0.02, translation=0.05, seed=4)
SPATIAL = noisy_net(smooth_net(10, 9, spatial=True), 0.02, translation=0.05, seed=1)
CLAMPED = noisy_net(smooth_net(9, 11, knots="clamped"), 0.02, seed=2)
NETS = {"spherical": SPHERICAL, "spatial": SPATIAL, "clamped": CLAMPED}
loose: Any = fair
METHODS: dict[str, dict[str, Any]] = {
    "greedy": {"max_steps": 40},
    "orthogonal": {"max_steps": 40},
    "least-squares": {"weight": 0.5},
    "bounded": {},
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("kind", NETS)
def test_keyframes_are_kept_by_every_method(kind, method):
    net, options, count = NETS[kind], METHODS[method], 3
    if method == "bounded":
        net, options["tolerance"], count = FEW[kind]
    keys = keyframes_near(net, count)
    r = loose(net, method, keyframes=keys, **options)
    assert missed(r.motion, keys) < 1e-12 * 10
    assert r.final < r.history[0]
    free = fair(net, "least-squares", weight=0.5)
    assert missed(free.motion, keys) > 1e-3
    assert (r.keyframe_weights > 0.8).all()


@pytest.mark.parametrize("step", ["greedy", "orthogonal"])
def test_every_local_step_keeps_the_keyframes(step):
    keys = keyframes_near(SPATIAL, 3, seed=3)
    for steps in (0, 1, 2, 12):
        assert missed(fair(SPATIAL, step, keyframes=keys, max_steps=steps, divergence=1e9).motion, keys) < 1e-11


@pytest.mark.parametrize("step", ["greedy", "orthogonal"])
def test_steps_with_keyframes_are_the_programs_of_symbols(step):
    keys = keyframes_near(SPHERICAL, 3, seed=5)
    options = {"keyframes": keys, "max_steps": 4, "divergence": 1e9, "metric": np.diag([1.0, 2.0, 3.0, 4.0])}
    closed, program = (loose(SPHERICAL, step, form=form, **options) for form in ("closed", "program"))
    np.testing.assert_allclose(program.history, closed.history, rtol=1e-8)
    np.testing.assert_allclose(program.motion.real, closed.motion.real, atol=1e-11)
    np.testing.assert_allclose(program.multipliers["keyframes"], closed.multipliers["keyframes"], atol=1e-9)
    assert program.certificate.inertia == "positive"


def test_a_step_is_the_nearest_net_without_jumps_that_keeps_the_keyframes():
    """Against the same question written down densely, control by control."""
    keys = keyframes_near(SPHERICAL, 2, seed=8)
    start = fair(SPHERICAL, "orthogonal", keyframes=keys, max_steps=0)
    one = fair(SPHERICAL, "orthogonal", keyframes=keys, max_steps=1, divergence=1e9)
    jumps, net = Jumps.of(SPHERICAL.bases), start.motion.real
    k, l = np.unravel_index(int(jumps.fairness(net).argmax()), jumps.shape)  # noqa: E741
    n, m, c = net.shape
    third = (np.outer(jumps.u.jumps[k], jumps.v.values[l]), np.outer(jumps.u.values[k], jumps.v.jumps[l]))
    rows = [np.einsum("p,ab->apb", row.ravel(), np.eye(c)).reshape(c, -1) for row in third]
    for (u, v), displacement in keys:
        q = DualQuaternions.from_matrices(displacement.linear).real
        row = np.outer(SPHERICAL.u(u)[0], SPHERICAL.v(v)[0]).ravel()
        rows.append(np.einsum("p,ab->apb", row, np.eye(4) - np.outer(q, q)).reshape(4, -1))
    system = np.concatenate(rows)
    moved = np.zeros((n, m))
    moved[k : k + 5, l + 1 : l + 4] = moved[k + 1 : k + 4, l : l + 5] = 1
    moved[[0, -1]] = moved[:, [0, -1]] = 0
    free = np.repeat(moved.ravel() > 0, c)
    wanted = np.concatenate([-jumps.at(net)[k, l].ravel(), np.zeros(len(system) - 2 * c)])
    least = np.linalg.lstsq(system[:, free], wanted, rcond=1e-11)[0]
    expected = net.copy().ravel()
    expected[free] += least
    if one.best_step == 1:
        np.testing.assert_allclose(one.motion.real.ravel(), expected, atol=1e-12)
    after = jumps.fairness(expected.reshape(net.shape)).sum()
    assert one.history[1] == pytest.approx(after, rel=1e-9)


def test_the_least_squares_are_the_program_whoever_solves_it():
    keys = [*keyframes_near(SMALL, 2), NetPlace((4.3, 5.1), np.array([1.0, 2.0, 0.5]), np.array([0.5, 1.5, 1.0]))]
    for net, given in ((SMALL, keys), (SPHERICAL, keyframes_near(SPHERICAL, 3))):
        closed = fair(net, "least-squares", weight=0.7, keyframes=given)
        program = fairing_program(net, weight=0.7, keyframes=given)
        for solver in (sm.ExactNewton(), sm.Ipopt()):
            solution: Any = solver.solve(program).require(1e-7)
            np.testing.assert_allclose(solution.motion.real, closed.motion.real, atol=1e-9)
            np.testing.assert_allclose(solution.multipliers["keyframes"], closed.multipliers["keyframes"], atol=1e-7)


@pytest.mark.parametrize("weight", [None, 1.1])
@pytest.mark.parametrize("net", [SPHERICAL, SPATIAL], ids=["spherical", "spatial"])
def test_the_price_of_a_keyframe_is_what_solving_again_shows(net, weight):
    """With D* + η in place of D* the optimum changes by −κ λ · η, κ the weight that the keyframe is met with."""
    at = keyframes_near(net, 3)
    pairs = [(p, DualQuaternions.from_matrices(k.linear, k.translation)) for p, k in at]
    if pairs[1][1].real @ net.real[4, 4] < 0:
        pairs[1] = pairs[1][0], DualQuaternions(-pairs[1][1].real, -pairs[1][1].dual)

    def solved(change):
        moved = pairs[1][1]
        if change is not None:
            turn = DualQuaternions.from_axis_angle([0.3, -0.5, 0.8], change, None if net.spherical else [change, 0, 0])
            moved = turn @ moved
        given = [NetKeyframe(p, k, weight) for p, k in (pairs[0], (pairs[1][0], moved), pairs[2])]
        r = fair(net, "least-squares", weight=0.4, keyframes=given)
        moves = r.motion.control_displacements
        start = net.control_displacements
        far = np.sum((moves.real - start.real) ** 2) + np.sum((moves.dual - start.dual) ** 2)
        return r, r.final + 0.4 * far, moved

    h = 1e-5
    r, _, _ = solved(None)
    (_, above, one), (_, below, other) = solved(h), solved(-h)
    eta = np.concatenate([one.real - other.real, one.dual - other.dual])[: r.multipliers["keyframes"].shape[1]] / (
        2 * h
    )
    expected = -r.keyframe_weights[1] * r.multipliers["keyframes"][1] @ eta
    assert (above - below) / (2 * h) == pytest.approx(expected, rel=1e-5)
    assert abs(expected) > 1e-6


def test_projective_keyframes_cost_no_more_than_ones_with_weights():
    keys = keyframes_near(SPATIAL, 5, seed=4)
    free = fair(SPATIAL, "least-squares", weight=1.0, keyframes=keys)
    given = [NetKeyframe(at, k, weight=1.0) for at, k in keys]
    strict = fair(SPATIAL, "least-squares", weight=1.0, keyframes=given)
    np.testing.assert_allclose(strict.keyframe_weights, 1.0, atol=1e-12)
    assert missed(strict.motion, keys) < 1e-12 * 10

    def cost(r):
        return r.final + np.sum(r.displacement**2)

    assert cost(free) < cost(strict)
    chosen = [NetKeyframe(at, k, w) for (at, k), w in zip(keys, free.keyframe_weights, strict=True)]
    same = fair(SPATIAL, "least-squares", weight=1.0, keyframes=chosen)
    np.testing.assert_allclose(same.motion.real, free.motion.real, atol=1e-11)


@pytest.mark.parametrize("parts", ["real", "dual", "translation"])
@pytest.mark.parametrize("method", ["greedy", "least-squares"])
def test_keyframes_of_single_parts_of_a_spatial_motion(parts, method):
    keys = keyframes_near(SPATIAL, 3, seed=6)
    net = SPATIAL
    if parts == "real":
        keys = [(at, Affine(k.linear, SPATIAL(*at).translation)) for at, k in keys]
    else:
        keys = [(at, Affine(SPATIAL(*at).linear, k.translation)) for at, k in keys]
    r = loose(net, method, parts=parts, keyframes=keys, length=2.0, **({"max_steps": 20} if method == "greedy" else {}))
    assert missed(r.motion, keys) < 1e-11
    turned = keyframes_near(SPATIAL, 3, seed=9)
    if parts == "real":
        r = loose(net, method, parts=parts, keyframes=[NetKeyframe(at, k, hold="rotation") for at, k in turned])
        for at, k in turned:
            np.testing.assert_allclose(r.motion(*at).linear, k.linear, atol=1e-12)


def test_real_part_and_translation_one_after_the_other():
    """Without keyframes the least squares of both; with them these hold, and each part has its prices."""
    sides: dict[str, Any] = {"length": 2.0}
    both = fair(SPATIAL, "least-squares", weight=0.5, parts="real+translation", **sides)
    real = fair(SPATIAL, "least-squares", weight=0.5, parts="real", **sides)
    apart = fair(real.motion, "least-squares", weight=0.5, parts="translation", **sides)
    one, other = (r.motion.control_displacements.dual for r in (apart, both))
    np.testing.assert_allclose(one, other, atol=1e-11)
    place = np.array([0.3, -0.2, 0.4])
    point = SPATIAL.trajectory(place, 4.5, 5.5)[0]
    keys = [*keyframes_near(SPATIAL, 3), NetPlace((4.5, 5.5), place, point)]
    for given in ({"weight": 0.5}, {"noise": (0.02, 0.05)}):
        r = loose(SPATIAL, parts="real+translation", method="least-squares", keyframes=keys, **sides, **given)
        assert missed(r.motion, keys[:3]) < 1e-11
        np.testing.assert_allclose(r.motion.trajectory(place, 4.5, 5.5)[0], point, atol=1e-11)
        assert r.final < 0.1 * r.initial
        assert r.multipliers["keyframes"].shape == (4, 8) and np.isnan(r.keyframe_weights[3])
        assert r.final == pytest.approx(fair(r.motion, max_steps=0, parts="real+translation", length=2.0).initial)
    with pytest.raises(sm.InputError, match="by least squares with a weight or noise, not with target"):
        fair(SPATIAL, "least-squares", parts="real+translation", keyframes=keys, target=1.0)
    with pytest.raises(sm.InputError, match="keyframe 0: parameters"):
        loose(SPATIAL, "least-squares", parts="real+translation", keyframes=[("a", keys[0][1])])


@pytest.mark.parametrize("parts", ["real+dual", "dual", "translation"])
def test_places_of_body_points(parts):
    point, x = np.array([0.5, -1.0, 2.0]), np.array([1.0, 0.4, 2.2])
    r = loose(SPATIAL, "least-squares", parts=parts, keyframes=[NetPlace((4.0, 5.5), point, x)])
    np.testing.assert_allclose(r.motion.trajectory(point, 4.0, 5.5)[0], x, atol=1e-12)
    turned = np.array([0.0, 1.0, 2.0])
    there = SPHERICAL.trajectory(turned, 5.0, 5.0)[0]
    aside = there + 0.1 * np.cross(there, [0, 0, 1.0])
    aside *= np.linalg.norm(turned) / np.linalg.norm(aside)
    s = loose(SPHERICAL, "greedy", keyframes=[NetPlace((5.0, 5.0), turned, aside)], max_steps=30)
    np.testing.assert_allclose(s.motion.trajectory(turned, 5.0, 5.0)[0], aside, atol=1e-12)


def test_keyframes_of_curves_and_regions():
    curve = RationalMotion(SPHERICAL.u, SPHERICAL.real[:, 5])
    q = DualQuaternions(curve.pair(6.3)[0] + 0.01)
    for method in ("greedy", "orthogonal", "least-squares"):
        r = loose(curve, method, keyframes=[(6.3, q)])
        np.testing.assert_allclose(r.motion(6.3).linear, q.matrices.linear, atol=1e-12)
    region = ((5.0, 8.0), (5.0, 7.0))
    keys = [((6.1, 6.2), q)]
    r = fair(SPHERICAL, keyframes=[(keys[0][0], _turned(SPHERICAL, keys[0][0]))], region=region, max_steps=50)
    outside = np.ones(SPHERICAL.real.shape[:2], dtype=bool)
    outside[2:8, 2:7] = False
    assert not r.displacement[outside].any()


def _turned(net, at, angle=0.02):
    return DualQuaternions.from_matrices(net(*at).linear) @ DualQuaternions.from_axis_angle([0.0, 0, 1], angle)


def test_signs_of_keyframes_follow_the_net_and_repeated_ones_add_nothing():
    keys = keyframes_near(SPHERICAL, 2)
    pairs = [(at, DualQuaternions.from_matrices(k.linear)) for at, k in keys]
    flipped = [(at, DualQuaternions(-3.0 * q.real)) for at, q in pairs]
    one, other, twice = (fair(SPHERICAL, "least-squares", keyframes=k) for k in (pairs, flipped, [*pairs, flipped[0]]))
    np.testing.assert_allclose(other.motion.real, one.motion.real, atol=1e-13)
    np.testing.assert_allclose(twice.motion.real, one.motion.real, atol=1e-13)


def test_a_tolerance_and_keyframes_hold_together():
    keys = keyframes_near(SPHERICAL, 2, turn=0.005)
    r = fair(SPHERICAL, keyframes=keys, tolerance=0.03, max_steps=200)
    assert r.displacement.max() <= 0.03 * (1 + 1e-9)
    assert missed(r.motion, keys) < 1e-12
    assert r.discarded > 0


THERE = SPHERICAL.pair(5.0, 5.0)[0]
HALF = DualQuaternions(np.array([0.0, 1.0, 0, 0]) - THERE * THERE[1] / np.sum(THERE**2))
NEAR = ((5.0, 5.0), _turned(SPHERICAL, (5.0, 5.0)))
HERE = DualQuaternions.from_matrices(*SPATIAL(5.0, 5.0))
CROWD = [((5.0 + 0.1 * i, 5.0 + 0.13 * i), SPHERICAL(5.0, 5.0)) for i in range(30)]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: loose(SPHERICAL, keyframes=[((99.0, 4.0), HERE)]), "keyframe 0 at u = 99 is outside the net, whose u"),
        (lambda: loose(SPHERICAL, keyframes=[((5.0,), HERE)]), r"keyframe 0: parameters of shape \(1,\): \(2,\)"),
        (lambda: loose(SPHERICAL, keyframes=[HERE]), r"keyframe 0: \(\(u, v\), displacement\)"),
        (lambda: loose(SPHERICAL, keyframes=[((5.0, 5.0), HERE)]), "has a translation: a spherical motion"),
        (lambda: loose(SPHERICAL, keyframes=[((5.0, 5.0), HALF)]), "half a turn away from the net"),
        (
            lambda: loose(SPATIAL, keyframes=[((5.0, 5.0), DualQuaternions(HERE.real, HERE.dual + 0.1 * HERE.real))]),
            r"no displacement, Q · Q⁰ / S² = 0.1",
        ),
        (lambda: loose(SPATIAL, keyframes=[((5.0, 5.0), Affine(2 * np.eye(3), np.zeros(3)))]), "is no displacement"),
        (lambda: loose(SPATIAL, keyframes=[((5.0, 5.0), SPATIAL.control_displacements)]), "one is needed"),
        (lambda: loose(SPATIAL, keyframes=[NetKeyframe((5.0, 5.0), HERE, weight=-1.0)]), "weight -1.0"),
        (lambda: loose(SPATIAL, keyframes=[((5.0, 5.0), HERE)], parts="real+translation"), "not linear in both"),
        (
            lambda: loose(SPATIAL, keyframes=[((4.0, 5.0), HERE)], parts="translation"),
            "is turned by .*° from the motion, whose rotations",
        ),
        (
            lambda: loose(SPHERICAL, keyframes=[NetPlace((5.0, 5.0), np.eye(3)[0], 2 * np.eye(3)[0])]),
            "distance 1 from the origin cannot be at distance 2",
        ),
        (
            lambda: loose(SPATIAL, keyframes=[((5.0, 5.0), HERE), ((5.0, 5.0), SPATIAL(4.0, 4.0))]),
            "keyframes 0 and 1 are different displacements at one place",
        ),
        (lambda: loose(SPHERICAL, "least-squares", keyframes=CROWD), r"too crowded .* \(rank \d+ of \d+\)"),
        (
            lambda: loose(CLAMPED, keyframes=[((0.0, 3.0), _turned(CLAMPED, (0.0, 3.0)))]),
            r"keyframe 0 at \(0, 3\) reads only controls that stay",
        ),
        (
            lambda: loose(SPHERICAL, keyframes=[((5.0, 5.0), _turned(SPHERICAL, (5.0, 5.0), 0.5))], tolerance=0.01),
            r"keyframes and borders alone move control \(\d+, \d+\) further",
        ),
        (
            lambda: loose(
                SPHERICAL, "least-squares", noise=1e-6, keyframes=[((5.0, 5.0), _turned(SPHERICAL, (5.0, 5.0)))]
            ),
            "keyframes and borders alone",
        ),
    ],
)
def test_bad_keyframes_are_named(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()


def test_coordinates_say_what_is_linear():
    assert Coordinates.of(SPHERICAL).linear
    assert not Coordinates.of(SPATIAL, "translation").linear
