"""What a user may ask of a program, in public names: each request in at most three lines beyond the program itself."""

import copy
import pickle
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import casadi as ca
import numpy as np
import pytest
from problems import body_points
from scipy.spatial.transform import Rotation

import symmotion as sm
from symmotion.systems import HessianTriangle

KEYS = sm.examples.random_keyframes(6, 60, 1)
WRONG: Any = sm  # what a type checker would refuse
POINTS = body_points(3)
BOTH = sm.Rigidity() + 0.01 * sm.TrajectoryEnergy(POINTS)
TIMES = np.array([0.0, 1.0, 2.2, 3.0, 4.5])
TURNS = Rotation.random(5, random_state=1)
PLACES = np.random.default_rng(0).normal(size=(5, 3))
TIP = np.array([0.3, -0.1, 0.2])


def along(motion: Any, count: int = 400) -> np.ndarray:
    a, b = motion.domain
    return np.linspace(a, b, count)


def test_body_points_stay_above_a_floor():
    free = sm.ExactNewton().solve(sm.affine_program(KEYS, objective=BOTH)).require()
    lowest = free.motion.trajectory(POINTS, along(free.motion))[..., 2].min()
    given = (KEYS.linear @ POINTS.T + KEYS.translation[:, :, None])[:, 2].min()
    assert lowest < given - 1e-3
    floor = 0.5 * (lowest + given)
    above = sm.JetConstraint(
        lambda jet: ca.vertcat(*(jet.place(p)[2] for p in POINTS)), lower=floor, upper=np.inf, name="floor"
    )
    solution = sm.Ipopt().solve(sm.affine_program(KEYS, objective=BOTH, constraints=[above])).require(1e-7)
    held = solution.program.constraint("floor")
    assert solution.multipliers["floor"].shape == (held.block.count, len(POINTS))
    times = held.block.data[:, 0]
    assert solution.motion.trajectory(POINTS, times)[..., 2].min() > floor - 1e-6
    assert solution.multipliers["floor"].min() < -1e-6  # a lower bound presses the other way
    assert solution.objective > free.objective
    assert "everywhere, held at" in str(solution.program)


def test_angular_rate_and_acceleration_bounded_on_an_affine_motion():
    free = sm.ExactNewton().solve(sm.affine_program(KEYS, objective=BOTH)).motion
    t = along(free)
    turning = np.linalg.solve(free(t).linear, free(t, 1).linear)
    bend = np.linalg.solve(free(t).linear, free(t, 2).linear) - turning @ turning
    fastest, hardest = (np.linalg.norm(m - np.swapaxes(m, 1, 2), axis=(1, 2)).max() / 8**0.5 for m in (turning, bend))
    bounds = [sm.RateBound(0.97 * fastest), sm.constraints.AccelerationBound(0.9 * hardest)]
    program = sm.affine_program(KEYS, objective=BOTH, constraints=bounds, refine=2)
    motion = sm.Ipopt().solve(program).require(1e-7).motion
    times = program.constraint("rate bound").block.data[:, 0]
    turning = np.linalg.solve(motion(times).linear, motion(times, 1).linear)
    rate = np.linalg.norm(turning - np.swapaxes(turning, 1, 2), axis=(1, 2)) / 8**0.5
    assert rate.max() < 0.97 * fastest * (1 + 1e-6)


def test_torque_bounded():
    inertia = (1.0, 2.0, 2.5)
    objective = sm.Torque(inertia) + ORIGIN
    free = sm.ExactNewton().solve(sm.pose_program(TIMES, TURNS, PLACES, objective=objective, refine=2))
    most = 0.9 * _torque(free.motion.orientation, along(free.motion.orientation), inertia).max()
    bound = sm.constraints.TorqueBound(most, inertia)
    program = sm.pose_program(TIMES, TURNS, PLACES, objective=objective, constraints=[bound], refine=2)
    solution = sm.Ipopt().solve(program).require(1e-6)
    spans = program.design.setting.inside_spans(5, "")
    assert _torque(solution.motion.orientation, spans, inertia).max() < most * (1 + 1e-5)
    assert solution.objective > free.objective


def _torque(curve, t, inertia):
    jet, moments = curve.jet(t, 2), np.diag(inertia)
    return np.linalg.norm(jet.acceleration @ moments + np.cross(jet.rate, jet.rate @ moments), axis=1)


ORIGIN = sm.TrajectoryEnergy(np.zeros((1, 3)))


def test_a_fit_with_an_inequality():
    samples = sm.examples.random_keyframes(30, 10, 2)
    free = sm.ExactNewton().solve(sm.fit_program(samples, controls=10)).motion
    limit = 0.8 * np.linalg.norm(free(along(free), 1).translation, axis=1).max()
    program = sm.fit_program(samples, controls=10, constraints=[sm.SpeedBound([0.0, 0.0, 0.0], limit)])
    solution = sm.Ipopt().solve(program).require(1e-7)
    times = program.constraint("speed").block.data[:, 0]
    assert np.linalg.norm(solution.motion(times, 1).translation, axis=1).max() < limit * (1 + 1e-6)
    assert solution.multipliers["speed"].max() > 1e-6


def test_two_bodies_at_a_fixed_distance():
    other = sm.Keyframes(KEYS.times, KEYS.linear, KEYS.translation + np.array([2.0, 0.0, 0.0]))
    two = {"left": sm.affine_program(KEYS, objective=BOTH), "right": sm.affine_program(other, objective=BOTH)}
    apart = sm.JetConstraint(lambda a, b: ca.sumsqr(a.v - b.v) - 4.2, at=[0.5, 2.5, 4.5], name="apart")
    solution = sm.ExactNewton().solve(sm.join(two, [apart])).require(1e-8)
    left, right = solution.motions["left"], solution.motions["right"]
    gap = np.linalg.norm(left([0.5, 2.5, 4.5]).translation - right([0.5, 2.5, 4.5]).translation, axis=1)
    np.testing.assert_allclose(gap, np.sqrt(4.2), rtol=1e-9)
    assert solution.multipliers["apart"].shape == (3,)
    assert solution.multipliers["left: keyframes"].linear.shape == (6, 3, 3)
    by_ipopt = sm.Ipopt().solve(sm.join(two, [apart])).require(1e-7)
    assert by_ipopt.objective == pytest.approx(solution.objective, rel=1e-8)
    alone = sum(sm.ExactNewton().solve(p).objective for p in two.values())
    assert solution.objective > alone


def two_bodies(at, shift=0.0):
    """An affine body and a pose that keep their distance, the pose `shift` later."""
    keys = sm.Keyframes.from_rotations(TIMES + shift, TURNS, PLACES + np.array([2.0, 0.0, 0.0]))
    mine = sm.affine_program(sm.Keyframes.from_rotations(TIMES, TURNS, PLACES), objective=BOTH)
    two: dict[str, Any] = {"a": mine, "p": sm.pose_program(keys)}  # Any: programs of different kinds
    far = sm.JetConstraint(
        lambda a, b, d: ca.sumsqr(a.v - b.v) - d.least, upper=np.inf, at=at, name="far", parameters={"least": 3.9}
    )
    return sm.join(two, [far])


@pytest.mark.parametrize("at", [None, 1.6, [1.6, 2.6], [(1.6, 2.6)]])
def test_bodies_travel_together(at):
    program = two_bodies(at)
    turned = sm.Keyframes.from_rotations(TIMES, TURNS, PLACES + 0.1)
    for travelled in (pickle.loads(pickle.dumps(pickle.loads(pickle.dumps(program)))), copy.deepcopy(program)):
        there, here = travelled.with_keyframes({"a": turned}), program.with_keyframes({"a": turned})
        x = here.x0 + 0.1
        np.testing.assert_allclose(sm.program.Evaluator(there).values(x), sm.program.Evaluator(here).values(x))


def test_bodies_travel_to_other_processes():
    program = two_bodies([1.6])
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        found: list[Any] = sm.solve_many([program], solver=sm.Ipopt(), executor=pool)
    assert found[0].objective == pytest.approx(sm.Ipopt().solve(program).objective, rel=1e-9)


def test_each_time_of_a_tuple_is_of_its_own_body():
    assert two_bodies([(1.6, 11.6)], shift=10.0).constraint("far").block.count == 1
    assert two_bodies(None, shift=1.3).constraint("far").block.count > 1
    with pytest.raises(sm.InputError, match=r"far: time 1.6 is outside the motion's domain \[1\d"):
        two_bodies([(1.6, 1.6)], shift=10.0)
    with pytest.raises(sm.InputError, match="far: the motions have no times in common"):
        two_bodies(None, shift=10.0)


@pytest.mark.parametrize("kinds", ["affine and pose", "pose and orientation", "affine and curve"])
def test_bodies_of_different_kinds(kinds):
    keys = sm.Keyframes.from_rotations(TIMES, TURNS, PLACES)
    make = {
        "affine": lambda: sm.affine_program(keys, objective=BOTH),
        "pose": lambda: sm.pose_program(keys),
        "orientation": lambda: sm.orientation_program(keys),
        "curve": lambda: sm.curve_program(keys),
    }
    first, second = kinds.split(" and ")
    names = {
        "affine and pose": lambda a, b: a.place(TIP) - b.place(TIP),
        "pose and orientation": lambda a, b: a.rate - b.rate,
        "affine and curve": lambda a, b: a.v - b.x,
    }
    joint = sm.JetConstraint(names[kinds], at=[(0.5, 1.5)], name="joint")
    program = sm.join({first: make[first](), second: make[second]()}, [joint])
    solution = sm.ExactNewton().solve(program).require(1e-8)
    gap = solution.program.constraint("joint")
    assert gap.block.count == 1 and gap.size == 3
    assert solution.violation < 1e-8
    plain = sm.Ipopt().solve(program).require(1e-6)
    assert plain.objective == pytest.approx(solution.objective, rel=1e-7)


def test_derivatives_of_coupled_blocks_against_differences():
    other = sm.pose_program(TIMES, TURNS, PLACES)
    mine = sm.affine_program(sm.Keyframes.from_rotations(TIMES, TURNS, PLACES), objective=BOTH)
    program = sm.join({"a": mine, "b": other}, [sm.JetConstraint(_distance, at=[1.6, 3.7], name="distance")])
    evaluator = sm.program.Evaluator(program)
    rng = np.random.default_rng(3)
    x, d, step = program.x0, rng.normal(size=program.unknowns), 1e-6
    slope = (evaluator.values(x + step * d) - evaluator.values(x - step * d)) / (2 * step)
    np.testing.assert_allclose(evaluator.jacobian(x) @ d, slope, atol=1e-6)
    mu = rng.normal(size=program.conditions)
    triangle = HessianTriangle.of(program)
    _, values = evaluator.second_order(x, triangle.pattern, mu)
    bend = (
        evaluator.gradient(x + step * d)
        + evaluator.jacobian(x + step * d).T @ mu
        - evaluator.gradient(x - step * d)
        - evaluator.jacobian(x - step * d).T @ mu
    ) / (2 * step)
    np.testing.assert_allclose(triangle.full(values, program.unknowns) @ d, bend, atol=1e-4 * np.abs(bend).max())


def _distance(a, b):
    return ca.sumsqr(a.place(TIP) - b.place(2 * TIP))


def test_rates_equal_at_two_keyframes_and_positions_at_two_times_between():
    same = [
        sm.JetConstraint(lambda a, b: a.dA - b.dA, at=[(KEYS.times[1], KEYS.times[4])], name="same rate"),
        sm.JetConstraint(lambda a, b: a.A - b.A, at=[(0.5, 4.5)], name="same position"),
    ]
    solution = sm.ExactNewton().solve(sm.affine_program(KEYS, constraints=same, refine=2)).require(1e-8)
    motion, t = solution.motion, KEYS.times
    np.testing.assert_allclose(motion(t[1], 1).linear, motion(t[4], 1).linear, atol=1e-8)
    np.testing.assert_allclose(motion(0.5).linear, motion(4.5).linear, atol=1e-8)
    assert solution.multipliers["same rate"].shape == (1, 3, 3)


def test_a_tip_that_touches_down_with_a_velocity_that_is_changed():
    touch = sm.JetConstraint(
        lambda jet, p: jet.velocity(TIP) - p.v, at=2.5, name="touch", parameters={"v": [0.0, 0.0, -0.1]}
    )
    program = sm.pose_program(TIMES, TURNS, PLACES, constraints=[touch], refine=2)
    for v in ([0.0, 0.0, -0.1], [0.1, 0.2, -0.3]):
        changed = program.with_parameters(v=v)
        assert changed.structure is program.structure
        solution = sm.ExactNewton().solve(changed).require(1e-8)
        np.testing.assert_allclose(_velocity(solution.motion, TIP, 2.5), v, atol=1e-8)
        assert solution.multipliers["touch"].shape == (3,)
    moved = changed.with_keyframes(sm.Keyframes.from_rotations(TIMES, TURNS, PLACES + 0.1))
    assert moved.parameters["v"].tolist() == [0.1, 0.2, -0.3]


def _velocity(motion, point, t, step=1e-6):
    ends = motion.trajectory(point[None], [t - step, t + step])
    return np.diff(ends, axis=0).ravel()[:3] / (2 * step)


def test_the_multiplier_of_a_matrix_is_the_change_of_the_optimum():
    target = np.array([[0.9, 0.1, 0.0], [0.0, 1.0, 0.0], [0.2, 0.0, 1.1]])

    def solve(at, change=0.0):
        moved = target.copy()
        moved[2, 0] += change
        rows = sm.JetConstraint(lambda jet: jet.A, lower=moved, upper=moved, at=at, name="there")
        return sm.ExactNewton().solve(sm.affine_program(KEYS, constraints=[rows], refine=2)).require()

    slope = (solve(2.5, 1e-5).objective - solve(2.5, -1e-5).objective) / 2e-5
    assert -solve(2.5).multipliers["there"][2, 0] == pytest.approx(slope, rel=1e-5)
    assert solve([2.5]).multipliers["there"].shape == (1, 3, 3)
    assert solve(2.5).multipliers["there"].shape == (3, 3)


def test_a_parameter_of_the_same_name_is_one_and_the_plain_problem_has_it():
    def first(jet, p):
        return jet.place(TIP)[2] - p.height

    def second(jet, p):
        return jet.v[0] - 2 * p.height

    both = [
        sm.JetConstraint(first, at=0.5, name="one", parameters={"height": 0.3}),
        sm.JetConstraint(second, at=1.5, name="two", parameters={"height": 0.3}),
    ]
    program = sm.affine_program(KEYS, objective=BOTH, constraints=both).with_parameters(height=0.4)
    solution = sm.ExactNewton().solve(program).require()
    assert solution.motion(1.5).translation[0] == pytest.approx(0.8)
    nlp = program.nlp()
    solver = ca.nlpsol(
        "plain", "ipopt", {k: nlp[k] for k in "xpfg"}, {"ipopt.print_level": 0, "print_time": False, "ipopt.sb": "yes"}
    )
    found = solver(x0=nlp["x0"], p=[0.4], lbg=nlp["lbg"], ubg=nlp["ubg"])
    assert float(found["f"]) == pytest.approx(solution.objective, rel=1e-7)
    other = [both[0], sm.JetConstraint(second, at=1.5, name="two", parameters={"height": 0.5})]
    with pytest.raises(sm.InputError, match="parameter 'height' has other numbers in 'two' than in 'one'"):
        sm.affine_program(KEYS, objective=BOTH, constraints=other)
    with pytest.raises(sm.InputError, match="no parameter 'depth'; there are height"):
        program.with_parameters(depth=1.0)


PROGRAMS = {
    "affine": lambda c: sm.affine_program(KEYS, objective=BOTH, constraints=c),
    "fit": lambda c: sm.fit_program(sm.examples.random_keyframes(20, 10, 2), controls=9, constraints=c),
    "free times": lambda c: sm.free_times_program(KEYS[:4], objective=BOTH, constraints=c),
    "orientation": lambda c: sm.orientation_program(TIMES, TURNS, constraints=c),
    "pose": lambda c: sm.pose_program(TIMES, TURNS, PLACES, constraints=c),
    "curve": lambda c: sm.curve_program(KEYS, constraints=c),
}
SAYS = {
    "orientation": lambda jet: jet.rate[2],
    "curve": lambda jet: jet.dx[1],
}


@pytest.mark.parametrize("kind", PROGRAMS)
@pytest.mark.parametrize("at", [None, 1.3, [1.3, 1.7]], ids=["everywhere", "a time", "times"])
def test_every_kind_of_program_takes_what_its_jet_can_say(kind, at):
    says = SAYS.get(kind, lambda jet: jet.velocity([0.1, 0.2, 0.3])[1])
    loose = PROGRAMS[kind]([sm.JetConstraint(says, lower=-np.inf, upper=1e3, at=at, name="bound")])
    free = sm.Ipopt().solve(loose)
    values = sm.program.Evaluator(loose).values(free.x)[-loose.constraint("bound").size :]
    top = values.max() - 0.02 * (values.max() - values.min() + 0.1)
    bound = sm.JetConstraint(says, lower=-np.inf, upper=top, at=at, name="bound")
    program = PROGRAMS[kind]([bound])
    solution = sm.Ipopt().solve(program)
    assert solution.require(1e-6).objective >= free.objective * (1 - 1e-9)
    shape = solution.multipliers["bound"].shape
    assert len(shape) == 1 if at is None else shape == np.shape(at)
    sent = pickle.loads(pickle.dumps(program))
    assert sm.Ipopt().solve(sent).objective == pytest.approx(solution.objective, rel=1e-12)
    again, held = (p.program() for p in (pickle.loads(pickle.dumps(program.design)), program.design))
    x = held.x0 + 0.01
    for name in ("objective", "values"):
        there, here = (getattr(sm.program.Evaluator(p), name)(x) for p in (again, held))
        np.testing.assert_allclose(there, here, rtol=1e-12, atol=1e-12)
    assert (again.lower == held.lower).all() and (again.upper == held.upper).all()


@pytest.mark.parametrize("kind", PROGRAMS)
def test_an_equality_is_kept_and_priced_in_every_kind_of_program(kind):
    says = SAYS.get(kind, lambda jet: jet.velocity([0.1, 0.2, 0.3])[1])

    def solve(value):
        fixed = sm.JetConstraint(says, lower=value, upper=value, at=1.3, name="fixed")
        return sm.Ipopt(tolerance=1e-10).solve(PROGRAMS[kind]([fixed]))

    slope = (solve(0.1 + 1e-4).objective - solve(0.1 - 1e-4).objective) / 2e-4
    assert -float(solve(0.1).multipliers["fixed"]) == pytest.approx(slope, rel=1e-4, abs=1e-7)


SAMPLES = sm.examples.random_keyframes(20, 10, 2)
NOTHING: list[Any] = ["x", 1j, [1.0, [2.0, 3.0]], {"a": 1}, object(), True, np.ma.array([1.0, 2.0], mask=[False, True])]
ARGUMENTS: dict[tuple[str, str], Any] = {  # Any: functions of an argument of any kind
    ("affine", "degree"): lambda x: WRONG.affine_program(KEYS, degree=x),
    ("affine", "refine"): lambda x: WRONG.affine_program(KEYS, refine=x),
    ("affine", "knots"): lambda x: WRONG.affine_program(KEYS, knots=x),
    ("affine", "ends"): lambda x: WRONG.affine_program(KEYS, ends=x),
    ("affine", "end_rates"): lambda x: WRONG.affine_program(KEYS, ends="clamped", end_rates=x),
    ("fit", "controls"): lambda x: WRONG.fit_program(SAMPLES, controls=x),
    ("fit", "weights"): lambda x: WRONG.fit_program(SAMPLES, controls=9, weights=x),
    ("fit", "points"): lambda x: WRONG.fit_program(SAMPLES, controls=9, points=x),
    ("fit", "huber"): lambda x: WRONG.fit_program(SAMPLES, controls=9, huber=x),
    ("fit", "exact"): lambda x: WRONG.fit_program(SAMPLES, controls=9, exact=x),
    ("fit", "knots"): lambda x: WRONG.fit_program(SAMPLES, knots=x),
    ("fit", "end_rates"): lambda x: WRONG.fit_program(SAMPLES, controls=9, ends="clamped", end_rates=x),
    ("free", "least_step"): lambda x: WRONG.free_times_program(KEYS, least_step=x),
    ("free", "end_rates"): lambda x: WRONG.free_times_program(KEYS, ends="clamped", end_rates=x),
    ("orientation", "signs"): lambda x: WRONG.orientation_program(TIMES, TURNS, signs=x),
    ("orientation", "turns"): lambda x: WRONG.orientation_program(TIMES, TURNS, turns=x),
    ("orientation", "end_rates"): lambda x: WRONG.orientation_program(TIMES, TURNS, ends="clamped", end_rates=x),
    ("pose", "translation"): lambda x: WRONG.pose_program(TIMES, TURNS, x),
    ("curve", "degree"): lambda x: WRONG.curve_program(KEYS, degree=x),
    ("curve", "domain"): lambda x: WRONG.curve_program(KEYS, domain=x),
    ("curve", "order"): lambda x: WRONG.curve_program(KEYS, order=x),
    ("curve", "end rates"): lambda x: WRONG.curve_program(KEYS, ends="clamped", end_rates=x),
    ("condition", "at"): lambda x: WRONG.JetConstraint(lambda jet: jet.dv, at=x),
    ("condition", "lower"): lambda x: WRONG.JetConstraint(lambda jet: jet.dv, lower=x),
    ("condition", "parameter"): lambda x: WRONG.JetConstraint(lambda jet: jet.dv, parameters={"v": x}),
    ("energy", "body points"): lambda x: WRONG.TrajectoryEnergy(x),
    ("energy", "masses"): lambda x: WRONG.TrajectoryEnergy(np.eye(3), x),
    ("energy", "weight"): lambda x: WRONG.energies.EnergySum(((x, sm.Rigidity()),)),
    ("motion", "times"): lambda x: sm.interpolants.component_cubic(KEYS)(x),
    ("rigid motion", "times"): lambda x: sm.interpolants.polar_blend(sm.examples.random_keyframes(4, 60, 1))(x),
    ("turning motion", "times"): lambda x: sm.quaternions.interpolate_quaternions(TIMES, TURNS)(x),
}


@pytest.mark.parametrize("nothing", NOTHING, ids=lambda x: type(x).__name__)
@pytest.mark.parametrize(("of", "argument"), ARGUMENTS)
def test_an_argument_that_is_none_is_refused_by_name_in_one_line(of, argument, nothing):
    with pytest.raises(sm.InputError, match=f"^[^\n]*{argument}[^\n]*$"):
        ARGUMENTS[of, argument](nothing)


@pytest.mark.parametrize("make", [sm.affine_program, sm.free_times_program])
def test_rates_at_the_ends_come_as_lists_too(make):
    rates = np.zeros((2, 3, 3)), np.full((2, 3), 0.1)
    found = [make(KEYS, ends="clamped", end_rates=r, objective=BOTH) for r in (rates, [r.tolist() for r in rates])]
    assert (
        sm.program.Evaluator(found[0]).values(found[0].x0).tolist()
        == sm.program.Evaluator(found[1]).values(found[1].x0).tolist()
    )
    with pytest.raises(sm.InputError, match=r"end_rates: translations of shape \(2, 2\)"):
        make(KEYS, ends="clamped", end_rates=(rates[0], np.zeros((2, 2))))


def test_the_domain_is_that_of_the_keyframes():
    slow = sm.JetConstraint(lambda jet: jet.dx, at=9.0, name="slow")
    with pytest.raises(sm.InputError, match=r"slow: time 9 is outside the domain \[0, 5\]"):
        sm.curve_program(KEYS, constraints=[slow])
    assert sm.curve_program(KEYS, constraints=[slow], domain=(0, 9)).design.basis.domain == (0.0, 9.0)


FRESH = Rotation.random(5, random_state=2)


@pytest.mark.parametrize(
    ("kind", "forms"),
    [
        ("orientation", [sm.Keyframes.from_rotations(TIMES, FRESH), (TIMES, FRESH), FRESH, FRESH.as_matrix()]),
        ("pose", [sm.Keyframes.from_rotations(TIMES, FRESH, 2 * PLACES), (TIMES, FRESH, 2 * PLACES)]),
    ],
)
def test_keyframes_change_in_the_form_in_which_they_came(kind, forms):
    found = [PROGRAMS[kind](()).with_keyframes(form) for form in forms]
    for program in found:
        np.testing.assert_allclose(program.x0, found[0].x0, atol=1e-12)
        assert np.abs(program.x0 - PROGRAMS[kind](()).x0).max() > 0.1


@pytest.mark.parametrize("form", [None, "a.csv", 3, KEYS[0], KEYS.linear, (TIMES + 1, TURNS, PLACES)])
@pytest.mark.parametrize("kind", PROGRAMS)
def test_keyframes_that_are_none_are_refused(kind, form):
    with pytest.raises(sm.InputError, match=r"keyframe|quaternions"):
        PROGRAMS[kind](()).with_keyframes(form)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: WRONG.JetConstraint("speed"), "function 'speed': a function of a jet"),
        (lambda: sm.JetConstraint(lambda jet: jet.v, lower=1.0, upper=0.0), "the lower bound is above"),
        (lambda: sm.JetConstraint(lambda jet: jet.v, lower=-np.inf, upper=np.inf), "both bounds are infinite"),
        (lambda: sm.JetConstraint(lambda jet: jet.v, upper=np.nan), "a bound is not a number"),
        (lambda: sm.JetConstraint(lambda jet: jet.v, at=[]), "at of shape"),
        (lambda: sm.JetConstraint(lambda jet: jet.v, at=np.inf), "at of shape"),
        (lambda: sm.JetConstraint(lambda jet: jet.v, parameters={"v": []}), "parameter 'v'"),
        (lambda: PROGRAMS["affine"](sm.RateBound(1.0)), r"constraints: a list is needed, \[RateBound"),
        (lambda: PROGRAMS["affine"]("floor"), "constraints 'floor': a list of conditions"),
        (lambda: PROGRAMS["affine"](["floor"]), "'floor' is no condition"),
        (lambda: PROGRAMS["affine"]([sm.JetConstraint(lambda jet: jet.w)]), "fails on jets of kind affine 3D"),
        (
            lambda: PROGRAMS["affine"]([sm.JetConstraint(lambda jet: 3.0, name="three")]),
            "three.* of type float",
        ),
        (lambda: PROGRAMS["affine"]([sm.JetConstraint(lambda jet: jet.v, at=9.0)]), r"time 9 is outside .*\[0, 5\]"),
        (
            lambda: PROGRAMS["affine"]([sm.JetConstraint(lambda jet: jet.v, upper=[1.0, 2.0], at=0.5)]),
            r"a bound of shape \(2,\) for values of shape \(3,\)",
        ),
        (lambda: PROGRAMS["orientation"]([sm.constraints.Velocity(0, [0, 0, 0])]), "translation"),
        (lambda: PROGRAMS["pose"]([sm.Tolerance(linear=0.1)]), "give a turn"),
        (lambda: PROGRAMS["affine"]([sm.Tolerance(turn=0.1)]), "give linear"),
        (lambda: PROGRAMS["curve"]([sm.RateBound(1.0)]), "rate"),
        (lambda: sm.join({"a": PROGRAMS["affine"](())}), "two names or more"),
        (lambda: WRONG.join({"a": PROGRAMS["affine"](()), "b": 3}), "programs, 'b': a program"),
        *(
            (lambda n=n: WRONG.join({n: PROGRAMS["affine"](()), "b": PROGRAMS["affine"](())}), "of a body: a text")
            for n in (1, None, "")
        ),
        (lambda: WRONG.orientation_program(TIMES, TURNS, knots_per_interval=2), "knots_per_interval is refine"),
        (lambda: WRONG.orientation_program(TIMES, TURNS, inertia=(1, 2, 2)), r"inertia is objective=Torque\(inertia\)"),
        (lambda: WRONG.affine_program("walk.bvh"), "read_keyframes"),
        (
            lambda: sm.pose_program(TIMES, TURNS, PLACES, objective=sm.Rigidity()),
            "energy R fails on jets of kind pose",
        ),
        (
            lambda: sm.orientation_program(TIMES, TURNS, objective=sm.Rigidity()),
            "energy R fails on jets of kind orientation",
        ),
        (
            lambda: sm.affine_program(sm.examples.planar_keyframes(), objective=sm.Torque((1, 2, 3))),
            "energy torque fails on jets of kind affine 2D",
        ),
        (lambda: WRONG.measure(sm.Rigidity(), KEYS), "the motion comes first"),
        (
            lambda: sm.measure(sm.interpolants.component_cubic(KEYS), BOTH, times=[0.0, 1.0]),
            "times: a AffineMotion knows",
        ),
        (lambda: WRONG.JetConstraint(lambda jet: jet.v, parameters=[("v", 1.0)]), "parameters .*: a mapping of names"),
        (
            lambda: WRONG.JetConstraint(lambda jet: jet.v, parameters={1: 2.0}),
            "parameter 1: a name as of a variable",
        ),
        (lambda: sm.JetConstraint(lambda jet: jet.v, at=np.datetime64("2020-01-01")), "at: dates or durations"),
        (lambda: PROGRAMS["affine"]([sm.JetConstraint(lambda jet: jet.place("abc"))]), "body point: a str is no array"),
        (lambda: WRONG.energies.EnergySum((sm.Rigidity(),)), "sum of energies: Rigidity.*: pairs of a weight"),
        (lambda: WRONG.energies.EnergySum(((1.0, 3),)), r"sum of energies: \(1.0, 3\): pairs of a weight"),
    ],
)
def test_bad_input_names_the_argument(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()


def test_energies_of_any_jet_add_scale_and_subtract():
    energy = 2.0 * sm.Torque() + ORIGIN / 4
    assert energy == sm.Torque() * 2 + 0.25 * sm.TrajectoryEnergy(np.zeros((1, 3)))
    motion = sm.ExactNewton().solve(sm.pose_program(TIMES, TURNS, PLACES, objective=energy)).motion
    parts = sm.measure(motion, sm.Torque()), sm.measure(motion, ORIGIN)
    assert sm.measure(motion, energy) == pytest.approx(2 * parts[0] + parts[1] / 4, rel=1e-12)
    assert sm.measure(motion, energy - ORIGIN / 4) == pytest.approx(2 * parts[0], rel=1e-9)
    assert sm.measure(motion, sm.Torque() - ORIGIN) == pytest.approx(parts[0] - parts[1], rel=1e-9)
    own = sm.JetEnergy(lambda jet: jet.acceleration, squares=True, label="own")
    assert sm.measure(motion, own) == pytest.approx(parts[0], rel=1e-10)
    written = sm.JetEnergy(lambda jet: ca.sumsqr(jet.acceleration_of([0.0, 0.0, 0.0])))
    assert sm.measure(motion, written) == pytest.approx(parts[1], rel=1e-9)
    mixed = sm.ExactNewton().solve(sm.pose_program(TIMES, TURNS, PLACES, objective=own + written)).require(1e-7)
    plain = sm.ExactNewton().solve(sm.pose_program(TIMES, TURNS, PLACES)).require()
    assert mixed.objective == pytest.approx(plain.objective, rel=1e-8)


def test_a_frozen_dataclass_with_arrays_is_an_energy_and_a_constraint():
    from dataclasses import dataclass

    @dataclass(frozen=True)
    class Pull(sm.energies.Energy):
        towards: np.ndarray

        def residuals(self, jet):
            return jet.v - self.towards

    @dataclass(frozen=True)
    class Through(sm.constraints.MotionConstraint):
        place: np.ndarray
        name: str = "through"

        def stated(self, setting):
            return sm.JetConstraint(lambda jet: jet.v - self.place, at=0.5, name=self.name)

    program = sm.affine_program(KEYS, objective=BOTH + Pull(np.zeros(3)), constraints=[Through(np.ones(3))])
    solution = sm.ExactNewton().solve(program).require()
    np.testing.assert_allclose(solution.motion(0.5).translation, 1.0, atol=1e-9)
