from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import BSpline

import symmotion as sm
from symmotion.fairing import Coordinates, FairingStatus, Jumps, StepTables, fair, fairing_program, local_step_program
from symmotion.motions.dual import DualQuaternions
from symmotion.motions.nets import noisy_net, smooth_net
from symmotion.motions.rational import RationalMotion
from symmotion.motions.two_parameter import TwoParameterMotion
from symmotion.splines import BSplineBasis

RNG = np.random.default_rng(11)
STEPS = ("nine", "orthogonal")
UNEVEN = BSplineBasis(np.sort(np.r_[0, 0, 0, 0, RNG.uniform(0.5, 8, 7), 9, 9, 9, 9]), 3)
SPHERICAL = noisy_net(smooth_net(15), 0.018, seed=0)
SPATIAL = noisy_net(smooth_net(10, 8, spatial=True), 0.02, translation=0.05, seed=1)
CLAMPED = noisy_net(smooth_net(9, 11, knots="clamped"), 0.02, seed=2)
loose: Any = fair  # for input that the type checker would not let through
IRREGULAR = TwoParameterMotion(UNEVEN, CLAMPED.v, noisy_net(smooth_net(11), 0.02, seed=3).real)
NETS = {"uniform": SPHERICAL, "spatial": SPATIAL, "clamped": CLAMPED, "irregular": IRREGULAR}


def third_derivative(basis, controls, t):
    return BSpline(basis.knots, controls, 3)(t, 3)


@pytest.mark.parametrize("motion", NETS.values(), ids=NETS)
def test_jumps_are_those_of_the_third_derivatives(motion):
    """Between knots X_uuu is constant in u: its values half a span to either side differ by the jump."""
    net = Coordinates.of(motion).net
    jumps = Jumps.of(motion.bases)
    found = jumps.at(net)
    for kind, (basis, other, axes) in enumerate(((motion.u, motion.v, (0, 1)), (motion.v, motion.u, (1, 0)))):
        line = BSpline(other.knots, np.moveaxis(net, axes[1], 0), 3)(other.knots[4 : other.n])
        controls = np.moveaxis(line, 1, 0)
        knots = basis.knots
        inner = np.arange(4, basis.n)
        before, after = ((knots[inner - 1] + knots[inner]) / 2, (knots[inner] + knots[inner + 1]) / 2)
        expected = third_derivative(basis, controls, before) - third_derivative(basis, controls, after)
        values = found[:, :, kind] if kind == 0 else np.swapaxes(found[:, :, kind], 0, 1)
        np.testing.assert_allclose(values, expected, atol=1e-11 * max(1, np.abs(expected).max()))


def test_uniform_knots_have_the_printed_coefficients_and_scale():
    jumps = Jumps.of(SPHERICAL.bases)
    np.testing.assert_allclose(jumps.u.jumps[3, 3:8], [-1, 4, -6, 4, -1], atol=1e-12)
    np.testing.assert_allclose(jumps.u.values[3, 4:7], np.array([1, 4, 1]) / 6, atol=1e-14)
    matrix = np.linalg.inv(StepTables(jumps, "nine").solve[5, 5])
    # |ā|² |N|² = 68 · 18/36 on the diagonal and (ā · N)² = (−16/6)² beside it.
    np.testing.assert_allclose(matrix, [[34, 64 / 9], [64 / 9, 34]], atol=1e-12)
    u, v = (BSplineBasis(2 * b.knots, 3) for b in SPHERICAL.bases)
    wider = TwoParameterMotion(u, v, 3 * SPHERICAL.real)
    ratio = Jumps.of(wider.bases).fairness(wider.real).sum() / jumps.fairness(SPHERICAL.real).sum()
    assert ratio == pytest.approx(9 / 2**6, rel=1e-12)


@pytest.mark.parametrize("motion", NETS.values(), ids=NETS)
@pytest.mark.parametrize("step", STEPS)
def test_closed_step_equals_the_program_with_explicit_multipliers(motion, step):
    net = Coordinates.of(motion).net
    jumps = Jumps.of(motion.bases)
    tables = StepTables(jumps, step)
    for k, l in ((0, 0), (1, 2), (jumps.shape[0] - 1, jumps.shape[1] // 2)):  # noqa: E741
        multipliers = np.zeros((*jumps.shape, 2, net.shape[-1]))
        multipliers[k, l] = tables.solve[k, l] @ jumps.at(net)[k, l]
        closed = net - jumps.spread(multipliers, step)
        program = local_step_program(motion, (k, l), step=step)
        solution = sm.ExactNewton().solve(program).require()
        moved = program.design.net(program.unpack(solution.x))
        np.testing.assert_allclose(moved, closed, atol=1e-13)
        explicit = np.stack([solution.multipliers[name][0] for name in ("uuu", "vvv")])
        np.testing.assert_allclose(explicit, multipliers[k, l], atol=1e-12)
        assert solution.inertia == "positive"
        assert np.abs(jumps.at(closed)[k, l]).max() < 1e-12
        changed = (closed != net).any(axis=-1)
        assert changed.sum() <= (9 if step == "nine" else 21)
        assert not np.concatenate([changed[[0, -1]].ravel(), changed[:, [0, -1]].ravel()]).any()


def test_local_step_agrees_with_ipopt_and_multipliers_are_sensitivities():
    program = local_step_program(SPHERICAL, (3, 4))
    newton, ipopt = (s.solve(program).require() for s in (sm.ExactNewton(), sm.Ipopt()))
    np.testing.assert_allclose(newton.x, ipopt.x, atol=1e-9)
    # With Δ_uuu = ε instead of 0 the least ½ Σ|δ|² changes by −λε.
    shift = np.zeros((1, 4))
    shift[0, 2] = 1e-5
    data = program.constraint("uuu").block.data
    values = [
        sm.ExactNewton().solve(program.with_data("uuu", data - s * shift)).require().objective for s in (1.0, -1.0)
    ]
    assert (values[0] - values[1]) / 2e-5 == pytest.approx(-newton.multipliers["uuu"][0, 2], rel=1e-6)


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("motion", NETS.values(), ids=NETS)
def test_incremental_measures_equal_fresh_ones(motion, step):
    """The history of G, kept up to date by the tables of 45 (69) changes, against nets rebuilt from scratch."""
    method = "greedy" if step == "nine" else "orthogonal"
    jumps = Jumps.of(motion.bases)
    whole = fair(motion, method, max_steps=40, divergence=1e9)
    for steps in (1, 7, 40):
        r = fair(motion, method, max_steps=steps, divergence=1e9)
        np.testing.assert_array_equal(r.history, whole.history[: steps + 1])
        assert r.final == pytest.approx(r.history[r.best_step], rel=1e-12)
        assert r.final == pytest.approx(jumps.fairness(Coordinates.of(r.motion).net).sum(), rel=1e-12)
    reach = StepTables(jumps, step)
    affected = np.abs(reach.change[2, 2].reshape(*(2 * r + 1 for r in reach.reach), 2, 2)).max(axis=(2, 3)) > 1e-14
    assert affected.sum() <= (45 if step == "nine" else 69)


@pytest.mark.parametrize("method", ["greedy", "orthogonal"])
@pytest.mark.parametrize(
    "motion", [SPHERICAL, SPATIAL, CLAMPED.isoparametric(u=2.3)], ids=["spherical", "spatial", "1D"]
)
def test_steps_as_programs_take_the_same_path(motion, method):
    options = {"max_steps": 12, "divergence": 1e9}
    closed, program = fair(motion, method, **options), fair(motion, method, form="program", **options)
    np.testing.assert_allclose(program.history, closed.history, rtol=1e-9)
    np.testing.assert_allclose(program.motion.real, closed.motion.real, atol=1e-12)
    np.testing.assert_allclose(program.multipliers["jumps"], closed.multipliers["jumps"], atol=1e-11)
    assert program.certificate is not None
    assert program.certificate.inertia == "positive"
    assert program.certificate.stationarity < 1e-12
    assert closed.certificate is None


def test_greedy_reaches_the_papers_fairness_and_keeps_the_ring():
    r = fair(SPHERICAL, target=0.002)
    assert r.status == FairingStatus.TARGET
    assert r.final <= 0.002 < r.history[:-1].min()
    assert 1500 < r.steps < 4000
    ring = np.ones((15, 15), dtype=bool)
    ring[1:-1, 1:-1] = False
    np.testing.assert_array_equal(r.motion.real[ring], SPHERICAL.real[ring])
    np.testing.assert_allclose(r.displacement, np.linalg.norm(r.motion.real - SPHERICAL.real, axis=-1))
    assert r.before.sum() == r.initial == pytest.approx(r.history[0])
    assert (np.diff(r.history) > 0).mean() > 0.2  # G is not monotone
    r.require(0.002)


def test_boundary_motions_of_clamped_knots_stay():
    r = fair(CLAMPED, max_steps=300)
    t = np.linspace(*CLAMPED.u.domain, 9)
    for side in ("v0", "v1"):
        one, two = (m.boundary(side)(t).linear for m in (CLAMPED, r.motion))
        np.testing.assert_allclose(one, two, atol=1e-14)
    assert r.final < r.initial


def test_past_the_minimum_the_best_net_is_kept_and_the_guard_stops():
    small = noisy_net(smooth_net(7), 0.02, seed=4, ring=True)
    r = fair(small, divergence=1.5, max_steps=200_000)
    assert r.status in (FairingStatus.MINIMUM, FairingStatus.CAP)
    assert r.final == pytest.approx(r.history.min(), rel=1e-6)
    assert r.history[r.best_step] == r.history.min()


def test_orthogonal_steps_are_projections_and_never_move_away_from_a_fair_net():
    """The steps project onto conditions that a C³ net meets: the distance to that cannot grow."""
    v = BSplineBasis(np.arange(13.0), 3)
    # Cubic polynomials have no jumps at all.
    x = np.stack([np.polynomial.polynomial.polyval(v.greville, c) for c in RNG.normal(size=(4, 2)) * 0.05], axis=-1)
    exact = TwoParameterMotion(v, v, np.array([1.0, 0, 0, 0]) + x[:, None] + x[None])
    assert Jumps.of(exact.bases).fairness(exact.real).sum() < 1e-24
    noisy = noisy_net(exact, 0.02, seed=5)
    distances = [np.linalg.norm(noisy.real - exact.real)]
    for steps in (1, 5, 25, 125, 625):
        r = fair(noisy, "orthogonal", max_steps=steps, divergence=1e9)
        distances.append(np.linalg.norm(r.motion.real - exact.real))
    assert (np.diff(distances) < 1e-12).all()
    assert distances[-1] < 0.5 * distances[0]


def test_no_control_leaves_its_tolerance():
    tolerance = np.full((15, 15), 0.02)
    tolerance[7, 7] = 0.0
    for form in ("closed", "program"):
        r = fair(SPHERICAL, tolerance=tolerance, max_steps=25, form=form)
        assert (r.displacement <= tolerance * (1 + 1e-12)).all()
        assert r.discarded > 0
        assert r.displacement[7, 7] == 0
        assert r.final < r.initial
    stuck = fair(SPHERICAL, tolerance=0.0)
    assert stuck.status == FairingStatus.EXHAUSTED
    assert stuck.steps == 0


@pytest.mark.parametrize("method", ["greedy", "orthogonal", "least-squares", "bounded"])
def test_a_region_is_faired_alone(method):
    options = {"tolerance": 0.05} if method == "bounded" else {"max_steps": 50} if method != "least-squares" else {}
    r = loose(SPHERICAL, method, region=((5.0, 8.0), (10.0, 12.0)), **options)
    rows, columns = np.flatnonzero(r.displacement.any(axis=1)), np.flatnonzero(r.displacement.any(axis=0))
    wider = 0 if method != "orthogonal" else 1
    # The knots 5 … 8 have the inner controls 2 … 7; the orthogonal step moves one more on either side.
    assert rows.min() >= 2 - wider
    assert rows.max() <= 7 + wider
    assert columns.min() >= 7 - wider
    assert columns.max() <= 11 + wider
    assert r.final < r.initial


@pytest.mark.parametrize("motion", NETS.values(), ids=NETS)
def test_least_squares_is_the_minimum_and_equals_its_program(motion):
    closed = fair(motion, "least-squares", weight=0.3)
    program = fair(motion, "least-squares", weight=0.3, form="program")
    np.testing.assert_allclose(program.motion.real, closed.motion.real, atol=1e-11)
    assert program.certificate is not None
    assert program.certificate.inertia == "positive"
    jumps, start, net = Jumps.of(motion.bases), Coordinates.of(motion).net, Coordinates.of(closed.motion).net
    # d − d⁰ = −DᵀΔ/w inside the ring: the multipliers of the jumps.
    inside = (slice(1, -1), slice(1, -1))
    np.testing.assert_allclose((start - net)[inside], jumps.spread(closed.multipliers["jumps"])[inside], atol=1e-10)

    def objective(x):
        return jumps.fairness(x).sum() + 0.3 * np.sum((x - start) ** 2)

    for _ in range(5):
        other = net.copy()
        other[inside] += 1e-3 * RNG.normal(size=other[inside].shape)
        assert objective(other) > objective(net)


def test_ring_multipliers_are_what_moving_the_ring_would_change():
    program = fairing_program(CLAMPED, weight=1.0)
    solution = sm.ExactNewton().solve(program).require()
    data = program.constraint("fixed").block.data
    step = np.zeros_like(data)
    step[3, 1] = 1e-4
    values = [sm.ExactNewton().solve(program.with_data("fixed", data + s * step)).require().objective for s in (1, -1)]
    assert (values[0] - values[1]) / 2e-4 == pytest.approx(-solution.multipliers["fixed"][3, 1], rel=1e-6, abs=1e-9)


def test_least_squares_finds_the_weight_for_a_target():
    r = fair(SPHERICAL, "least-squares", target=0.002)
    assert 0.98 * 0.002 < r.final <= 0.002
    again = fair(SPHERICAL, "least-squares", weight=r.weight)
    np.testing.assert_allclose(again.motion.real, r.motion.real, atol=1e-12)
    steps = fair(SPHERICAL, target=0.002)
    assert np.linalg.norm(r.displacement) < np.linalg.norm(steps.displacement)


def test_bounds_hold_with_multipliers_where_they_are_met():
    r = fair(CLAMPED, "bounded", tolerance=0.01)
    assert r.status == FairingStatus.SOLVED
    assert r.certificate is not None
    assert r.certificate.holds(1e-7)
    assert r.displacement.max() <= 0.01 * (1 + 1e-6)
    prices = r.multipliers["bounds"].ravel()
    met = (r.displacement[1:-1, 1:-1] > 0.0099).ravel()
    assert (prices > -1e-8).all()
    assert met.any()
    assert prices[~met].max(initial=0.0) < 1e-4 * prices.max()
    wider = fair(CLAMPED, "bounded", tolerance=0.02)
    assert wider.final < r.final < r.initial
    # Never above what the greedy steps reach within the same bounds.
    assert r.final < fair(CLAMPED, tolerance=0.01, max_steps=300).final


@pytest.mark.parametrize("parts", ["real", "dual", "translation", "real+dual", "real+translation"])
def test_parts_of_a_spatial_motion(parts):
    r = fair(SPATIAL, parts=parts, max_steps=200, length=2.0)
    assert r.final < 0.1 * r.initial
    before, after = SPATIAL.control_displacements, r.motion.control_displacements
    turned = np.abs(after.real - before.real).max()
    moved = np.abs(after.translation - before.translation).max()
    assert (turned > 1e-3) == parts.startswith("real")
    if parts == "real":
        assert moved < 1e-13
    else:
        assert moved > 1e-3
    if parts.endswith("translation"):
        np.testing.assert_allclose(after.plucker, 0, atol=1e-14)
    unit = fair(SPATIAL, parts="translation", max_steps=0)
    assert fair(SPATIAL, parts="translation", max_steps=0, length=2.0).initial == pytest.approx(unit.initial / 4)


@pytest.mark.parametrize("method", ["greedy", "orthogonal", "least-squares", "bounded"])
def test_one_parameter_fairing_is_the_special_case(method):
    """A curve, and the same curve as a net that is constant in v with nothing to fair there."""
    curve = RationalMotion(SPHERICAL.u, SPHERICAL.real[:, 7])
    options = {"greedy": {"max_steps": 30}, "orthogonal": {"max_steps": 30}, "bounded": {"tolerance": 0.02}}
    r = fair(curve, method, **options.get(method, {}))
    assert r.displacement.shape == (15,)
    assert r.before.shape == (11,)
    assert r.final < r.initial
    assert not r.displacement[[0, -1]].any()
    jump = np.array([-1.0, 4, -6, 4, -1])
    by_hand = sum(np.sum((jump @ curve.real[k : k + 5]) ** 2) for k in range(11))
    assert r.initial == pytest.approx(by_hand, rel=1e-12)
    if method == "greedy":
        k = int(r.before.argmax())
        one = fair(curve, max_steps=1, divergence=1e9)
        # The inner coefficients (4, −6, 4): δ = −ā Δ / 68.
        expected = curve.real.copy()
        expected[k + 1 : k + 4] -= np.outer(jump[1:4], jump @ curve.real[k : k + 5]) / 68
        if one.best_step:
            np.testing.assert_allclose(one.motion.real, expected, atol=1e-14)
        assert one.history[1] == pytest.approx(Jumps.of(curve.bases).fairness(expected[:, None]).sum(), rel=1e-12)


REPEATED = BSplineBasis(np.sort(np.r_[np.zeros(4), [1, 2, 2, 3, 4], np.full(4, 5.0)]), 3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: loose(smooth_net(4, 9)), "4 controls in u have no interior knot"),
        (lambda: loose(smooth_net(9, 4)), "4 controls in v have no interior knot"),
        (lambda: loose(TwoParameterMotion(REPEATED, CLAMPED.v, CLAMPED.real)), "knot 2 in u is repeated"),
        (
            lambda: loose(TwoParameterMotion.from_displacements(DualQuaternions(CLAMPED.real), degree=2)),
            "in u is of degree 2",
        ),
        (lambda: loose(CLAMPED.with_controls(CLAMPED.real * ALTERNATING, None)), "different hemispheres"),
        (lambda: loose(smooth_net, "greedy"), "function cannot be faired"),
        (lambda: loose(CLAMPED, "magic"), "method 'magic' is unknown; there are greedy"),
        (lambda: loose(CLAMPED, form="open"), "form 'open'"),
        (lambda: loose(CLAMPED, target=-1.0), r"target -1.0: a positive number"),
        (lambda: loose(CLAMPED, target=np.nan), "target nan"),
        (lambda: loose(CLAMPED, "least-squares", weight=0.0), r"weight 0.0: a positive"),
        (lambda: loose(CLAMPED, "least-squares", weight=1.0, target=1.0), "target and weight"),
        (lambda: loose(CLAMPED, "least-squares", target=1e-30), "cannot fall below"),
        (lambda: loose(CLAMPED, "least-squares", max_steps=3), "max_steps goes with greedy"),
        (lambda: loose(CLAMPED, "least-squares", tolerance=3.0), "takes a weight"),
        (lambda: loose(CLAMPED, weight=3.0), "weight goes with least-squares"),
        (lambda: loose(CLAMPED, "bounded"), "bounded needs a tolerance"),
        (lambda: loose(CLAMPED, "bounded", tolerance=0.0), "bounds must leave room"),
        (lambda: loose(CLAMPED, "bounded", tolerance=0.1, target=1.0), "target and bounded"),
        (lambda: loose(CLAMPED, max_steps=2.5), r"max_steps 2.5"),
        (lambda: loose(CLAMPED, divergence=1.0), r"divergence 1.0"),
        (lambda: loose(CLAMPED, tolerance=-1.0), "0 or more"),
        (lambda: loose(CLAMPED, tolerance=np.ones(3)), r"shape \(3,\): one number or \(9, 11\)"),
        (lambda: loose(CLAMPED, region=((0, 1), (0, 99))), "region v from 0 to 99: must increase within 0 to 8"),
        (lambda: loose(CLAMPED, region=((0.2, 0.4), (0, 4))), "region u from 0.2 to 0.4 holds no interior knot"),
        (lambda: loose(CLAMPED, region=(0, 1)), r"\(\(a, b\), \(c, d\)\)"),
        (lambda: loose(CLAMPED, parts="dual"), "a spherical motion has real parts only"),
        (lambda: loose(SPATIAL, parts="all"), "parts 'all' are unknown"),
        (lambda: loose(SPATIAL, length=0.0), r"length 0.0"),
        (lambda: local_step_program(CLAMPED, (0, 99)), r"knot \(0, 99\): indices below \(5, 7\)"),
        (lambda: local_step_program(CLAMPED, (0,)), "indices below"),
        (lambda: fairing_program(CLAMPED, weight=-1.0), r"weight -1.0"),
        (lambda: fairing_program(CLAMPED, weight=1.0).with_keyframes(None), "no keyframes"),
    ],
)
def test_bad_input_names_the_culprit(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()


ALTERNATING = np.where(np.arange(11) % 2, -1.0, 1.0)[None, :, None]


def test_require_raises_where_the_target_is_not_reached():
    with pytest.raises(sm.SolveError, match=r"above the target 1e-06 \(cap after 3 steps"):
        fair(SPHERICAL, target=1e-6, max_steps=3).require(1e-6)


def test_a_condition_on_a_net_is_kept_and_priced():
    place = 2.3, 3.6
    net = fairing_program(CLAMPED, weight=1.0).start["controls"].reshape(*CLAMPED.real.shape[:2], -1)
    u, v = (basis.matrix(np.array([p])).toarray()[0] for basis, p in zip(CLAMPED.bases, place, strict=True))
    target = np.einsum("i,j,ijc->c", u, v, net) + 0.01

    def program(change=0.0):
        there = sm.JetConstraint(lambda jet: jet.d - (target + change), at=[place], name="there")
        return fairing_program(CLAMPED, weight=1.0, constraints=[there])

    def solve(change=0.0):
        return sm.Ipopt(tolerance=1e-10).solve(program(change)).require(1e-8)

    solution = solve()
    faired = solution.x.reshape(net.shape)
    np.testing.assert_allclose(np.einsum("i,j,ijc->c", u, v, faired), target, atol=1e-9)
    assert solution.multipliers["there"].shape == (1, net.shape[-1])
    slope = (solve(1e-4).objective - solve(-1e-4).objective) / 2e-4
    assert slope == pytest.approx(-solution.multipliers["there"].sum(), rel=1e-5)
    # Newton's factorisation does not pivot, and some of these systems have a zero where it starts: it says so and ends.
    assert sm.ExactNewton().solve(program()).status in ("solved", "failed")


@pytest.mark.parametrize("method", ["greedy", "orthogonal", "least-squares", "bounded"])
@pytest.mark.parametrize("size", [1e155, 1e300])
def test_a_net_whose_fairness_no_number_holds_is_refused_by_name(method, size, recwarn):
    motion = TwoParameterMotion(SPHERICAL.u, SPHERICAL.v, size * SPHERICAL.real)
    with pytest.raises(sm.InputError, match=r"G = (inf|nan) at the start: the controls, up to .*e.*larger units"):
        fair(motion, method, tolerance=1e-3 if method == "bounded" else None)
    assert not recwarn.list


def test_a_net_that_is_not_finite_at_the_end_is_no_success(monkeypatch):
    from importlib import import_module

    module = import_module("symmotion.fairing.fair")
    steps = module.by_steps
    endless = np.full_like(Coordinates.of(SPHERICAL).net, np.inf)
    monkeypatch.setattr(module, "by_steps", lambda *given: replace(steps(*given), net=endless))
    result = fair(SPHERICAL, max_steps=3)
    assert result.status is FairingStatus.FAILED and "at the end" in result.message
    with pytest.raises(sm.SolveError, match="at the end"):
        result.require()
