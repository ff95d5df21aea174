"""At the prompt everything reads in a line or a few: no addresses, no arrays written out, no functions in brackets."""

import enum
import inspect
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import Any, cast

import numpy as np
import pytest
from movements import ALONG, CURVES, MOTIONS, NET, RIGID

import symmotion as sm
from symmotion.brief import brief, instants
from symmotion.files.skeleton import Joint
from symmotion.jets.nets import NetSpace
from symmotion.motions.nets import noisy_net
from symmotion.smoothing import plan

C, F, R = sm.constraints, sm.fairing, sm.report
RNG = np.random.default_rng(0)
KEYS = sm.examples.planar_keyframes()
MANY = RNG.normal(size=(300, 3))
NEWTON = sm.ExactNewton(kernels="interpreted")
SPEEDY = [sm.SpeedBound([[0.0, 0.0]], 25.0)]
NET_MOTION = noisy_net(NET, 0.02, translation=0.05, seed=1)


@cache
def solved() -> sm.Solution:
    objective = sm.Rigidity() + 0.01 * sm.TrajectoryEnergy(np.eye(2))
    return NEWTON.solve(sm.affine_program(KEYS, objective=objective, constraints=SPEEDY))


@cache
def plain() -> sm.Solution:
    return NEWTON.solve(sm.affine_program(KEYS))


@cache
def fitted() -> sm.Solution:
    return NEWTON.solve(sm.fit_program(sm.examples.recorded_tour(40), controls=8))


def posed() -> sm.files.PosedSkeleton:
    places = np.stack([MANY[:50], 2 * MANY[:50]])
    names, turns = tuple(f"joint {k}" for k in range(50)), np.tile(np.eye(3), (2, 50, 1, 1))
    return sm.files.PosedSkeleton(names, [-1] * 50, np.array([0.0, 1.0]), turns, places, MANY[:50])


@cache
def evaluator() -> sm.program.Evaluator:
    return sm.program.Evaluator(plain().program, "interpreted")


def jet_of(program: Any) -> object:
    return program.design.setting.space.symbols()


def swept() -> sm.sweeps.MovingEllipsoid:
    start = sm.affine_program(sm.examples.spatial_keyframes())
    return sm.sweeps.MovingEllipsoid(start.design.motion(start.start), (0.3, 0.4, 0.5))


@dataclass(frozen=True, eq=False)
class Drift(sm.energies.Energy):
    wind: np.ndarray


@dataclass(frozen=True, eq=False)
class Above(sm.constraints.MotionConstraint):
    height: np.ndarray
    name: str = "above"

    def stated(self, setting: sm.constraints.Setting) -> sm.JetConstraint:
        return sm.JetConstraint(lambda jet: jet.v, name=self.name)


def figure() -> sm.report.Figure:
    return R.Figure("drawn", f"<svg>{'x' * 5000}</svg>", "A picture.")


def table() -> sm.report.Table:
    return R.Table("optima", (R.Column("case"), R.Column("R")), tuple((f"{i}", 1.0 / (1 + i)) for i in range(100)))


def result() -> sm.report.StudyResult:
    return R.StudyResult((table(),), (figure(),), conclusion="So it is.")


# An instance of every public class, by the name of the class.
MADE: dict[str, Callable[[], object]] = {
    # Programs, solutions, what is asked of them.
    "Program": lambda: solved().program,
    "Solution": solved,
    "Comparison": lambda: sm.compare(sm.affine_program(KEYS), [NEWTON, sm.Ipopt()]),
    "Certificate": lambda: solved().certificate,
    "Course": lambda: solved().exchange,
    "Round": lambda: cast(Any, solved()).exchange.rounds[0],
    "Iteration": lambda: plain().log[-1],
    "Seconds": lambda: plain().seconds,
    "Status": lambda: plain().status,
    "Sensitivity": lambda: plain().sensitivity(),
    "Journal": lambda: sm.solvers.Journal(10),
    "Guess": lambda: sm.solvers.Guess(np.zeros(36), np.zeros(16)),
    "ExactNewton": sm.ExactNewton,
    "Ipopt": sm.Ipopt,
    "PlainIpopt": sm.solvers.PlainIpopt,
    "Elimination": sm.Elimination,
    "Band": lambda: sm.answers.fit_covariance(fitted()).band(50),
    "Exploration": lambda: sm.explore(sm.affine_program(KEYS), budget=2),
    "FitCovariance": lambda: sm.answers.fit_covariance(fitted()),
    "KeyframePrices": lambda: sm.answers.keyframe_prices(plain()),
    "KnotSearch": lambda: sm.answers.auto_knots(KEYS, objective=sm.Rigidity(), budget=2, solver=NEWTON),
    "LowerBound": lambda: sm.lower_bound(
        sm.affine_program(sm.examples.quarter_turn(), degree=2, refine=0, objective=sm.Rigidity(order=2))
    ),
    "TimePrices": lambda: sm.answers.time_prices(plain()),
    "Failed": lambda: sm.batches.Failed(3, "ValueError", "no such thing"),
    "Tally": lambda: sm.batches.Tally(3, 1, 0, 2.0),
    # What programs are made of.
    "ArrayFunction": lambda: sm.kernels.ArrayFunction.of(plain().program.terms[0].kernel.function("value")),
    "Block": lambda: plain().program.terms[0],
    "BlockEvaluator": lambda: sm.program.BlockEvaluator(plain().program.terms[0]),
    "Bounded": lambda: sm.program.Bounded(solved().program),
    "Constraint": lambda: solved().program.constraint("speed"),
    "Evaluator": evaluator,
    "Excess": lambda: solved().certificate.excess["speed"],
    "ParameterPlace": lambda: sm.program.ParameterPlace("v", 0, (3,)),
    "Pattern": lambda: sm.systems.HessianTriangle.of(plain().program).pattern,
    "Quadrature": lambda: plain().quadratures["R"],
    "Target": lambda: plain().program.design.targets(plain().program)["keyframes"].places[0],
    "Targets": lambda: plain().program.design.targets(plain().program)["keyframes"],
    "Kernel": lambda: plain().program.terms[0].kernel,
    "Mapped": lambda: sm.kernels.Mapped(plain().program.terms[0].kernel.function("value"), 8),
    "Condensed": lambda: sm.systems.Condensed.of(plain().program),
    "Curvature": lambda: sm.systems.Curvature("indefinite", np.ones(300)),
    "HessianTriangle": lambda: sm.systems.HessianTriangle.of(plain().program),
    "Inspection": lambda: sm.systems.Inspection(plain().program, evaluator(), plain().x, plain().multiplier_vector),
    "Saddle": lambda: sm.systems.Saddle(plain().program, evaluator().jacobian(plain().x)),
    # Energies and constraints, and one of a user's own.
    "Bending": sm.energies.Bending,
    "EnergySum": lambda: sm.Rigidity() + 0.1 * sm.TrajectoryEnergy(MANY),
    "JetEnergy": lambda: sm.JetEnergy(lambda jet: jet.ddv, squares=True),
    "Rigidity": lambda: sm.Rigidity(2, MANY.T, np.ones((300, 300))),
    "Roughness": lambda: sm.energies.Roughness(1.0, 2.0, (3, 2)),
    "SideSlip": lambda: sm.energies.SideSlip(np.array([1.0, 0.0, 0.0]), np.ones(3)),
    "StrainAcceleration": sm.StrainAcceleration,
    "StrainRate": sm.StrainRate,
    "Torque": lambda: sm.Torque([1.0, 2.0, 2.5]),
    "TrajectoryEnergy": lambda: sm.TrajectoryEnergy(MANY, np.ones(300)),
    "Drift": lambda: Drift(MANY),
    "Above": lambda: Above(MANY),
    "AccelerationBound": lambda: C.AccelerationBound(2.0),
    "AngularRate": lambda: C.AngularRate(1, [0.0, 0.0, 1.0]),
    "CurveCondition": lambda: C.CurveCondition.at(np.arange(300.0), MANY),
    "EndAccelerations": lambda: C.EndAccelerations(np.zeros((2, 3))),
    "EndRates": lambda: C.EndRates(sm.Affine(np.zeros((2, 3, 3)), np.zeros((2, 3)))),
    "ExactSamples": lambda: C.ExactSamples(range(100)),
    "JetConstraint": lambda: sm.JetConstraint(
        lambda jet, p: jet.v - p.a, lower=-np.ones(3), upper=1.0, at=np.arange(300.0), parameters={"a": np.eye(3)[0]}
    ),
    "NoInversion": lambda: C.NoInversion(0.1),
    "OnLine": lambda: C.OnLine(1, [1.0, 0.0, 0.0]),
    "Periodic": C.Periodic,
    "RateBound": lambda: C.RateBound(2.0),
    "Setting": lambda: plain().program.design.setting,
    "SpeedBound": lambda: sm.SpeedBound(MANY, 2.0),
    "Tolerance": lambda: C.Tolerance(turn=np.full(300, 0.1)),
    "TorqueBound": lambda: C.TorqueBound(1.0, np.diag([1.0, 2.0, 2.5])),
    "UnitVolume": lambda: C.UnitVolume(np.arange(300.0)),
    "Velocity": lambda: C.Velocity(0, [1.0, 2.0, 3.0]),
    "Jet": lambda: jet_of(plain().program),
    "RigidJet": lambda: jet_of(sm.orientation_program(RIGID)),
    "CurveJet": lambda: jet_of(sm.curve_program(KEYS)),
    "NetJet": lambda: NetSpace(NET.bases, 8).symbols(),
    "Written": lambda: sm.jets.Written.of(lambda jet: jet.v),
    # Motions and curves.
    "Affine": lambda: plain().motion(np.linspace(0, 1, 300)),
    "AffineMotion": lambda: MOTIONS["affine"],
    "CurveMotion": lambda: sm.motions.CurveMotion(NET, ALONG),
    "DualQuaternions": lambda: NET.control_displacements,
    "Keyframe": lambda: KEYS[1],
    "Keyframes": lambda: KEYS,
    "OrientationKeys": lambda: sm.quaternions.OrientationKeys.of(RIGID),
    "PoseMotion": lambda: MOTIONS["pose"],
    "QuaternionMotion": lambda: MOTIONS["quaternion"],
    "ProductMotion": lambda: MOTIONS["product in the world"],
    "PointPath": lambda: CURVES["path of a point"],
    "RationalMotion": lambda: MOTIONS["rational"],
    "RelativeMotion": lambda: MOTIONS["seen from another"],
    "RetimedMotion": lambda: MOTIONS["at other times"],
    "SequentialMotion": lambda: MOTIONS["one after the other"],
    "RigidSamples": lambda: sm.motions.orthonormalise(MOTIONS["affine in the plane"], np.linspace(0.0, 0.1, 50)),
    "SegmentCurve": lambda: MOTIONS["squad"],
    "TwoParameterMotion": lambda: NET,
    "ArcParameter": lambda: CURVES["constant speed"].warp,
    "RationalQuadratic": lambda: CURVES["rational quadratic"],
    "Retimed": lambda: CURVES["retimed"],
    "SymbolicSpline": lambda: sm.curves.SymbolicSpline(np.arange(304.0), MANY, 3),
    "BSplineBasis": lambda: plain().motion.basis,
    "CumulativeBasis": lambda: MOTIONS["product of turns"].functions,
    "Integral": lambda: sm.splines.integrate(lambda t: t, np.arange(300.0), np.arange(300.0) + 1, 1e-9),
    "Spline": lambda: CURVES["spline"],
    # Nets, bodies, sweeps.
    "Continued": lambda: F.Continued(NET),
    "Coordinates": lambda: F.Coordinates.of(NET),
    "FairingPath": lambda: F.fairing_path(NET_MOTION),
    "FairingResult": lambda: F.fair(NET_MOTION, "least-squares"),
    "FairingStatus": lambda: F.FairingStatus.CAP,
    "Jumps": lambda: F.Jumps.of(NET.bases),
    "Metric": lambda: F.Metric.of((6, 6, 8), np.ones((6, 6)), np.eye(8)),
    "NetKeyframe": lambda: F.NetKeyframe((4.0, 4.0), sm.Affine(np.eye(3), np.ones(3))),
    "NetPlace": lambda: F.NetPlace((4.0, 4.0), np.zeros(3), np.ones(3)),
    "StepTables": lambda: F.StepTables(F.Jumps.of(NET.bases), "nine"),
    "Body": lambda: sm.bodies.Body.of(None, 3),
    "Mesh": lambda: sm.bodies.Mesh(np.eye(3), np.array([[0, 1, 2]])),
    "CharacteristicCurve": lambda: sm.sweeps.characteristic_curves(swept(), 0.5)[0],
    "Estimate": lambda: sm.sweeps.Estimate(1.0, 0.1),
    "MovingEllipsoid": swept,
    "SweepSurface": lambda: sm.sweeps.sweep_surface(MOTIONS["affine"], CURVES["spline"]),
    "SweptVolume": lambda: sm.sweeps.swept_volume(swept(), slices=6, divisions=6),
    # Files and reports.
    "Format": lambda: sm.files.FORMATS[0],
    "Option": lambda: sm.files.FORMATS[0].reading[0],
    "Recording": lambda: sm.files.Recording(KEYS, ("2 of 6 rows are left out",)),
    "AffineFit": lambda: posed().affine_keyframes(),
    "PosedSkeleton": posed,
    "Skeleton": lambda: sm.files.Skeleton((Joint("root", -1, np.zeros(3), ("Xrotation",)),), np.zeros((200, 1)), 0.01),
    "ToolPath": lambda: sm.files.ToolPath(np.zeros(36), np.zeros(36), NET.control_displacements),
    "Column": lambda: R.Column("objective"),
    "Figure": figure,
    "Player": lambda: R.player("turns", {"motion": MOTIONS["affine"]}, None, "It turns."),
    "Run": lambda: R.Run.of("planar", plain()),
    "Study": lambda: R.Study("mine", "How little?", "HJK (10)", lambda options: result()),
    "StudyOptions": R.StudyOptions,
    "StudyRecord": lambda: R.StudyRecord("mine", "How little?", "HJK (10)", 0.0, result()),
    "StudyResult": result,
    "Table": table,
    "Track": lambda: R.player("turns", {"motion": MOTIONS["affine"]}, None, "It turns.").tracks[0],
    "Travelling": lambda: R.Travelling(CURVES["spline"], (0.0, 3.0)),
    # Of no group, and met all the same.
    "Plan": lambda: plan(sm.examples.recorded_tour(40)),
    "AffineDesign": lambda: plain().program.design,
    "FitDesign": lambda: fitted().program.design,
    "FreeTimesDesign": lambda: sm.free_times_program(KEYS).design,
    "OrientationDesign": lambda: sm.orientation_program(RIGID).design,
    "PoseDesign": lambda: sm.pose_program(RIGID).design,
    "CurveDesign": lambda: sm.curve_program(KEYS).design,
    "JoinedDesign": lambda: sm.join({"a": sm.affine_program(KEYS), "b": sm.affine_program(KEYS)}).design,
    "Interpolant": lambda: MOTIONS["polar, slerp"],
    "Datum": lambda: plain().sensitivity().datum("keyframes"),
}
# Made with a path, below.
WITH_FILES = {"ResultsFile", "WrittenMotion"}


def read(text: str) -> bool:
    """Whether a text is one that a person reads."""
    lines = text.splitlines()
    strange = re.search(r" at 0x|array\(|<function|<lambda>|<class|SX\(", text)
    return bool(lines) and not strange and len(lines) <= 12 and max(map(len, lines)) <= 500


def test_every_public_class_is_walked_past():
    rooms = [sm, *(room for room in (getattr(sm, name) for name in sm.__all__) if isinstance(room, ModuleType))]
    public = [getattr(room, name) for room in rooms for name in getattr(room, "__all__", ())]
    kinds = [c for c in public if inspect.isclass(c) and c.__module__.startswith("symmotion")]
    met = {c.__name__ for c in kinds if not (getattr(c, "_is_protocol", False) or issubclass(c, Exception))}
    assert met - {"Energy", "MotionConstraint"} <= {*MADE, *WITH_FILES}


@pytest.mark.parametrize("name", MADE)
def test_it_reads_in_a_few_lines(name):
    made = MADE[name]()
    assert type(made).__name__ == name
    assert read(repr(made)) and read(str(made)), repr(made)[:1000]
    show = getattr(made, "_repr_html_", None)
    if show is not None:
        shown = show()
        assert "<svg" in shown and " at 0x" not in shown and "No picture" not in shown
    if not isinstance(made, enum.Enum):
        assert repr(made) == repr(made).strip() and len(repr(made)) > 3


def test_what_lies_in_files_reads_in_a_line(tmp_path):
    for made in (
        sm.batches.ResultsFile(tmp_path / "results"),
        sm.files.write_gltf(MOTIONS["affine"], tmp_path / "moved.glb"),
    ):
        assert read(repr(made)) and read(str(made))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (np.diag([1.0, 2.0]), "[[1, 0], [0, 2]]"),
        (np.zeros((300, 3)), "array 300 × 3"),
        (2.0, "2.0"),
        (np.float64(1 / 3), "0.333333333"),
        ((1, [np.arange(3.0)]), "(1, [[0, 1, 2]])"),
        ((KEYS,), "(Keyframes(4 in 2D, times 0 to 1),)"),
        (range(3), "range(0, 3)"),
        ([1] * 100, "[100 entries]"),
        ({"a": None, "b": len}, "{'a': None, 'b': len}"),
        (lambda: 0, "lambda"),
        ("x" * 500, repr("x" * 119 + "…")),
    ],
)
def test_a_content_in_a_few_words(content, words):
    assert brief(content) == words


LATE = 1.7e9 + 0.25  # seconds from 1970
SOON = sm.examples.random_keyframes(4, 40, seed=1)


def at(start: float) -> list[object]:
    keys = sm.Keyframes(start + SOON.times / 2, SOON.linear, SOON.translation)
    turning = sm.quaternions.interpolate_quaternions(keys)
    path = sm.splines.cubic_interpolant(keys.times, keys.translation)
    pose, affine = sm.motions.PoseMotion(turning, path), sm.interpolants.component_cubic(keys)
    ramp = sm.curves.bezier([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], domain=(start, start + 1.5))
    samples = sm.motions.orthonormalise(affine, keys.times)
    skeleton = sm.files.PosedSkeleton(
        ("a",), [-1], keys.times, keys.linear[:, None], keys.translation[:, None], np.zeros((1, 3))
    )
    orientations = sm.quaternions.OrientationKeys.of(keys.times, keys.linear)
    return [
        keys,
        turning,
        path,
        path.basis,
        pose,
        affine,
        ramp,
        samples,
        skeleton,
        orientations,
        sm.motions.reverse(pose),
    ]


@pytest.mark.parametrize(("soon", "late"), list(zip(at(0.0), at(LATE), strict=True)), ids=lambda o: type(o).__name__)
def test_large_times_are_told_from_the_first(soon, late):
    assert "0 to 1.5" in repr(soon)
    assert repr(late) == repr(soon).replace("0 to 1.5", "0 to 1.5 after 1700000000.25")


RIGID_LATE = sm.interpolants.component_cubic(sm.Keyframes(LATE + SOON.times, SOON.linear, SOON.translation))


@pytest.mark.parametrize(
    ("fails", "message"),
    [
        (lambda: RIGID_LATE(LATE + 3.5), r"1700000003.75 is outside the domain \[1700000000.25, 1700000003.25\]"),
        (lambda: RIGID_LATE(LATE + 3.00001), r"1700000003.25001 is outside the domain \[1"),
        (lambda: sm.motions.part(RIGID_LATE, LATE + 1.5, LATE), "part from 1700000001.75 to 1700000000.25: both in"),
        (lambda: sm.splines.check_times([LATE, LATE - 0.01]), "1, 1700000000.24, comes before .* 0, 1700000000.25:"),
        (
            lambda: sm.splines.BSplineBasis.clamped([LATE, LATE + 1], 2)(LATE + 2),
            r"1700000002.25 is .*\[1700000000.25,",
        ),
        (
            lambda: sm.curve_program([C.CurveCondition.at([LATE, LATE + 1], np.eye(2))], domain=(LATE, LATE + 0.5)),
            r"time 1700000001.25 is outside the domain \[1700000000.25, 1700000000.75\]",
        ),
    ],
)
def test_messages_tell_large_times_apart(fails, message):
    with pytest.raises(sm.InputError, match=message):
        fails()


def test_large_times_can_be_told_apart():
    one, other = sm.Keyframes(LATE + SOON.times / 100, SOON.linear, SOON.translation)[1:3]
    assert "time 1700000000.26," in repr(one)
    assert "time 1700000000.27," in repr(other)
    assert instants(LATE + 0.25, LATE + 0.2500005) == ("1700000000.5", "1700000000.5000005")
    assert instants(1.0000001, 0.0, 1.0) == ("1.0000001", "0", "1") and instants(2.0, 2.0) == ("2", "2")
    assert brief(LATE + np.array([0.0, 0.01])) == "[1700000000.25, 1700000000.26]"
    assert brief(LATE) == "1700000000.25"
    assert brief(np.array([1.0, 1.0 + 2e-16, 1.0])) == "[1, 1, 1]"
    assert brief(2 / 3 * 1e30) == "6.66666667e+29"
