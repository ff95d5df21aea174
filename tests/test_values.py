"""Energies, constraints, motions and curves are values: nobody writes into them, equal where their contents are."""

import copy
import pickle
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from types import ModuleType
from typing import Any

import casadi as ca
import numpy as np
import pytest
from movements import CURVES, MOTIONS

import symmotion as sm
from symmotion.energies import Energy
from symmotion.values import same, same_fields

KEYS = sm.examples.random_keyframes(4, 60, seed=1)
C = sm.constraints


@dataclass(frozen=True, eq=False)
class Drift(Energy):
    wind: np.ndarray

    def residuals(self, jet):
        return jet.dv - ca.DM(self.wind)


@dataclass(frozen=True)
class Plain(Energy):
    wind: np.ndarray

    def residuals(self, jet):
        return jet.dv - ca.DM(self.wind)


# Each makes its value of arrays that it is handed: a vector, a matrix of three rows, a pair of them.
MADE: dict[str, Any] = {
    "Rigidity": lambda v, m, p: sm.Rigidity(1, m, np.abs(m)),
    "TrajectoryEnergy": lambda v, m, p: sm.TrajectoryEnergy(m, v),
    "Torque": lambda v, m, p: sm.Torque(v),
    "StrainRate": lambda v, m, p: sm.StrainRate(),
    "StrainAcceleration": lambda v, m, p: sm.StrainAcceleration(),
    "Bending": lambda v, m, p: sm.energies.Bending(),
    "Roughness": lambda v, m, p: sm.energies.Roughness(1.0, 0.5),
    "SideSlip": lambda v, m, p: sm.energies.SideSlip(v, m[0]),
    "JetEnergy": lambda v, m, p: sm.JetEnergy(abs),
    "EnergySum": lambda v, m, p: sm.TrajectoryEnergy(m, v) + 2 * Drift(v),
    "JetConstraint": lambda v, m, p: sm.JetConstraint(
        abs, lower=-v, upper=v, at=v, data=m, parameters={"v": v, "m": m}
    ),
    "Velocity": lambda v, m, p: sm.constraints.Velocity(0, v),
    "AngularRate": lambda v, m, p: C.AngularRate(0, v),
    "EndRates": lambda v, m, p: C.EndRates((p, p)),
    "EndAccelerations": lambda v, m, p: C.EndAccelerations(p),
    "Periodic": lambda v, m, p: C.Periodic(),
    "OnLine": lambda v, m, p: C.OnLine(0, v),
    "Tolerance": lambda v, m, p: sm.Tolerance(turn=v, keyframes=[0, 1, 2]),
    "ExactSamples": lambda v, m, p: C.ExactSamples(v.astype(int)),
    "UnitVolume": lambda v, m, p: C.UnitVolume(v),
    "NoInversion": lambda v, m, p: C.NoInversion(0.1),
    "SpeedBound": lambda v, m, p: sm.SpeedBound(m, 1.0),
    "RateBound": lambda v, m, p: sm.RateBound(1.0),
    "AccelerationBound": lambda v, m, p: C.AccelerationBound(1.0),
    "TorqueBound": lambda v, m, p: C.TorqueBound(1.0, v),
    "CurveCondition": lambda v, m, p: C.CurveCondition.between(v, -m, m),
}
VALUES = {**MADE, **{k: lambda *_, value=value: value for k, value in {**MOTIONS, **CURVES}.items()}}


def arrays_of() -> list[np.ndarray]:
    return [np.array([1.0, 1.5, 2.0]), np.eye(3), np.ones((2, 3))]


def arrays_in(content: object) -> Iterator[np.ndarray]:
    if isinstance(content, np.ndarray):
        yield content
    elif isinstance(content, tuple | list):
        for entry in content:
            yield from arrays_in(entry)
    elif isinstance(content, Mapping):
        yield from arrays_in(tuple(content.values()))
    elif is_dataclass(content):
        yield from arrays_in(tuple(getattr(content, f.name) for f in fields(content)))


def test_all_public_energies_and_constraints_are_walked_over():
    public = [getattr(room, name) for room in (sm.energies, C) for name in room.__all__]
    classes = {c.__name__ for c in public if isinstance(c, type) and issubclass(c, Energy | C.MotionConstraint)}
    assert classes - {"Energy", "MotionConstraint"} == set(MADE)


@pytest.mark.parametrize("name", VALUES)
def test_nobody_writes_into_a_value(name):
    given = arrays_of()
    for array in given:  # an owner's own flag is no promise
        array.flags.writeable = False
    value = VALUES[name](*given)
    before = [a.copy() for a in arrays_in(value)]
    for array in given:
        array.flags.writeable = True
        array[...] = 7.0
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(arrays_in(value), before, strict=True))
    assert not any(a.flags.writeable for a in arrays_in(value))
    for array in arrays_in(value):
        with pytest.raises(ValueError, match="WRITEABLE"):
            array.flags.writeable = True
    assert not any(a.flags.writeable for a in arrays_in(copy.copy(value)))
    if name not in ("JetEnergy", "JetConstraint"):  # a pickle of these needs a function of jets
        there = pickle.loads(pickle.dumps(value))
        assert same_fields(there, value) and not any(a.flags.writeable for a in arrays_in(there))


@pytest.mark.parametrize("name", VALUES)
def test_equal_where_the_contents_are(name):
    value = VALUES[name](*arrays_of())
    assert value == VALUES[name](*arrays_of())
    assert copy.copy(value) == value and copy.deepcopy(value) == value
    other = [np.array([1.0, 2.5, 2.25]), 2 * np.eye(3), np.zeros((2, 3))]
    if any(True for _ in arrays_in(value)) and name in MADE:
        assert value != VALUES[name](*other)


def test_lists_of_arrays_and_parameters_compare():
    rates = [np.zeros((2, 3, 3)), np.zeros((2, 3))]
    assert C.EndRates(rates) == C.EndRates([r.copy() for r in rates]) != C.EndRates([r + 1 for r in rates])
    first, second, third = (sm.JetConstraint(abs, parameters={"v": v}) for v in ([1.0, 2.0], [1.0, 2.0], [1.0, 3.0]))
    assert first == second != third


def test_equal_energies_of_a_plain_dataclass_are_subtracted():
    wind = np.array([0.0, 0.0, 1.0])
    left = sm.Rigidity() + Plain(wind) - 0.5 * Plain(wind.copy())
    assert [w for w, _ in left.parts] == [1.0, 0.5]
    assert same(left, sm.Rigidity() + 0.5 * Plain(wind)) and not same(Plain(wind), Plain(2 * wind))


def test_no_kernel_outlives_what_its_energy_says():
    wind = np.array([0.0, 0.0, 1.0])
    motion = sm.affine_program(KEYS).design.motion(sm.affine_program(KEYS).start)
    energy = sm.JetEnergy(lambda jet: jet.dv - ca.DM(wind), squares=True)
    assert sm.measure(motion, energy) == pytest.approx(sm.measure(motion, Drift(wind)), rel=1e-12)
    wind[:] = 3.0
    assert sm.measure(motion, energy) == pytest.approx(sm.measure(motion, Drift(wind)), rel=1e-12)


Q = np.array([[1.0, 0, 0, 0], [0.6, 0.8, 0, 0], [0.6, 0, 0.8, 0]])
MOVES = sm.interpolants.component_cubic(sm.examples.spatial_keyframes())
# Constructors of the other classes that are made of a caller's arrays: the arrays, and what makes the value of them.
GIVEN: dict[str, tuple[list[np.ndarray], Any]] = {
    "Keyframes": ([np.arange(3.0), np.tile(np.eye(3), (3, 1, 1)), np.ones((3, 3))], sm.Keyframes),
    "AffineMotion": ([], None),  # of splines, below
    "BSplineBasis": ([np.array([0.0, 0, 1, 2, 2])], lambda k: sm.splines.BSplineBasis(k, 1)),
    "Spline": ([np.ones((3, 2))], lambda c: sm.splines.Spline(sm.splines.BSplineBasis.clamped([0.0, 1, 2], 1), c)),
    "DualQuaternions": ([Q.copy(), np.zeros((3, 4))], sm.motions.DualQuaternions),
    "OrientationKeys": (
        [np.arange(3.0), Q.copy()],
        lambda t, q: sm.quaternions.OrientationKeys.of(t, q, None, "align"),
    ),
    "QuaternionMotion": ([], None),
    "CumulativeBasis": (
        [np.array([0.0, 1.0]), np.ones((2, 1))],
        lambda f, w: sm.splines.CumulativeBasis(sm.splines.BSplineBasis.clamped([0.0, 1, 2], 1), f, w),
    ),
    "ProductMotion": (
        [Q[0].copy(), np.ones((1, 3))],
        lambda q, w: sm.quaternions.ProductMotion(
            sm.splines.CumulativeBasis.of(sm.splines.BSplineBasis.clamped([0.0, 1], 1)), q, w
        ),
    ),
    "RationalMotion": ([], None),
    "TwoParameterMotion": ([], None),
    "RationalQuadratic": ([np.array([[0.0, 0], [1, 1], [2, 0]])], lambda c: sm.curves.RationalQuadratic(c, 0.5)),
    "PointPath": ([np.ones(3)], lambda p: sm.motions.PointPath(MOVES, p)),
    "Guess": ([np.ones(3), np.zeros(2)], sm.solvers.Guess),
    "Mesh": ([np.eye(3), np.array([[0, 1, 2]])], sm.bodies.Mesh),
    "NetPlace": ([np.zeros(3), np.ones(3)], lambda p, x: sm.fairing.NetPlace((0.5, 0.5), p, x)),
}
# What the library makes, of arrays of its own, and parts of programs, which are sent and shared as they are.
OWN = {
    "Band", "Block", "Body", "CharacteristicCurve", "Constraint", "Curvature", "FairingPath", "FairingResult",
    "FitCovariance", "HessianTriangle", "Inspection", "Integral", "Metric", "MovingEllipsoid", "Pattern", "Program",
    "PosedSkeleton", "RigidSamples", "SegmentCurve", "Sensitivity", "Setting", "Skeleton", "Solution", "SweepSurface",
    "SweptVolume", "Target", "TimePrices", "ToolPath", "Travelling",
}  # fmt: skip


def test_every_public_class_that_is_made_of_arrays_is_walked_over():
    rooms = [room for room in (getattr(sm, name) for name in dir(sm)) if isinstance(room, ModuleType)]
    public = [value for room in rooms for value in (getattr(room, n, None) for n in getattr(room, "__all__", ()))]
    held = {
        c.__name__
        for c in public
        if isinstance(c, type) and is_dataclass(c) and any("array" in str(f.type).lower() for f in fields(c))
    }
    assert held <= {*MADE, *GIVEN, *OWN}


@pytest.mark.parametrize("name", [name for name, (arrays, _) in GIVEN.items() if arrays])
def test_arrays_of_the_caller_are_copied(name):
    arrays, make = GIVEN[name]
    arrays = [a.copy() for a in arrays]
    value = make(*arrays)
    before = [a.copy() for a in arrays_in(value)]
    assert before
    for array in arrays:
        array[...] = 7
    assert all(np.array_equal(a, b) for a, b in zip(arrays_in(value), before, strict=True))
