"""Constraints that users write: names, bounds, parameters, and what the doors say where they go wrong."""

import pickle
from dataclasses import dataclass, field, replace
from typing import Any, cast

import casadi as ca
import numpy as np
import pytest

import symmotion as sm
from symmotion.motions import noisy_net, smooth_net

KEYS = sm.examples.random_keyframes(4, 60, seed=1)
OBJECTIVE = sm.Rigidity() + 0.01 * sm.TrajectoryEnergy(np.eye(3))
NET = noisy_net(smooth_net(9), 0.018, seed=1)
CURVE = NET.isoparametric(u=5.0)
C = sm.constraints
J = sm.JetConstraint


def program(*constraints):
    return sm.affine_program(KEYS, objective=OBJECTIVE, constraints=cast(Any, constraints))


def net(*constraints, of: Any = NET):
    return sm.fairing.fairing_program(of, constraints=constraints)


@dataclass(frozen=True, eq=False)
class Slow(C.MotionConstraint):
    """v̇₀ = speed at a time; the statement says nothing of a name."""

    time: float
    speed: float
    name: str = "slow"

    def stated(self, setting):
        return J(lambda jet: jet.dv[0] - self.speed, at=self.time)


@dataclass(frozen=True, eq=False)
class Told(C.MotionConstraint):
    """What `stated` and `frees` do, as told."""

    statement: Any
    freed_keyframes: Any = ((), ())
    name: Any = "told"

    def frees(self, setting):
        return self.freed_keyframes

    def stated(self, setting):
        return self.statement()


class Bare(C.MotionConstraint):
    name = "bare"

    def stated(self, setting):
        return J(lambda jet: jet.dv, at=0.5)


def test_a_condition_keeps_its_own_name():
    solution = sm.ExactNewton().solve(program(Slow(0.5, 0.1, "a"), Slow(1.5, 0.2, "b"), Slow(2.5, 0.3, "b"))).require()
    assert list(solution.multipliers) == ["keyframes", "a", "b", "b (2)"]
    speeds = [solution.motion(t, 1).translation[0] for t in (0.5, 1.5, 2.5)]
    np.testing.assert_allclose(speeds, [0.1, 0.2, 0.3], atol=1e-9)


def test_a_parameter_named_self_is_one():
    p = program(J(lambda jet, p: jet.dv[0] - p.self, at=1.5, parameters={"self": 0.1})).with_parameters(self=0.2)
    assert sm.ExactNewton().solve(p).require(1e-6).motion(1.5, 1).translation[0] == pytest.approx(0.2, abs=1e-9)


def test_a_net_of_one_parameter_has_derivatives_by_that():
    p = net(J(lambda jet: ca.vertcat(jet.du, jet.duu, jet.partial(3, 0)), at=5.0, lower=-99, upper=99), of=CURVE)
    assert p.constraints[-1].lower.size == 3 * p.start["controls"].shape[1]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: program(Told(lambda: {}["k"])), "told: stated fails on this program: KeyError: 'k'"),
        (lambda: program(Told(lambda: None)), "told: stated returns a NoneType: a JetConstraint is needed"),
        (lambda: program(Told(None, ({99}, ()))), "told: frees: keyframe 99 does not exist: there are 4"),
        (lambda: program(Told(None, None)), "told: frees fails on this program: TypeError"),
        (lambda: program(Told(None, name=3)), "name of the Told 3: a text is needed"),
        (lambda: program(Bare()), "constraint Bare: a dataclass with a field `name` is needed"),
        (lambda: J(abs, parameters={"class": 1.0}), "constraint: parameter 'class': a name as of a variable"),
        (lambda: J(abs, parameters={"a b": 1.0}), "parameter 'a b': a name as of a variable"),
        (lambda: J(abs, parameters=cast(Any, {1: 1.0})), "parameter 1: a name as of a variable"),
        (
            lambda: J(abs, parameters=cast(Any, [("v", 1.0)])),
            "constraint: parameters .*: a mapping of names to numbers",
        ),
        (
            lambda: J(abs, lower=[0, 0, np.inf], upper=np.inf),
            r"lower\[2\] is inf: nothing .* bound is -inf",
        ),
        (lambda: J(abs, lower=-np.inf, upper=[1, -np.inf]), r"constraint: upper\[1\] is -inf: nothing"),
        (
            lambda: C.CurveCondition.between([0.0, 1.0], [0.0, np.inf], np.inf),
            r"bounds on values: lower\[1\] is inf",
        ),
        (lambda: C.CurveCondition.at([0.5], [0.0], name=cast(Any, 3)), "name of a condition 3: a text is needed"),
        (lambda: sm.JetEnergy(abs, label=cast(Any, None)), "label None: a text is needed"),
        (lambda: C.CurveCondition.at("x", [0.0]), "values: times: a str is no array of numbers"),
        (lambda: C.CurveCondition.at([0.5], [0.0], order=cast(Any, "x")), "derivative order 'x': a whole number"),
        (lambda: C.CurveCondition.at([0.5], [0.0], tolerance=cast(Any, "x")), "values: tolerance 'x': a finite number"),
        (lambda: sm.Tolerance(linear=cast(Any, [0.1, 0.2])), "tolerance: linear .* a positive number is needed"),
        (lambda: sm.Tolerance(turn=[[0.1]]), r"tolerance: turn of shape \(1, 1\)"),
        (lambda: program(sm.SpeedBound(np.eye(3), cast(Any, "x"))), "speed: limit 'x': a positive number is needed"),
        (lambda: sm.JetEnergy(abs, label=""), "label '': a text is needed"),
        (lambda: sm.Rigidity(True), "rigidity of order True"),
        (lambda: sm.TrajectoryEnergy("abc"), "body points: a str is no array of numbers"),
        (lambda: program(C.NoInversion(0.1, density=cast(Any, 2.5))), "no inversion: density 2.5: a whole number"),
        (lambda: program(sm.SpeedBound(np.eye(3), 9.0, density=cast(Any, 2.5))), "speed: density 2.5: a whole number"),
        (lambda: net(J(lambda jet: jet.d, at=[(99.0, 5.0)], name="far")), "far: parameter u = 99 is outside"),
        (lambda: net(J(lambda jet: jet.d, at=5.0, name="one")), r"one: parameters of shape .* \(N, 2\) is needed"),
        (lambda: net(J(lambda jet: jet.dv, at=5.0, name="c"), of=CURVE), "one parameter u has no derivative by v"),
        (
            lambda: net(sm.constraints.Velocity(0, [0, 0, 0])),
            "velocity is about keyframe 0, and this program has no keyframes",
        ),
    ],
)
def test_what_is_wrong_is_said_with_the_name(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()


@pytest.mark.parametrize(
    "constraint",
    [
        sm.constraints.Velocity(0, [0, 0, 0]),
        C.OnLine(1, [0, 0, 1]),
        sm.SpeedBound(np.eye(3), 1.0),
        sm.Tolerance(translation=0.1),
    ],
    ids=lambda c: c.name,
)
def test_an_orientation_has_no_translation_to_constrain(constraint):
    with pytest.raises(sm.InputError, match=f"{constraint.name} is about the translation, and an orientation has none"):
        sm.orientation_program(KEYS, constraints=[constraint])


def refused(jet):
    raise sm.InputError("no motion is good enough")


REFUSED: Any = refused  # what a type checker would refuse


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: program(J(lambda jet: jet.place([1, 2]), name="a")), r"^a: body point of shape \(2,\)"),
        (lambda: program(J(refused, name="mine")), "^mine: no motion is good enough"),
        (lambda: program(Told(lambda: sm.Tolerance(linear=-1.0))), "^told: tolerance: linear"),
        (
            lambda: sm.affine_program(KEYS, objective=sm.JetEnergy(REFUSED, label="mine")),
            "^energy mine: no motion",
        ),
        (
            lambda: sm.measure(sm.interpolants.polar_blend(KEYS), sm.JetEnergy(REFUSED)),
            "^energy custom: no motion",
        ),
        (
            lambda: sm.affine_program(KEYS, objective=sm.JetEnergy(cast(Any, lambda _: None))),
            "^energy custom returns None",
        ),
        (lambda: pickle.dumps(J(refused, name="mine")), "^mine: no motion is good enough"),
        (lambda: pickle.dumps(J(lambda a, b, c: a.v - b.dv * c.x, name="three")), "^three: the function fails on jets"),
        (lambda: pickle.dumps(sm.JetEnergy(lambda jet: jet.nothing)), "^energy custom fails on jets of every kind"),
    ],
)
def test_what_a_function_refuses_is_said_with_the_name_of_its_owner(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()


@dataclass(frozen=True, eq=False)
class Own(sm.JetConstraint):
    """A class whose `__post_init__` calls none of its base's."""

    numbers: np.ndarray = field(default_factory=lambda: np.array([0.1, 0.2]), kw_only=True)

    def __post_init__(self):
        object.__setattr__(self, "total", float(self.numbers.sum()))


@dataclass(frozen=True)  # its == would compare arrays in tuples
class OwnEnergy(sm.energies.Energy):
    wind: np.ndarray

    def __post_init__(self):
        object.__setattr__(self, "strength", float(self.wind.sum()))

    def residuals(self, jet):
        return cast(Any, self).strength * (jet.dv - ca.DM(self.wind))


CONSTRAINTS = {
    "plain": J(lambda jet: jet.place([0.1, 0, 0])[2], upper=np.inf, name="floor"),
    "parameters": J(lambda jet, p: jet.dv - p.v, at=1.5, parameters={"v": [0.1, 0, 0]}),
    "data": J(lambda jet, row: jet.v[0] - row, at=[0.5, 1.5], data=[[0.1], [0.2]]),
    "times": J(lambda a, b: a.dA - b.dA, at=[(0.5, 1.5)]),
    "bodies": J(lambda a, b: ca.sumsqr(a.place([0.1, 0, 0]) - b.place([0, 0, 0])) - 1, at=1.5, name="rod"),
    "own class": Own(lambda jet: jet.dv, at=[0.5]),
}


@pytest.mark.parametrize("constraint", CONSTRAINTS.values(), ids=CONSTRAINTS)
def test_a_constraint_that_was_pickled_equals_its_original(constraint):
    copy = pickle.loads(pickle.dumps(constraint))
    assert copy == constraint and constraint == copy and type(copy) is type(constraint)
    assert copy == pickle.loads(pickle.dumps(copy))
    assert copy != constraint.named("another")
    other = replace(constraint, function=lambda *given: 2 * constraint.function(*given))
    assert copy != other and constraint != other


def test_functions_of_one_text_are_the_same_constraint_and_energy():
    def floor(height):
        return J(lambda jet: jet.v[2] - height, upper=np.inf)

    def drift(speed):
        return sm.JetEnergy(lambda jet: jet.dv - speed, squares=True)

    assert floor(0.2) == floor(0.2) and floor(0.2) != floor(0.3)
    assert drift(1.0) == drift(1.0) == pickle.loads(pickle.dumps(drift(1.0))) and drift(1.0) != drift(2.0)


def test_a_coupling_constraint_is_joined_after_a_journey():
    rod = pickle.loads(pickle.dumps(CONSTRAINTS["bodies"]))
    body = sm.pose_program(KEYS, degree=3)
    # The two bodies are the same one, at a distance of 0.1 from itself: 0.01 − 1.
    joined = sm.join({"a": body, "b": body}, [rod])
    assert sm.program.Evaluator(joined).violation(joined.x0)[-1] == pytest.approx(-0.99)


def test_a_post_init_of_ones_own_needs_no_call_of_the_base():
    wind, numbers = np.array([0.0, 0.0, 1.0]), np.array([0.1])
    energy, constraint = OwnEnergy(wind), Own(lambda jet: jet.dv[0], lower=[-1.0], at=[0.5], numbers=numbers)
    wind[:], numbers[:] = 9, 9
    assert energy.wind[2] == 1 and cast(Any, energy).strength == 1 and not energy.wind.flags.writeable
    assert constraint.numbers[0] == 0.1 and isinstance(constraint.at, np.ndarray)
    assert pickle.loads(pickle.dumps(energy)) == energy != OwnEnergy(np.ones(3))
    solution = sm.ExactNewton().solve(program(replace(constraint, lower=0.0, name="still"))).require()
    assert list(solution.multipliers) == ["keyframes", "still"]
    with pytest.raises(sm.InputError, match="constraint: the lower bound is above the upper one"):
        Own(lambda jet: jet.dv, lower=2.0, upper=1.0)


@pytest.mark.parametrize("function", [lambda jet: jet.v, lambda jet: jet.dv[0] + jet.A[0, 0]], ids=["place", "mixed"])
def test_a_translation_that_the_objective_leaves_alone_is_no_condition(function):
    """R alone has no translation among its unknowns: a raw error of shapes came of that."""
    high = sm.JetConstraint(function, lower=-np.inf, upper=9.0, at=0.5, name="high")
    with pytest.raises(sm.InputError, match="high: depends on the translation, which the objective does not see"):
        sm.affine_program(sm.examples.random_keyframes(4, 60, 1), objective=sm.Rigidity(), constraints=[high])
