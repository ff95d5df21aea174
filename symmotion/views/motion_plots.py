"""Motions and curves that are no moving body, by one call: body rates, surfaces, deviations, coordinates."""

from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from numpy.typing import ArrayLike

from symmotion.bodies.places import Oriented
from symmotion.brief import instant
from symmotion.curves import Curve
from symmotion.errors import InputError
from symmotion.motions import RigidSamples, TwoParameterMotion
from symmotion.motions.quaternions.algebra import rotate
from symmotion.views.canvas import (
    MOST_MARKERS,
    as_numbers,
    fit_height,
    in_powers,
    legend_above,
    on_axes,
    require_axes,
    require_kind,
    thinned,
    told,
)
from symmotion.views.fairing_figures import facing, sample_patch
from symmotion.views.parallel import DIRECTION, view_from
from symmotion.views.spheres import draw_curve, draw_points, draw_sphere
from symmotion.views.style import COLOURS, INK, STYLES

RateKind = Literal["rate", "sphere"]
MOST_POINTS = 1000


def plot_orientation(motion: Oriented, axes: Axes | None = None, *, kind: RateKind = "rate") -> Axes:
    """A quaternion curve: the body rate Ω over time, or where the moving unit vectors go; returns the axes.

    kind: "rate", its components in the body's frame and its size, in rad/s; "sphere", the unit
    vectors' tips on the unit sphere seen in parallel, what is behind fainter. At most 1000 times.
    """
    require_axes(axes)
    require_kind(kind, ("rate", "sphere"))
    t = _instants(motion)
    if kind == "sphere":
        q = motion(t)
        with on_axes(axes) as target:
            draw_sphere(target)
            for k, name in enumerate("xyz"):
                tips = rotate(q, np.eye(3)[k])
                draw_curve(target, tips, COLOURS[k], style=STYLES[k], label=f"${name}$")
                draw_points(target, tips[:1], COLOURS[k])
            target.plot([], [], "o", color=INK, label=f"t = {instant(t[0])}")
            legend_above(target)
            if axes is None:
                fit_height(target)
        return target
    rate = motion.jet(t, 1).rate
    with on_axes(axes) as target:
        for k, name in enumerate("xyz"):
            target.plot(told(t)[0], rate[:, k], STYLES[k], color=COLOURS[k], linewidth=1.4, label=rf"$\Omega_{name}$")
        target.plot(told(t)[0], np.linalg.norm(rate, axis=1), ":", color=INK, linewidth=1.2, label=r"$\|\Omega\|$")
        target.set_xlabel(f"{told(t)[1]} [s]")
        target.set_ylabel("body rate [rad/s]")
        legend_above(target)
    return target


def plot_net(motion: TwoParameterMotion, axes: Axes | None = None, *, point: ArrayLike | None = None) -> Axes:
    """The surface of a two-parameter motion in a parallel view, by its parameter lines; returns the axes.

    point: (3,) the body point whose trajectory surface it is; when left out the origin, and of a
    spherical motion, whose origin stays, the quaternion surface in E³ (`rodrigues`).
    """
    require_axes(axes)
    image = "rotation" if point is None and motion.spherical else "trajectory"
    where = np.zeros(3) if point is None else as_numbers(point, "point")
    if where.shape != (3,):
        raise InputError(f"point of shape {where.shape}: one body point (3,) is needed")
    try:
        view = view_from(facing(sample_patch(motion, image, where, samples=24)))
    except InputError:
        # A surface that is a curve or a point somewhere is seen from where it happens to be.
        view = view_from(DIRECTION)

    def lines(steps_u: np.ndarray, steps_v: np.ndarray) -> np.ndarray:
        u, v = steps_u[:, None], steps_v
        points = motion.rodrigues(u, v) if image == "rotation" else motion.trajectory(where, u, v)[..., 0, :]
        return (points @ view)[..., :2]

    (a, b), (c, d) = motion.domain
    fine_u, fine_v = np.linspace(a, b, 81), np.linspace(c, d, 81)
    along_u = np.swapaxes(lines(fine_u, _few(motion.v.breakpoints)), 0, 1)
    along_v = lines(_few(motion.u.breakpoints), fine_v)
    if not (np.isfinite(along_u).all() and np.isfinite(along_v).all()):
        raise InputError("the motion is not finite everywhere: it has no picture")
    with on_axes(axes) as target:
        for k, (group, name) in enumerate(((along_u, "u"), (along_v, "v"))):
            drawn = LineCollection(list(group), colors=COLOURS[k], linestyles=STYLES[k], linewidths=0.8)
            drawn.set_label(f"along {name}")
            target.add_collection(drawn)
        for edge in (along_u[0], along_u[-1], along_v[0], along_v[-1]):
            target.plot(edge[:, 0], edge[:, 1], color=INK, linewidth=1.0)
        target.set_aspect("equal")
        target.set_axis_off()
        target.autoscale_view()
        legend_above(target)
        if axes is None:
            fit_height(target)
    return target


def plot_deviations(samples: RigidSamples, axes: Axes | None = None) -> Axes:
    """How much a motion made rigid gave up, ‖A(t) − polar(A(t))‖, over time; returns the axes."""
    with on_axes(axes) as target:
        few = len(samples.times) <= MOST_MARKERS
        times, name = told(samples.times)
        line = thinned(times, samples.deviations)
        target.plot(*line, "o-" if few else "-", color=COLOURS[0], markersize=3)
        target.set_ylim(bottom=0)
        target.set_xlabel(name)
        target.set_ylabel("deviation from rigid")
    return target


def plot_curve(curve: Curve, axes: Axes | None = None, *, label: str | None = None) -> Axes:
    """A curve: in the plane its path with a dot at every joint, else its coordinates over time; returns the axes."""
    require_axes(axes)
    t = _instants(curve)
    values = np.asarray(curve(t)).reshape(len(t), -1)
    if not np.isfinite(values).all():
        raise InputError("the curve is not finite everywhere: it has no picture")
    with on_axes(axes) as target:
        if values.shape[1] == 2:
            target.plot(values[:, 0], values[:, 1], color=COLOURS[0], linewidth=1.4, label=label)
            if len(curve.breakpoints) <= MOST_MARKERS:
                joints = curve(curve.breakpoints)
                target.plot(joints[:, 0], joints[:, 1], "o", color=INK, markersize=3)
            target.set_aspect("equal")
            target.set_xlabel("x")
            target.set_ylabel("y")
            if axes is None:
                in_powers(target)
                fit_height(target)
        else:
            for k, column in enumerate(values.T):
                name = "xyz"[k] if values.shape[1] <= 3 else f"x{k + 1}"
                style, colour = STYLES[k % len(STYLES)], COLOURS[k % len(COLOURS)]
                target.plot(told(t)[0], column, style, color=colour, linewidth=1.4, label=label or name)
            target.set_xlabel(told(t)[1])
            target.set_ylabel("value")
            if values.shape[1] > 1:
                legend_above(target)
    return target


def _instants(motion: Oriented | Curve) -> np.ndarray:
    """Times close enough for a smooth line, at most 1000 and the joints, where rates may jump, from both sides."""
    joints = motion.breakpoints
    t = np.linspace(motion.domain[0], motion.domain[1], int(np.clip(20 * len(joints), 300, MOST_POINTS)))
    if len(joints) > 100:
        return t
    return np.unique(np.concatenate([t, joints[1:-1], np.nextafter(joints[1:-1], -np.inf)]))


def _few(knots: np.ndarray) -> np.ndarray:
    """Parameters for lines: the knots and those half-way, the ends alone with some between where they are many."""
    if len(knots) > 20:
        return np.linspace(knots[0], knots[-1], 41)
    return np.sort(np.concatenate([knots, (knots[1:] + knots[:-1]) / 2]))
