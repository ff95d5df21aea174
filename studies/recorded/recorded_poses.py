"""A recorded trajectory from a few of its poses: how far is the optimal motion from the recording between them?"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import symmotion as sm
from studies.affine.several_keyframes import start_of
from studies.runner.recordings import recorded
from symmotion.bodies import wedge
from symmotion.motions import orthonormalise
from symmotion.report import Column, Figure, Run, Study, StudyOptions, StudyResult, Table, player, to_figure
from symmotion.views import COLOURS, new_figure

RECORDING = recorded("freiburg1_xyz-groundtruth.txt")
POINTS = np.concatenate([np.eye(3), -np.eye(3)])


def run(options: StudyOptions) -> StudyResult:
    recording, notes = load(options.data)
    runs, rows = [], []
    moving: dict[str, sm.AffineMotion] = {}
    intervals = (0.25, 0.5, 1.0, 2.0, 4.0) if options.full else (0.5, 1.0, 2.0)
    for interval in intervals:
        keys = pick(recording, interval)
        for weight in (0.0, 1e-3, 1e-1):
            objective = sm.Rigidity() + weight * sm.TrajectoryEnergy(POINTS) if weight else sm.Rigidity()
            case = f"every {interval:g} s, {objective.name}"
            options.progress(case)
            program = sm.affine_program(keys, objective=objective)
            comparison = sm.compare(program, [sm.ExactNewton(), sm.Ipopt()])
            runs += [Run.of(case, s) for s in comparison.solutions]
            best = comparison.best
            if best is None:
                raise sm.SolveError(f"no solver solved {case}")
            if not weight:
                rows.append((interval, len(keys), "interpolating spline", *_deviation(start_of(program), recording)))
                if interval == 1.0:
                    moving["interpolating spline"] = start_of(program)
            rows.append((interval, len(keys), objective.name, *_deviation(best.motion, recording)))
            if not weight and interval == 1.0:
                moving["least R"] = best.motion
    table = Table(
        "deviation between the keyframes",
        (
            Column("interval", "s"),
            Column("keyframes"),
            Column("motion"),
            Column("position, RMS", "mm"),
            Column("orientation, RMS", "°"),
            Column("orientation, largest", "°"),
            Column("distortion, largest"),
        ),
        tuple(rows),
        "Against all recorded poses. Orientation: angle between the polar factor of A and the recording; distortion: "
        "largest entry of |AᵀA − I|.",
    )
    spline, optimum = (_row(rows, 1.0, name) for name in ("interpolating spline", "R"))
    conclusion = (
        f"With a keyframe every second, the component-wise spline distorts the body by up to {spline[6]:.2g}, the "
        f"motion of least R by {optimum[6]:.2g}, {spline[6] / optimum[6]:.3g} times less. The orientation between the "
        f"keyframes is off by {spline[4]:.3g}° (RMS) before and {optimum[4]:.3g}° after: what is left out cannot "
        "be recovered, but the body stays rigid without a constraint that says so.\n\n"
        "A little trajectory energy (E, weighted) trades distortion for smoother paths; the position is the natural "
        "spline's unless E couples it to the rotation."
    )
    drawn = {name: _errors(motion, recording)[2] for name, motion in moving.items()}
    keys = pick(recording, 1.0)
    caption = "The camera as a wedge in the first ten seconds, a keyframe every second (grey), and its path."
    camera = player("camera", moving, wedge(0.06), caption, keys[keys.times <= 10.5], unit="s", span=(0.0, 10.0))
    figures = (_distortion_figure(recording, drawn),)
    answer = (
        f"With a keyframe every second the motion of least R distorts the body by {optimum[6]:.2g} at most, the "
        f"component-wise spline by {spline[6]:.2g}; in orientation they are off by {optimum[4]:.2g}° and "
        f"{spline[4]:.2g}° (RMS)."
    )
    return StudyResult((table,), figures, tuple(runs), conclusion, notes, (camera,), answer)


def load(data: Path | None) -> tuple[sm.Keyframes, tuple[str, ...]]:
    """The recording to work on, times from 0 s, and what the report has to say about it."""
    if data is not None:
        recording, note = sm.read_keyframes(data), f"Recording: {data.name}."
    elif RECORDING.is_file():
        recording = sm.read_keyframes(RECORDING)
        note = f"Recording: {RECORDING.name} (TUM RGB-D benchmark, CC BY 4.0)."
    else:
        recording = sm.examples.recorded_tour()
        note = f"Ran on example data made by the project: {RECORDING.name} is not beside the checkout (see --data)."
    if recording.dimension != 3:
        raise sm.InputError("the recording must be of poses in space")
    return sm.Keyframes(recording.times - recording.times[0], recording.linear, recording.translation), (note,)


def pick(recording: sm.Keyframes, interval: float) -> sm.Keyframes:
    """The recorded poses nearest to times `interval` seconds apart, first and last included."""
    wanted = np.arange(0.0, recording.times[-1], interval)
    index = np.unique(np.append(np.searchsorted(recording.times, wanted), len(recording) - 1))
    return recording[index]


def _errors(motion: sm.AffineMotion, recording: sm.Keyframes) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(N,) each: distance in m, angle in rad and distortion at the recorded times."""
    linear, translation = motion(recording.times)
    turned = Rotation.from_matrix(orthonormalise(motion, recording.times).rotations)
    angle = (Rotation.from_matrix(recording.linear).inv() * turned).magnitude()
    distortion = np.abs(linear.transpose(0, 2, 1) @ linear - np.eye(3)).max(axis=(1, 2))
    return np.linalg.norm(translation - recording.translation, axis=1), angle, distortion


def _deviation(motion: sm.AffineMotion, recording: sm.Keyframes) -> tuple[float, float, float, float]:
    distance, angle, distortion = _errors(motion, recording)
    degrees = np.rad2deg(angle)
    return (
        float(1e3 * np.sqrt(np.mean(distance**2))),
        float(np.sqrt(np.mean(degrees**2))),
        float(degrees.max()),
        float(distortion.max()),
    )


def _row(rows: list, interval: float, name: str) -> tuple:
    return next(r for r in rows if r[0] == interval and r[2] == name)


def _distortion_figure(recording: sm.Keyframes, drawn: dict[str, np.ndarray]) -> Figure:
    with new_figure(7.0, 2.8) as figure:
        axes = figure.subplots()
        for (name, values), colour in zip(drawn.items(), (COLOURS[1], COLOURS[0]), strict=True):
            axes.semilogy(recording.times, np.maximum(values, 1e-9), color=colour, label=name, linewidth=1.0)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("distortion")
        axes.set_ylim(1e-7, None)
        figure.legend(loc="outside upper left", ncols=2)
        return to_figure(
            figure,
            "distortion",
            "Largest entry of |AᵀA − I| along the recording, a keyframe every second; it vanishes at the keyframes.",
        )


STUDY = Study(
    "recorded_poses",
    "Can a recorded motion be carried by a few of its poses without distorting the body between them?",
    "HJK 2.3 (keyframe interpolation), on recorded camera poses",
    run,
    order=4,
)
