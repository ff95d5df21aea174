"""What each keyframe costs, and which way to move it: multipliers as answers."""

import numpy as np

import symmotion as sm
from symmotion.bodies import letter_k
from symmotion.report import Column, Figure, Run, Study, StudyOptions, StudyResult, Table, player, to_figure
from symmotion.views import COLOURS, draw_body, draw_path, new_figure

OBJECTIVE = sm.Rigidity(2) + 0.05 * sm.TrajectoryEnergy(np.concatenate([np.zeros((1, 2)), np.eye(2)]))
LENGTHS = (0.003, 0.01, 0.03, 0.1)


def keyframes() -> sm.Keyframes:
    """Six planar keyframes of a steady turn along an arc, of which one is off: turned too far and set aside."""
    angles = np.array([0.0, 30.0, 60.0, 90.0, 120.0, 150.0])
    linear = [sm.examples.rotation_2d(a) for a in angles]
    linear[3] = sm.examples.rotation_2d(112.0)
    path = 6 * np.column_stack([1 - np.cos(np.deg2rad(angles)), np.sin(np.deg2rad(angles))])
    path[3] += [0.5, 0.3]
    return sm.Keyframes(np.arange(6.0), np.stack(linear), path)


def run(options: StudyOptions) -> StudyResult:
    keys = keyframes()
    program = sm.affine_program(keys, objective=OBJECTIVE)
    comparison = sm.compare(program, [sm.ExactNewton(), sm.Ipopt()])
    solution = comparison.solutions[0].require()
    prices = sm.answers.keyframe_prices(solution)
    rows = tuple(
        (
            int(i),
            float(keys.times[i]),
            float(prices.size[i]),
            float(np.deg2rad(1) * prices.turning[i]),
            *(float(g) for g in prices.gradient.translation[i]),
        )
        for i in prices.ranking
    )
    columns = (
        Column("keyframe"),
        Column("time"),
        Column("‖λ‖"),
        Column("change per degree of turning"),
        Column("per unit to the right"),
        Column("per unit up"),
    )
    table = Table("prices", columns, rows, "First-order change of the optimum with each keyframe, the dearest first.")
    predicted = []
    worst = int(prices.ranking[0])
    for i in prices.ranking[: 6 if options.full else 3]:
        for length in LENGTHS:
            options.progress(f"keyframe {i} moved by {length:g}")
            moved = prices.downhill(int(i), length)
            again = sm.ExactNewton().solve(program.with_keyframes(moved), start=solution).require()
            predicted.append((int(i), length, prices.predict(moved), again.objective - solution.objective))
    check = Table(
        "predicted and actual",
        (Column("keyframe"), Column("moved by"), Column("predicted change"), Column("actual change")),
        tuple(predicted),
        "Each keyframe moved the way its multiplier says, and the program solved again.",
    )
    small, large = predicted[0], predicted[len(LENGTHS) - 1]
    conclusion = (
        f"Keyframe {worst} is the dearest: it was turned 22° too far and set aside on purpose. The prices say how to "
        f"mend it: one degree of turning changes the optimum of {solution.objective:.4g} by "
        f"{np.deg2rad(1) * prices.turning[worst]:+.3g}, so turn it back.\n\n"
        f"Moved by {small[1]:g} the way −λ says, the optimum changes by {small[3]:.4g}, predicted {small[2]:.4g}; "
        f"moved by {large[1]:g}, by {large[3]:.4g}, predicted {large[2]:.4g}: a price is a slope."
    )
    figures = (_prices_figure(keys, solution, prices), _check_figure(predicted))
    runs = tuple(Run.of("six planar keyframes", s) for s in comparison.solutions)
    caption = "A letter K under the optimal motion. Grey: the keyframes."
    moving = player("motion", {"optimum": solution.motion}, letter_k(), caption, keys)
    answer = (
        f"The multipliers name keyframe {worst} as the dearest; what moving it by {small[1]:g} gains they predict to "
        f"{100 * abs(small[2] / small[3] - 1):.2g} %, by {large[1]:g} to {100 * abs(large[2] / large[3] - 1):.0f} %."
    )
    return StudyResult((table, check), figures, runs, conclusion, players=(moving,), answer=answer)


def _prices_figure(keys: sm.Keyframes, solution: sm.Solution, prices) -> Figure:
    with new_figure(7.0, 3.6) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(1.5, 1))
        draw_path(left, solution.motion)
        draw_body(left, solution.motion, letter_k(), np.linspace(0, 5, 31), COLOURS[0], 0.08)
        share = prices.size / prices.size.max()
        for i, t in enumerate(keys.times):
            draw_body(left, solution.motion, letter_k(), np.array([t]), COLOURS[1], 0.15 + 0.75 * share[i])
            left.annotate(str(i), keys.translation[i] + [0.0, 1.1], ha="center", fontsize=9)
        left.margins(0.08, 0.16)
        left.autoscale_view()
        # The arrow points where the keyframe's place would rather be.
        way = -prices.gradient.translation
        scale = 1.6 / np.linalg.norm(way, axis=1).max()
        for place, arrow in zip(keys.translation, way * scale, strict=True):
            left.annotate(
                "", place + arrow, place, arrowprops={"arrowstyle": "-|>", "color": "#000000", "linewidth": 1.2}
            )
        right.barh(range(len(keys)), prices.size, color=COLOURS[1])
        right.set_yticks(range(len(keys)), [f"keyframe {i}" for i in range(len(keys))])
        right.invert_yaxis()
        right.set_xlabel("price ‖λ‖")
        right.grid(False, axis="y")
        return to_figure(
            figure,
            "prices",
            "The deeper the colour, the more a keyframe costs. Arrows: where it should be moved to lower the cost, "
            "long for much.",
        )


def _check_figure(predicted: list[tuple[int, float, float, float]]) -> Figure:
    with new_figure(7.0, 2.8) as figure:
        axes = figure.subplots()
        for k, i in enumerate(dict.fromkeys(row[0] for row in predicted)):
            mine = [row for row in predicted if row[0] == i]
            lengths = [row[1] for row in mine]
            axes.plot(lengths, [row[2] for row in mine], "--", color=COLOURS[k % 6])
            axes.plot(lengths, [row[3] for row in mine], "o", color=COLOURS[k % 6], label=f"keyframe {i}")
        axes.set_xlabel("keyframe moved by")
        axes.set_ylabel("change of the optimum")
        figure.legend(loc="outside upper left", ncols=6)
        return to_figure(figure, "predicted", "Dots: change of the optimum when solved again; dashed: what λ predicts.")


STUDY = Study(
    "keyframe_prices",
    "What does each keyframe cost, and which way should it be moved?",
    "HJK 4.3, which eliminates the conditions that have these answers",
    run,
    order=11,
)
