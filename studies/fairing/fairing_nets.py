"""What the fairing studies share: nets with known smooth originals, the body, figures before and after."""

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from scipy.spatial.transform import Rotation

from studies.runner.recordings import recorded
from symmotion.bodies import Body, jug, read_teapot
from symmotion.fairing import Coordinates, FairingResult, Jumps
from symmotion.motions import TwoParameterMotion, noisy_net, smooth_net
from symmotion.motions.quaternions import product
from symmotion.report import Column, Figure, Player, Table, player, to_figure
from symmotion.views import (
    COLOURS,
    draw_bodies,
    draw_body_along,
    draw_fairness,
    draw_isophotes,
    draw_zebra,
    facing,
    new_figure,
    sample_patch,
)

Image = Literal["rotation", "dual", "trajectory"]  # of a two-parameter motion
TEAPOT = recorded("utah-teapot.json")
BEFORE, AFTER = COLOURS[1], COLOURS[0]
TITLES = ("before", "after")
BESIDE = np.array([0.2, 0.1, 0.3])  # from the eye to a light


def fairness(motion: Any, parts: str | None = None, length: float = 1.0) -> float:
    """G of a motion."""
    coordinates = Coordinates.of(motion, parts, length)
    return float(Jumps.of(motion.bases).fairness(coordinates.net).sum())


def net_with(fairness_wanted: float, n: int = 15, seed: int = 0, ring: bool = False) -> tuple[Any, Any, float]:
    """A smooth spherical net, the same with noise so strong that G is the one wanted, and its standard deviation."""
    smooth, trial = smooth_net(n), 0.01
    sigma = trial * np.sqrt(fairness_wanted / fairness(noisy_net(smooth, trial, seed=seed, ring=ring)))
    return smooth, noisy_net(smooth, sigma, seed=seed, ring=ring), float(sigma)


def rippled(smooth: TwoParameterMotion, degrees: float) -> TwoParameterMotion:
    """A smooth net with turns to and fro about z over six controls: a truth that is not all smooth."""
    i, j = np.indices(smooth.real.shape[:2])
    half = 0.5 * np.deg2rad(degrees) * np.sin(np.pi / 3 * i) * np.sin(np.pi / 3 * j)
    zero = np.zeros_like(half)
    return smooth.with_controls(product(smooth.real, np.stack([np.cos(half), zero, zero, np.sin(half)], axis=-1)), None)


def turn_error(motion: TwoParameterMotion, other: TwoParameterMotion) -> np.ndarray:
    """(n, m) the angles in degrees between the control rotations of two nets."""
    one, two = (Rotation.from_quat(m.real.reshape(-1, 4)[:, [1, 2, 3, 0]]) for m in (motion, other))
    return np.rad2deg((one.inv() * two).magnitude()).reshape(motion.real.shape[:2])


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def quartiles(values: np.ndarray) -> tuple[float | None, ...]:
    """Least, lower quartile, median, upper quartile and largest of some numbers; None where there are none."""
    return tuple(float(q) for q in np.quantile(values, (0, 0.25, 0.5, 0.75, 1))) if len(values) else (None,) * 5


def counts_table(rows: tuple, printed: int) -> Table:
    """How many steps were taken to the target, over many seeds; rows: name, nets that reached it, nets, quartiles."""
    names = ("least", "lower quartile", "median", "upper quartile", "largest")
    columns = (Column("nets"), Column("reached"), Column("of"), *(Column(f"steps, {name}") for name in names))
    return Table("steps over seeds", columns, rows, f"Steps to the target, over seeds of the noise; PCG: {printed}.")


def largest_jumps(motion: TwoParameterMotion, parts: str | None = None, length: float = 1.0) -> tuple[float, float]:
    """The largest |Δ_uuu| or |Δ_vvv| at the knots, and anywhere on the knot lines."""
    jumps, net = Jumps.of(motion.bases), Coordinates.of(motion, parts, length).net
    at_knots = np.sqrt(np.sum(jumps.at(net) ** 2, axis=-1)).max()
    u, v = (b(np.linspace(*b.domain, 40 * b.n)) for b in motion.bases)
    along = (
        np.einsum("ki,ijc,lj->klc", jumps.u.jumps, net, v, optimize=True),
        np.einsum("ki,ijc,lj->klc", u, net, jumps.v.jumps, optimize=True),
    )
    return float(at_knots), float(max(np.linalg.norm(a, axis=-1).max() for a in along))


def body() -> tuple[Body, str, str]:
    """The teapot, or a jug of the project's own where it is not there; its name; a note for the report."""
    if TEAPOT.is_file():
        return read_teapot(TEAPOT, 3), "teapot", f"Body: {TEAPOT.name} (M. Newell 1975)."
    return jug(), "jug", f"Drawn with a jug made by the project: {TEAPOT.name} is not beside the checkout."


def surface_figure(
    motions: Sequence[TwoParameterMotion], image: Image, name: str, caption: str, point: Any = (0.0, 0.0, 0.0)
) -> Figure:
    """A surface before and after: isophotes under two lights and zebra stripes."""
    reference = motions[0].mean_rotation
    patches = [sample_patch(m, image, point, reference=reference) for m in motions]
    view = facing(patches[1])  # one view for both, and a light beside the eye and one from the side
    with new_figure(7.0, 8.0) as figure:
        rows = figure.subplots(3, 2)
        for k, (patch, colour) in enumerate(zip(patches, (BEFORE, AFTER), strict=True)):
            for axes, light in zip(rows[:2, k], (view + BESIDE, np.roll(view, 1)), strict=True):
                draw_isophotes(axes, patch, light, direction=view, colour=colour)
            draw_zebra(rows[2, k], patch, view, colour=colour)
            rows[0, k].set_title(TITLES[k])
        return to_figure(figure, name, caption)


def detail_figure(motions: Sequence[TwoParameterMotion], image: Image, name: str, caption: str) -> Figure:
    """Isophotes of the middle of a surface before and after."""
    reference = motions[0].mean_rotation
    u, v = ((0.65 * a + 0.35 * b, 0.35 * a + 0.65 * b) for a, b in motions[0].domain)
    patches = [sample_patch(m, image, region=(u, v), samples=160, reference=reference) for m in motions]
    view = facing(patches[1])
    with new_figure(7.0, 3.4) as figure:
        for k, (axes, patch) in enumerate(zip(figure.subplots(1, 2), patches, strict=True)):
            draw_isophotes(axes, patch, view + BESIDE, 30, view, (BEFORE, AFTER)[k])
            axes.set_title(TITLES[k])
        return to_figure(figure, name, caption)


def fairness_figure(result: FairingResult, name: str = "fairness") -> Figure:
    """L at the knots before and after."""
    low = min(result.before.min(), result.after.min())
    limits = (max(low, result.before.max() * 1e-8), float(result.before.max()))
    with new_figure(7.0, 3.0) as figure:
        panels = figure.subplots(1, 2, sharey=True)
        mesh = None
        for k, (axes, values) in enumerate(zip(panels, (result.before, result.after), strict=True)):
            mesh = draw_fairness(axes, result.start, values, limits)
            axes.set_title(f"{TITLES[k]}: G = {values.sum():.3g}")
        panels[1].set_ylabel("")
        assert mesh is not None
        figure.colorbar(mesh, ax=panels, label="L at the knot")
        return to_figure(
            figure, name, "Local fairness L = |Δuuu|² + |Δvvv|² at the interior knots, one scale for both."
        )


def turning_player(motions: Sequence[TwoParameterMotion], mesh: Body, caption: str) -> Player:
    """A body along the middle curve v = const of a motion, before and after."""
    middle = sum(motions[0].domain[1]) / 2
    curves = {title: motion.isoparametric(v=middle) for title, motion in zip(TITLES, motions, strict=True)}
    return player("along-u", curves, mesh, caption, direction=(0.0, -1.0, 1.0))


def positions_figure(
    motions: Sequence[TwoParameterMotion], mesh: Body, name: str, caption: str, *, controls: bool, spread: float
) -> Figure:
    """A body at the control positions, or along the motion, before and after."""
    with new_figure(7.0, 3.9) as figure:
        figure.set_dpi(260)
        for k, (axes, motion) in enumerate(zip(figure.subplots(1, 2), motions, strict=True)):
            _draw_positions(axes, motion, mesh, controls, spread, (BEFORE, AFTER)[k])
            axes.set_title(TITLES[k])
        return to_figure(figure, name, caption)


def _draw_positions(
    axes: Axes, motion: TwoParameterMotion, mesh: Body, controls: bool, spread: float, colour: str
) -> None:
    direction = (0.0, -1.0, 1.4)
    if not controls:
        u, v = (np.linspace(*d, 9) for d in motion.domain)
        draw_body_along(axes, motion, mesh, u[:, None], v, spread=(spread, spread), direction=direction, colour=colour)
        return
    linear, translation = motion.control_displacements.matrices
    i, j = np.indices(linear.shape[:2], dtype=float)
    translation = translation + spread * np.stack([i, j, np.zeros_like(i)], axis=-1)
    draw_bodies(axes, linear, translation, mesh, direction, colour)


def history_figure(lines: dict[str, np.ndarray], name: str, caption: str, target: float | None = None) -> Figure:
    """G over steps, a line for each."""
    with new_figure(7.0, 3.0) as figure:
        axes = figure.subplots()
        for k, (label, values) in enumerate(lines.items()):
            steps = thinned(len(values))
            axes.loglog(steps + 1, values[steps], color=COLOURS[k % 5], label=label, linewidth=1.0)
        if target is not None:
            axes.axhline(target, color="#000000", linewidth=0.7, linestyle="--")
        axes.set_xlabel("local step")
        axes.set_ylabel("G")
        figure.legend(loc="outside upper left", ncols=3)
        return to_figure(figure, name, caption)


def thinned(count: int, most: int = 1500) -> np.ndarray:
    """At most about `most` indices below count, ever more widely spaced; all where there are few."""
    return np.unique(np.geomspace(1, count, most).astype(int)) - 1


def first_below(history: np.ndarray, change: float) -> int:
    """The step after which PCG (23), |G_{j+1} − G_j| < ε, would stop the iteration; the last where it never would."""
    small = np.abs(np.diff(history)) < change
    return int(np.argmax(small)) + 1 if small.any() else len(history) - 1
