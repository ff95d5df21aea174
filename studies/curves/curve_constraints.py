"""Motion curves under conditions: a bouncing ball, a camera with a speed limit, and what the multipliers say."""

from collections.abc import Sequence

import numpy as np

import symmotion as sm
from studies.curves.curve_players import dot_player, thrown
from symmotion.constraints import CurveCondition
from symmotion.curves import arc_length, speed
from symmotion.design import curve_program
from symmotion.report import Column, Figure, Player, Run, Study, StudyOptions, StudyResult, Table, Travelling, to_figure
from symmotion.views import COLOURS, new_figure

GRAVITY = 9.81  # m/s²
RESTITUTION = 0.8
HEIGHT = 1.0  # m, where the ball is let go
FRAME = 1 / 24  # s

# The camera's keys: times in s, places in m.
KEY_TIMES = np.array([0.0, 1.0, 1.6, 3.0, 4.0])
KEY_PLACES = np.array([[0.0, 0.0], [2.0, 1.6], [3.6, 1.2], [4.6, -0.8], [7.0, 0.0]])


def run(options: StudyOptions) -> StudyResult:
    runs: list[Run] = []
    options.progress("bouncing ball")
    ball_tables, ball_figure, ball, ball_text = _ball(runs)
    options.progress("camera")
    camera_tables, camera_figures, camera, camera_text = _camera(runs, 81 if options.full else 33)
    hops, limits = (float(worst_miss(t.rows)) for t in (ball_tables[0], camera_tables[0]))
    answer = (
        "Multipliers say which condition is the dear one: what a change of the ball's conditions costs they predict "
        f"to {hops:.1g} % or better, the price of the camera's speed limit to {limits:.1g} %."
    )
    return StudyResult(
        (*ball_tables, *camera_tables),
        (ball_figure, *camera_figures),
        tuple(runs),
        f"{ball_text}\n\n{camera_text}",
        players=(ball, camera),
        answer=answer,
    )


def worst_miss(rows: Sequence[tuple]) -> float:
    """By how much the last two numbers of a row differ, in percent of the last, at most; of rows that have them."""
    return max(100 * abs(r[-2] - r[-1]) / abs(r[-1]) for r in rows if r[-1] is not None)


def bounce_times(bounces: int) -> np.ndarray:
    """(bounces + 2,) when a ball is let go at HEIGHT, when it hits, and when it is at the top of its last hop, in s."""
    fall = np.sqrt(2 * HEIGHT / GRAVITY)
    flights = 2 * fall * RESTITUTION ** np.arange(1, bounces)
    hits = fall + np.concatenate([[0.0], np.cumsum(flights)])
    return np.concatenate([[0.0], hits, [hits[-1] + fall * RESTITUTION**bounces]])


def ball_program(times: np.ndarray) -> sm.program.Program:
    """Least ∫ h'''² with broken tangents at the hits `times[1:-1]`, each rebounding, and gravity in every hop."""
    hits, middles = times[1:-1], (times[1:] + times[:-1]) / 2
    at = CurveCondition.at
    conditions = [
        at(times[:1], [HEIGHT], name="height at the start"),
        at(times[[0, -1]], [0.0, 0.0], order=1, name="rest at the ends"),
        at(hits, np.zeros(len(hits)), name="floor"),
        at(middles, np.full(len(middles), -GRAVITY), order=2, name="gravity"),
        CurveCondition.linked(hits, -RESTITUTION),
    ]
    return curve_program(conditions, order=3, breaks=hits)


def _ball(runs: list[Run]) -> tuple[tuple[Table, ...], Figure, Player, str]:
    physical = bounce_times(3)
    # An animator puts the hits on whole frames and lets the second hop hang a little longer.
    drawn = np.round(physical / FRAME) * FRAME
    drawn[3:] += 2 * FRAME
    solutions: dict[str, sm.Solution] = {}
    for name, times in (("physical times", physical), ("times of the animator", drawn)):
        for solver in (sm.ExactNewton(), sm.Ipopt()):
            solution = solver.solve(ball_program(times))
            runs.append(Run.of(f"ball, {name}", solution))
            solutions.setdefault(name, solution)
    hits = np.r_[HEIGHT, np.zeros(len(drawn) - 2)]
    smooth = CurveCondition.at(drawn[:-1], hits), CurveCondition.at(drawn[[0, -1]], [0.0, 0.0], order=1)
    spline = sm.ExactNewton().solve(curve_program(smooth))
    above = CurveCondition.between(np.linspace(drawn[0], drawn[-1], 41), 0.0, np.inf, name="above the floor")
    bounded = sm.Ipopt().solve(curve_program([*smooth, above]))
    runs += [Run.of("ball, smooth", spline), Run.of("ball, smooth and above the floor", bounded)]

    physics, animated = solutions["physical times"], solutions["times of the animator"]
    rows = _sensitivities(animated, drawn)
    table = Table(
        "what a multiplier predicts: the ball at the animator's times",
        (
            Column("condition"),
            Column("time", "s"),
            Column("λ"),
            Column("change of the target"),
            Column("predicted change of ∫ h'''²"),
            Column("change when solved again"),
        ),
        tuple(rows),
        "−λ times the change, beside the optimum of the changed program: the difference is of second order.",
    )
    t = np.linspace(drawn[0], drawn[-1], 2001)
    worst = max(abs(r[4] - r[5]) / abs(r[5]) for r in rows)
    lowest, raised = float(spline.motion(t).min()), float(bounded.motion(t).min())
    price = bounded.multipliers["above the floor"]
    text = (
        f"Bouncing ball. At the physical times ∫ h'''² is {physics.objective:.2g}: gravity, floor and restitution "
        f"agree, and no multiplier exceeds {np.abs(physics.multiplier_vector).max():.2g}. "
        f"With the hits on whole frames and the second hop two frames longer "
        f"it is {animated.objective:.4g} m²/s⁵, and the multipliers say which demand is the dear "
        f"one: gravity in arc {int(np.argmax(np.abs(animated.multipliers['gravity']))) + 1} has the largest of "
        f"its kind. For a change of each target by 1e-4 they predict the new optimum to {100 * worst:.2g} % of the "
        f"change or better.\n\nWithout broken tangents the smoothest curve through the same keys falls {-lowest:.3g} m "
        f"through the floor. Forbidding that at 41 times raises ∫ h''² from {spline.objective:.4g} to "
        f"{bounded.objective:.4g} m²/s³ and keeps it above {min(raised, 0.0):.2g} m; the bound is active at "
        f"{int((np.abs(price) > 1e-6 * np.abs(price).max()).sum())} of the times."
    )
    figure = _ball_figure(physical, drawn, physics, animated, spline, bounded)
    shown = {"physical times": physics, "animator's times": animated, "smooth": spline, "above the floor": bounded}
    moving = {name: thrown(solution.motion, 0.7) for name, solution in shown.items()}
    caption = "The ball under the four curves, drifting to the right so that its hops are told apart."
    return (table,), figure, dot_player("ball", moving, 0.05, caption, unit="s"), text


def _sensitivities(solution: sm.Solution, times: np.ndarray) -> list[tuple]:
    program, rows = solution.program, []
    middles = (times[1:] + times[:-1]) / 2
    for name, at in (
        ("height at the start", times[:1]),
        ("floor", times[1:-1]),
        ("gravity", middles),
        ("rebound", times[1:-1]),
    ):
        block = program.constraint(name).block
        for i, moment in enumerate(at):
            change = 1e-4 * max(abs(float(block.data[i, 0])), 1.0)
            data = block.data.copy()
            data[i] += change
            again = sm.ExactNewton().solve(program.with_data(name, data))
            multiplier = float(solution.multipliers[name][i])
            predicted = -multiplier * change
            rows.append((name, moment, multiplier, change, predicted, again.objective - solution.objective))
    return rows


def _ball_figure(physical, drawn, physics, animated, spline, bounded) -> Figure:
    with new_figure(7.0, 5.2) as figure:
        height, forces = figure.subplots(2, 1)
        t = np.linspace(0, drawn[-1], 1201)
        short = t[t <= physical[-1]]
        height.plot(short, physics.motion(short), color=COLOURS[0], linewidth=1.0, label="physical times")
        height.plot(t, animated.motion(t), color=COLOURS[1], label="animator's times, broken tangents")
        height.plot(t, spline.motion(t), "--", color=COLOURS[2], label="smooth")
        height.plot(t, bounded.motion(t), color=COLOURS[3], label="smooth, above the floor")
        height.plot(drawn[:-1], np.r_[HEIGHT, np.zeros(len(drawn) - 2)], "o", color=COLOURS[5])
        height.set_ylabel("height [m]")
        figure.legend(*height.get_legend_handles_labels(), loc="outside upper left", ncols=2)
        for solution, colour, style in ((physics, COLOURS[0], ":"), (animated, COLOURS[1], "-")):
            ends = solution.motion.breakpoints
            when = np.linspace(ends[0], ends[-1], 1201)
            forces.plot(when, solution.motion(when, 2), style, color=colour)
        middles = (drawn[1:] + drawn[:-1]) / 2
        forces.plot(middles, np.full(len(middles), -GRAVITY), "o", color=COLOURS[5])
        forces.set_ylabel("acceleration [m/s²]")
        forces.set_xlabel("time [s]")
        return to_figure(
            figure,
            "ball",
            "A ball let go at 1 m. Above: through the same hits (dots) with broken tangents that rebound with 0.8 of "
            "the speed, and smooth, without and with a bound at the floor. Below: acceleration of the two broken "
            "curves, asked to be −g at the dots; at the physical times it is −g throughout.",
        )


def camera_program(limit: float | None, count: int) -> sm.program.Program:
    """Least ∫ ‖x''‖² through the camera's keys, at rest at both ends, with ‖x'‖ ≤ limit at `count` times."""
    conditions = [
        CurveCondition.at(KEY_TIMES, KEY_PLACES),
        CurveCondition.at(KEY_TIMES[[0, -1]], np.zeros((2, 2)), order=1),
    ]
    if limit is not None:
        times = np.linspace(KEY_TIMES[0], KEY_TIMES[-1], count)
        conditions.append(CurveCondition.norm_below(times, limit))
    return curve_program(conditions)


def _camera(runs: list[Run], count: int) -> tuple[tuple[Table, ...], tuple[Figure, ...], Player, str]:
    free = sm.ExactNewton().solve(camera_program(None, count))
    runs.append(Run.of("camera, no limit", free))
    t = np.linspace(KEY_TIMES[0], KEY_TIMES[-1], 4001)
    chord = float(np.max(np.linalg.norm(np.diff(KEY_PLACES, axis=0), axis=1) / np.diff(KEY_TIMES)))
    fastest = float(speed(free.motion, t).max())
    limits = np.linspace(fastest, chord, 8)[1:-1].round(2)
    solved: dict[float, sm.Solution] = {}
    rows: list[tuple] = [(None, free.objective, fastest, arc_length(free.motion), 0, 0.0, None)]
    for limit in limits.tolist():
        solution = sm.Ipopt().solve(camera_program(limit, count))
        runs.append(Run.of(f"camera, at most {limit:g} m/s", solution))
        solved[limit] = solution
        price = solution.multipliers["speed"]
        slope = -2 * limit * float(price.sum())
        step = 1e-3
        beside = [sm.Ipopt().solve(camera_program(limit + s, count)).objective for s in (step, -step)]
        rows.append(
            (
                limit,
                solution.objective,
                float(speed(solution.motion, t).max()),
                arc_length(solution.motion),
                int((price > 1e-6 * max(price.max(), 1e-300)).sum()),
                slope,
                (beside[0] - beside[1]) / (2 * step),
            )
        )
    table = Table(
        "camera: the price of a speed limit",
        (
            Column("limit", "m/s"),
            Column("∫ ‖x''‖²", "m²/s³"),
            Column("largest speed", "m/s"),
            Column("length of the path", "m"),
            Column("times at the limit"),
            Column("−2 v Σ λ", "m/s²"),
            Column("d f*/d v by differences", "m/s²"),
        ),
        tuple(rows),
        f"Speed bounded at {count} times; the largest speed is taken over 4001. The multipliers of ‖x'‖² ≤ v² give the "
        "slope of the optimum by the limit v.",
    )
    tightest = rows[-1]
    error = max(abs(r[5] - r[6]) / abs(r[6]) for r in rows[1:])
    excess = max(r[2] / r[0] - 1 for r in rows[1:])
    text = (
        f"Camera. Unlimited, the smoothest move reaches {fastest:.3g} m/s. No limit below {chord:.3g} m/s can hold, "
        f"the mean speed between two keys; at {tightest[0]:g} m/s ∫ ‖x''‖² has grown from {free.objective:.4g} to "
        f"{tightest[1]:.4g} m²/s³, and raising the limit would save {-tightest[5]:.4g} m²/s³ per m/s. The "
        f"multipliers give that rate within {100 * error:.2g} % of differences for every limit. Between the {count} "
        f"times the limit is exceeded by {100 * excess:.2g} % at most.\n\nThe objective is convex and so are the "
        "bounds: where a run's inertia is left open because it has inequalities, its first-order conditions alone "
        "make it a minimum."
    )
    tight = {"no limit": free, f"at most {tightest[0]:g} m/s": solved[tightest[0]]}
    moving = {name: Travelling(s.motion, (KEY_TIMES[0], KEY_TIMES[-1])) for name, s in tight.items()}
    caption = "The camera without a limit and under the tightest one. Grey: the keys."
    camera = dot_player("camera-path", moving, 0.12, caption, (KEY_TIMES, KEY_PLACES), "s")
    return (table,), (_camera_figure(free, solved, t, count), _price_figure(rows, free)), camera, text


def _camera_figure(free: sm.Solution, solved: dict[float, sm.Solution], t: np.ndarray, count: int) -> Figure:
    chosen = [list(solved)[k] for k in (1, -1)]
    with new_figure(7.0, 6.4) as figure:
        path, graph, prices = figure.subplots(3, 1, height_ratios=(1.3, 1.2, 1.0))
        # As in the player: without a limit orange, the tightest blue.
        cases, colours = [("no limit", free, COLOURS[1])], (COLOURS[2], COLOURS[0])
        cases += [(f"at most {v:g} m/s", solved[v], c) for v, c in zip(chosen, colours, strict=True)]
        for label, solution, colour in cases:
            points = solution.motion(t)
            path.plot(*points.T, color=colour, label=label)
            graph.plot(t, speed(solution.motion, t), color=colour)
        for v, colour in zip(chosen, colours, strict=True):
            graph.axhline(v, color=colour, linestyle=":", linewidth=1.0)
        path.plot(*KEY_PLACES.T, "o", color=COLOURS[5])
        path.set_aspect("equal")
        path.set_xlabel("x [m]")
        path.set_ylabel("y [m]")
        graph.set_ylabel("speed [m/s]")
        times = np.linspace(KEY_TIMES[0], KEY_TIMES[-1], count)
        width = (times[1] - times[0]) * 0.4
        for k, (v, colour) in enumerate(zip(chosen, colours, strict=True)):
            prices.bar(times + (k - 0.5) * width, solved[v].multipliers["speed"], width, color=colour)
        prices.set_ylabel("multiplier λ [1/s]")
        prices.set_xlabel("time [s]")
        for axes in (graph, prices):
            axes.set_xlim(KEY_TIMES[0] - 0.1, KEY_TIMES[-1] + 0.1)
        figure.legend(*path.get_legend_handles_labels(), loc="outside upper left", ncols=3)
        return to_figure(
            figure,
            "camera",
            "A camera through five keys, at rest at both ends: path, speed with the limits dotted, and the multiplier "
            "of the limit at each time, which is what the limit costs there.",
        )


def _price_figure(rows: list[tuple], free: sm.Solution) -> Figure:
    with new_figure(7.0, 3.0) as figure:
        axes = figure.subplots()
        limits, values, slopes = (np.array([r[k] for r in rows[1:]]) for k in (0, 1, 5))
        axes.plot(limits, values, "o-", color=COLOURS[0], linewidth=0.8, label="optimum")
        reach = 0.35 * np.abs(np.diff(limits)).min()
        for k, (v, f, s) in enumerate(zip(limits, values, slopes, strict=True)):
            label = "slope by the multipliers" if not k else None
            axes.plot([v - reach, v + reach], [f - s * reach, f + s * reach], color=COLOURS[1], label=label)
        axes.axhline(free.objective, color=COLOURS[5], linestyle=":", linewidth=1.0, label="no limit")
        axes.set_xlabel("speed limit [m/s]")
        axes.set_ylabel("∫ ‖x''‖² [m²/s³]")
        axes.legend()
        return to_figure(
            figure, "price", "What a speed limit costs, and the slope that the multipliers give at each limit."
        )


STUDY = Study(
    "curve_constraints",
    "What does a motion curve cost under conditions, and which condition is the dear one?",
    "Lecture notes on motion curves: Breaking Hermite splines; constraints with multipliers",
    run,
    order=51,
)
