"""A tool over a real height field: surface frames as control displacements, faired, and a pass over it."""

from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cbook import get_sample_data

import symmotion as sm
from studies.fairing.fairing_nets import AFTER, BEFORE, BESIDE, fairness_figure, rms
from symmotion.bodies import Body, grid_mesh
from symmotion.fairing import FairingResult, Method, fair, fairing_program
from symmotion.motions import CurveMotion, DualQuaternions, TwoParameterMotion
from symmotion.report import Column, Figure, Run, Study, StudyOptions, StudyResult, Table, player, to_figure
from symmotion.splines import BSplineBasis, Spline
from symmotion.views import DIRECTION, draw_bodies, draw_isophotes, facing, new_figure, sample_patch

METRES_PER_DEGREE = 111_200.0
SCALE, EXAGGERATION = 1e-5, 5.0  # of the milled model, and of its heights
ROWS, COLUMNS = 18, 22
TOOL = np.array([0.0, 0.0, 0.0])
LOCAL: tuple[Method, ...] = ("greedy", "orthogonal")


def run(options: StudyOptions) -> StudyResult:
    points, note = height_field(3 * ROWS if options.full else ROWS, 3 * COLUMNS if options.full else COLUMNS)
    spacing = float(np.linalg.norm(np.diff(points[..., :2], axis=0), axis=-1).mean())
    tool = TwoParameterMotion.from_displacements(surface_frames(points), "uniform", "uniform")
    fairer = partial(fair, tool, parts="real+translation", length=spacing)
    options.progress("fairing")
    start = fairer(max_steps=0).initial
    results: dict[str, FairingResult] = {
        **{f"{method}, displacement ≤ 0.1": fairer(method, tolerance=0.1, max_steps=2000) for method in LOCAL},
        "bounded, displacement ≤ 0.1": fairer("bounded", tolerance=0.1),
        "least squares, G / 10": fairer("least-squares", target=start / 10),
        "least squares, G / 100": fairer("least-squares", target=start / 100),
    }
    curve = raster(tool, 5)
    t = np.linspace(*curve.domain, 4001)
    rows: list[tuple] = [("control frames as they are", start, None, None, None, *effort(tool.along(curve), t))]
    for name, r in results.items():
        rows.append((name, r.final, *distances(tool, r.motion), r.seconds, *effort(r.motion.along(curve), t)))
    best, local, bounded = (
        results[name]
        for name in ("least squares, G / 100", "greedy, displacement ≤ 0.1", "bounded, displacement ≤ 0.1")
    )
    options.progress("programs")
    program = fairing_program(tool, weight=best.weight or 1.0, parts="real+translation", length=spacing)
    runs = (Run.of("least squares, G / 100", sm.ExactNewton().solve(program)),)
    columns = (
        Column("tool motion"),
        Column("G"),
        Column("tool tip moved, RMS", "mm"),
        Column("axis turned, RMS", "°"),
        Column("time", "s"),
        Column("turning acceleration, RMS", "°/s²"),
        Column("turning acceleration, largest", "°/s²"),
        Column("vertical acceleration, RMS", "mm/s²"),
        Column("vertical acceleration, largest", "mm/s²"),
    )
    caption = (
        f"{tool.u.n} × {tool.v.n} control frames, real part and translation faired together, translations in units of "
        f"the spacing, {spacing:.3g} mm. The pass takes {curve.domain[1]:.0f} s. Moved and turned: the control frames."
    )
    before, after = rows[0], rows[-1]
    conclusion = (
        f"Least squares with G a hundredth lower the pass's RMS turning acceleration from {before[5]:.3g} to "
        f"{after[5]:.3g} °/s² and its vertical acceleration from {before[7]:.3g} to {after[7]:.3g} mm/s², for control "
        f"frames moved by {after[2]:.3g} mm and turned by {after[3]:.3g}° (RMS). The one-parameter pass inherits it "
        "from the two-parameter motion, and so does any other over it.\n\n"
        f"Within 0.1 spacings at every control greedy steps end at G = {local.final:.3g} from {start:.3g}, the minimum "
        f"there is {bounded.final:.3g}; {local.discarded} steps were discarded and {local.steps} taken."
    )
    motions = (tool, best.motion)
    passes = {"before": tool.along(curve), "after, G / 100": best.motion.along(curve)}
    caption = "The tool along the first line of the pass and round to the next, and the path of its tip."
    moving = player("tool", passes, cutter(1.3 * spacing), caption, unit="s", direction=DIRECTION, span=(0.0, 70.0))
    figures = (
        _rates({"before": tool.along(curve), "after": best.motion.along(curve)}, t),
        _field(motions, curve, spacing),
        _surfaces(motions),
        fairness_figure(best),
    )
    answer = (
        f"Fairing to a hundredth of G lowers the RMS turning acceleration of the tool pass from {before[5]:.3g} to "
        f"{after[5]:.3g} °/s², the vertical one from {before[7]:.3g} to {after[7]:.3g} mm/s², and moves its frames by "
        f"{after[2]:.2g} mm."
    )
    tables = (Table("passes", columns, tuple(rows), caption),)
    return StudyResult(tables, figures, runs, conclusion, (note,), (moving,), answer)


def height_field(n: int, m: int) -> tuple[np.ndarray, str]:
    """(n, m, 3) points in mm of a model of the Jacksboro fault, means of blocks; what the report says about it."""
    try:
        sample: Any = get_sample_data("jacksboro_fault_dem.npz")  # an archive of arrays, whatever the stubs say
        with sample as dem:
            z = np.array(dem["elevation"], dtype=float)
            width = METRES_PER_DEGREE * np.cos(np.deg2rad(float(dem["ymin"])))
            size = (
                METRES_PER_DEGREE * float(dem["ymax"] - dem["ymin"]),
                width * float(dem["xmax"] - dem["xmin"]),
            )
        note = "Height field: Jacksboro fault, sample data of matplotlib."
    except (FileNotFoundError, KeyError):
        y, x = np.meshgrid(np.linspace(0, 6, 344), np.linspace(0, 7, 403), indexing="ij")
        z = 300 + 120 * np.sin(1.3 * x + 0.7 * y) + 60 * np.cos(2.9 * y - 1.1 * x) + 25 * np.sin(5 * x) * np.sin(4 * y)
        size = (31_900.0, 30_300.0)
        note = "Ran on a height field made by the project: matplotlib's sample data is not installed."
    rows, columns = z.shape[0] // n, z.shape[1] // m
    z = z[: n * rows, : m * columns].reshape(n, rows, m, columns).mean(axis=(1, 3))
    x, y = np.meshgrid(np.arange(n) * size[0] / n, np.arange(m) * size[1] / m, indexing="ij")
    model = 1e3 * SCALE * np.stack([x, y, EXAGGERATION * (z - z.mean())], axis=-1)
    return model, f"{note} Model 1:{1 / SCALE:.0f}, heights {EXAGGERATION:g} times."


def surface_frames(points: np.ndarray) -> DualQuaternions:
    """Frames on a grid of points: the third axis the normal, the first along u."""
    along, across = np.gradient(points, axis=0), np.gradient(points, axis=1)
    normal = np.cross(along, across)
    third = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    first = along / np.linalg.norm(along, axis=-1, keepdims=True)
    return DualQuaternions.from_matrices(np.stack([first, np.cross(third, first), third], axis=-1), points)


def raster(motion: TwoParameterMotion, lines: int) -> Spline:
    """A pass to and fro along u: a cubic B-spline curve, inside the domain as its control points are; 60 s a line."""
    (a, b), (c, d) = motion.domain
    u, v = np.linspace(a, b, 12), np.linspace(c + 0.05 * (d - c), d - 0.05 * (d - c), lines)
    points = [np.column_stack([u if k % 2 == 0 else u[::-1], np.full(12, x)]) for k, x in enumerate(v)]
    net = np.concatenate(points)
    return Spline(BSplineBasis.clamped(np.linspace(0, 60.0 * lines, len(net) - 2), 3), net)


def effort(motion: CurveMotion, t: np.ndarray) -> tuple[float, float, float, float]:
    """RMS and largest turning acceleration in °/s² and vertical acceleration of the tip in mm/s²."""
    turning, tip = accelerations(motion, t)
    return rms(turning), float(turning.max()), rms(tip), float(tip.max())


def accelerations(motion: CurveMotion, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(N,) the size of the turning acceleration in °/s² and that of the tip's vertical one in mm/s²."""
    a, second = motion(t).linear, motion(t, 2).linear
    # Of AᵀÄ = Ω̇ + Ω², with Ω = AᵀȦ skew, the skew part is the angular acceleration.
    product = np.swapaxes(a, 1, 2) @ second
    skew = (product - np.swapaxes(product, 1, 2)) / 2
    angular = np.linalg.norm(skew, axis=(1, 2)) / np.sqrt(2)
    return np.rad2deg(angular), np.abs(motion.trajectory(TOOL, t, 2)[:, 0, 2])


def distances(one: TwoParameterMotion, other: TwoParameterMotion) -> tuple[float, float]:
    """RMS distance of the control positions in mm, and RMS angle between their third axes in degrees."""
    p, q = one.control_displacements.matrices, other.control_displacements.matrices
    cosine = np.sum(p.linear[..., 2] * q.linear[..., 2], axis=-1)
    return rms(np.linalg.norm(p.translation - q.translation, axis=-1)), rms(
        np.rad2deg(np.arccos(np.minimum(cosine, 1)))
    )


def cutter(size: float) -> Body:
    """A slim cone with its tip at the origin, its axis the third."""
    angle = np.linspace(0, 2 * np.pi, 9)
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(9)], axis=-1)
    height = np.array([0.0, 0.0, 1.0])
    return grid_mesh(
        size * np.stack([0.01 * ring, 0.12 * ring + 0.5 * height, 0.12 * ring + 2 * height, 2 * height + 0 * ring])
    )


def _field(motions: tuple[TwoParameterMotion, ...], curve: Spline, spacing: float) -> Figure:
    direction = (-1.0, -0.5, 1.3)
    t = np.linspace(*curve.domain, 70)
    with new_figure(7.0, 3.8) as figure:
        figure.set_dpi(220)
        for axes, motion, title, colour in zip(
            figure.subplots(1, 2), motions, ("before", "after, G / 100"), (BEFORE, AFTER), strict=True
        ):
            linear, translation = motion.along(curve)(t)
            _ground(axes, motion, direction)
            draw_bodies(axes, linear, translation, cutter(1.3 * spacing), direction, colour)
            axes.set_title(title)
        return to_figure(figure, "pass", "The tool along the pass, on the surface of its tip.")


def _ground(axes: Axes, motion: TwoParameterMotion, direction: tuple[float, float, float]) -> None:
    (a, b), (c, d) = motion.domain
    points = motion.trajectory(TOOL, np.linspace(a, b, 60)[:, None], np.linspace(c, d, 60))
    mesh = grid_mesh(points[..., 0, :])
    draw_bodies(axes, np.eye(3), np.zeros(3), mesh, direction, "#777777")


def _surfaces(motions: tuple[TwoParameterMotion, ...]) -> Figure:
    patches = [sample_patch(m, "trajectory", TOOL) for m in motions]
    view = facing(patches[0])
    with new_figure(7.0, 3.6) as figure:
        for axes, patch, title, colour in zip(
            figure.subplots(1, 2), patches, ("before", "after, G / 100"), (BEFORE, AFTER), strict=True
        ):
            draw_isophotes(axes, patch, view + BESIDE, 12, view, colour)
            axes.set_title(title)
        return to_figure(figure, "isophotes", "Isophotes of the surface of the tool tip.")


def _rates(passes: dict[str, CurveMotion], t: np.ndarray) -> Figure:
    first = t <= t[0] + 0.4 * (t[-1] - t[0])
    with new_figure(7.0, 4.0) as figure:
        panels = figure.subplots(2, 1, sharex=True)
        for (name, motion), colour in zip(passes.items(), (BEFORE, AFTER), strict=True):
            for axes, values in zip(panels, accelerations(motion, t[first]), strict=True):
                axes.plot(t[first], values, color=colour, label=name, linewidth=1.0)
        panels[0].set_ylabel("turning [°/s²]")
        panels[1].set_ylabel("vertical [mm/s²]")
        panels[1].set_xlabel("time [s]")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper left", ncols=2)
        return to_figure(
            figure,
            "accelerations",
            "Turning of the tool and vertical acceleration of its tip along two fifths of the pass.",
        )


STUDY = Study(
    "tool_path",
    "Does a faired two-parameter tool motion make a tool pass over real terrain smoother?",
    "PCG 1 and 7 (five-axis tool motions)",
    run,
    order=43,
)
