"""KKS figures 2 to 6: cumulative bases, Hermite curves with growing end rates, local control of a B-spline curve."""

import numpy as np

from studies.quaternions.far_turns import far_turns
from symmotion.bodies import wedge
from symmotion.motions.quaternions import QuaternionMotion, angles_travelled, exp
from symmotion.report import Column, Figure, Study, StudyOptions, StudyResult, Table, player, to_figure
from symmotion.splines import BSplineBasis, cumulative
from symmotion.views import (
    COLOURS,
    draw_sphere,
    draw_sphere_curve,
    draw_sphere_points,
    new_figure,
    on_sphere,
    view_from,
)

ENDS = exp(np.array([[0.0, 0.0, 0.0], [0.55, 0.75, 0.25]]))
RATE = np.array([[1.2, 3.0, -0.6], [-2.4, 3.2, 0.8]])  # rad/s, the unit of the family
SHIFT = np.array([0.35, -0.35, 0.2])
VIEW = view_from([1.0, 0.6, 0.7])


def run(options: StudyOptions) -> StudyResult:
    options.progress("Hermite curves")
    growth = (1.0, 2.0, 4.0, 8.0)
    family = {(f, 0): QuaternionMotion.hermite(*ENDS, *(f * RATE)) for f in growth}
    family |= {(1.0, k): QuaternionMotion.hermite(*ENDS, *RATE, turns=k) for k in (1, -1, 2)}
    rows = []
    for (factor, turns), motion in family.items():
        jet = motion.jet((np.polynomial.legendre.leggauss(64)[0] + 1) / 2)
        ends = motion.jet([0.0, 1.0])
        error = np.abs(ends.rate - factor * RATE).max() + (1 - np.abs(np.sum(ends.quaternion * ENDS, axis=1))).max()
        rows.append(
            (
                factor,
                turns,
                float(np.rad2deg(angles_travelled(motion).sum())),
                float(np.linalg.norm(jet.rate, axis=1).max()),
                float(error),
            )
        )
    hermite = Table(
        "Hermite curves",
        (
            Column("end rates, factor"),
            Column("extra turns"),
            Column("angle travelled", "°"),
            Column("largest rate", "rad/s"),
            Column("largest error at the ends"),
        ),
        tuple(rows),
        "The same two orientations and directions of the end rates. Error: of end rates (rad/s) and orientations.",
    )
    options.progress("B-spline curves")
    table, figure, outside, inside = _local_control()
    far, told = far_turns(options)
    conclusion = (
        f"Every curve of the Hermite family meets its end orientations and end rates to "
        f"{max(r[4] for r in rows):.1g}, "
        f"however large: with rates eight times as large the body travels {rows[3][2]:.4g}° instead of "
        f"{rows[0][2]:.4g}°. "
        f"Extra turns leave the ends as they are and lengthen the way from {rows[0][2]:.4g}° to "
        f"{next(r[2] for r in rows if r[1] == 1):.4g}° and {next(r[2] for r in rows if r[1] == 2):.4g}°.\n\n"
        f"A control quaternion of the cubic B-spline curve moved by "
        f"{np.rad2deg(2 * np.linalg.norm(SHIFT)):.3g}° turns the "
        f"curve by up to {inside:.3g}° on its four spans and by {outside:.1g}° on all others: local control, as "
        f"KKS say. "
        "The curve is C²: rate and acceleration do not jump at the knots, the jerk does."
    )
    turned = {_label(*key): motion for key, motion in family.items() if max(key) < 5 and key[1] < 2}
    caption = "A body under Hermite curves between the same orientations, by end rates and extra turns."
    moving = player("turning", turned, wedge(), caption, unit="s", centre=(0.5, 0.0, 0.0), direction=VIEW[:, 2])
    answer = (
        f"Hermite curves meet their ends to {max(r[4] for r in rows):.0e}; a moved control turns a B-spline curve by "
        f"{inside:.3g}° on its spans, {outside:.1g}° elsewhere; {told}."
    )
    figures = (_spheres(family), figure, _bases())
    return StudyResult((hermite, table, far), figures, (), conclusion, players=(moving,), answer=answer)


def _label(factor: float, turns: int) -> str:
    return f"end rates × {factor:g}" if not turns else f"{turns:+d} turn{'s' if abs(turns) > 1 else ''}"


def _local_control() -> tuple[Table, Figure, float, float]:
    """The jumps at the knots, the figure of KKS 6, and the largest turn outside and inside the support in degrees."""
    # Three copies of the ends in the controls are not needed: the clamped knots do it.
    basis = BSplineBasis.clamped(np.linspace(0, 8, 9), 3)
    lifted = np.interp(np.linspace(0, 5, basis.n), np.arange(6), np.arange(6))
    weights = lifted - np.floor(lifted)
    low = np.minimum(np.floor(lifted).astype(int), 4)
    vectors = np.array(
        [[0, 0, 0], [0.5, 0.1, 0.1], [0.8, 0.6, 0.1], [0.6, 1.1, 0.3], [0.1, 1.2, 0.4], [-0.3, 0.8, 0.2]]
    )
    controls = exp(vectors[low] * (1 - weights[:, None]) + vectors[np.minimum(low + 1, 5)] * weights[:, None])
    motion = QuaternionMotion(basis, controls)
    j = basis.n // 2
    moved = motion.with_control(j, exp(SHIFT + vectors[low[j]]))
    t = np.linspace(0, 8, 2401)
    turn = np.rad2deg((motion.rotation(t).inv() * moved.rotation(t)).magnitude())
    support = (t > basis.knots[j]) & (t < basis.knots[j + 4])
    knots, h = basis.breakpoints[1:-1], 1e-9
    rows = []
    for order, name, unit in ((1, "rate", "rad/s"), (2, "acceleration", "rad/s²"), (3, "jerk", "rad/s³")):
        jump = np.linalg.norm(motion.jet(knots + h, order)[order] - motion.jet(knots - h, order)[order], axis=1).max()
        rows.append((name, unit, float(np.linalg.norm(motion.jet(t, order)[order], axis=1).max()), float(jump)))
    table = Table(
        "continuity",
        (Column("quantity"), Column("unit"), Column("largest value"), Column("largest jump at a knot")),
        tuple(rows),
        "Cubic B-spline curve; values 1e-9 s before and after each inner knot.",
    )
    with new_figure(5.2, 4.6) as figure:
        axes = figure.subplots()
        draw_sphere(axes, VIEW)
        draw_sphere_curve(axes, on_sphere(motion(t)), COLOURS[0], label="curve", view=VIEW)
        draw_sphere_curve(
            axes, on_sphere(moved(t)), COLOURS[1], style="--", label="a control quaternion moved", view=VIEW
        )
        draw_sphere_points(axes, on_sphere(motion.control_points), COLOURS[0], size=3.5, view=VIEW)
        draw_sphere_points(axes, on_sphere(moved.control_points[[j]]), COLOURS[1], size=5, view=VIEW)
        figure.legend(loc="outside upper left", ncols=2)
        picture = to_figure(
            figure,
            "local-control",
            "A cubic B-spline quaternion curve with its control quaternions (KKS figure 6), projected on the sphere.",
        )
    return table, picture, float(turn[~support].max()), float(turn[support].max())


def _bases() -> Figure:
    with new_figure(7.0, 2.6) as figure:
        left, right = figure.subplots(1, 2)
        t = np.linspace(0, 1, 201)
        _, values = cumulative(BSplineBasis.clamped([0.0, 1.0], 3), t)
        for i, v in enumerate(values[0]):
            left.plot(t, v, color=COLOURS[i], label=f"$\\tilde\\beta_{i + 1}$")
        left.set(title="cubic Bézier", xlabel="t [s]")
        left.legend()
        basis = BSplineBasis(np.arange(-3.0, 8.0), 3)
        t = np.linspace(0, 4, 401)
        plain = basis(t)
        sums = np.cumsum(plain[:, ::-1], axis=1)[:, ::-1]
        for i in range(1, basis.n):
            right.plot(t, sums[:, i], color=COLOURS[(i - 1) % 5])
            right.plot(t, plain[:, i], color=COLOURS[(i - 1) % 5], linestyle=":", linewidth=1)
        right.set(title="cubic B-splines (dotted) and their sums", xlabel="t [s]")
        return to_figure(figure, "cumulative-bases", "Cumulative bases (KKS figures 2, 4 and 5).")


def _spheres(family: dict[tuple[float, int], QuaternionMotion]) -> Figure:
    t = np.linspace(0, 1, 1501)
    with new_figure(7.0, 4.2) as figure:
        left, right = figure.subplots(1, 2)
        for axes, title in ((left, "growing end rates"), (right, "extra turns")):
            draw_sphere(axes, VIEW)
            axes.set_title(title)
        for k, factor in enumerate((1.0, 2.0, 4.0, 8.0)):
            draw_sphere_curve(
                left, on_sphere(family[factor, 0](t)), COLOURS[k], linewidth=1.3, label=f"× {factor:g}", view=VIEW
            )
        for k, turns in enumerate((0, 1, -1, 2)):
            draw_sphere_curve(
                right,
                on_sphere(family[1.0, turns](t)),
                COLOURS[k],
                linewidth=1.3,
                label=f"{turns:+d}" if turns else "0",
                view=VIEW,
            )
        for axes in (left, right):
            draw_sphere_points(axes, on_sphere(ENDS), view=VIEW)
            axes.legend(loc="upper center", bbox_to_anchor=(0.5, 0.02), ncols=4, handlelength=1.4, columnspacing=1)
        return to_figure(
            figure,
            "hermite",
            "Hermite quaternion curves between the same orientations (KKS figure 3); odd numbers of turns end at −q.",
        )


STUDY = Study(
    "quaternion_curves",
    "Do the cumulative quaternion curves keep what their originals have: end rates, local control, continuity?",
    "KKS figures 2 to 6",
    run,
    order=20,
)
