"""What conditions cost a faired net: keyframes, borders, and how far the controls go, by every method and many nets."""

import numpy as np

import symmotion as sm
from studies.fairing.fairing_nets import rippled, rms, turn_error
from studies.fairing.forms import forms_table, multipliers_table
from studies.fairing.isophotes import break_figure, break_table, isophote_breaks
from studies.fairing.pareto import KNOTS, SIGMA, Point, levels, middling, pareto, pareto_figure, pareto_table
from studies.fairing.recorded_turns import faired_turns, stretches, turns_figure, turns_table, turns_told
from studies.shares import spread
from symmotion.fairing import FairingResult, fair, fairing_path, fairing_program
from symmotion.motions import DualQuaternions, TwoParameterMotion, noisy_net, smooth_net
from symmotion.report import Column, Figure, Run, Study, StudyOptions, StudyResult, Table, to_figure
from symmotion.views import COLOURS, new_figure

BORDERS = ("free", "G0", "G1", "G2", "ring")


def run(options: StudyOptions) -> StudyResult:
    n, seeds = (15, 20) if options.full else (9, 8)
    smooth = rippled(smooth_net(n), 2.0)
    nets = [noisy_net(smooth, SIGMA, seed=seed, ring=True) for seed in range(seeds)]
    options.progress("Pareto")
    points = pareto([(nets[k], smooth, "uniform") for k in range(seeds)], options.full)
    for knots in KNOTS[1:]:
        spaced = [TwoParameterMotion.from_displacements(net.control_displacements, knots, knots) for net in nets]
        points += pareto([(net, smooth, knots) for net in spaced], options.full)
    options.progress("keyframes and borders")
    keyframes = [keyframe_costs(net, smooth, seed) for seed, net in enumerate(nets)]
    borders = [[fair(net, noise=SIGMA, borders=b).final for b in BORDERS] for net in nets]
    options.progress("how much")
    amounts = [how_much(net, smooth) for net in nets]
    options.progress("programs")
    program = fairing_program(nets[0], weight=1.0, keyframes=near(smooth, 4, 0))
    runs = [Run.of("least squares with 4 keyframes", s.solve(program)) for s in (sm.ExactNewton(), sm.Ipopt())]
    breaks = isophote_breaks(nets[0])
    options.progress("forms")
    forms = forms_table(nets[0], near(smooth, 4, 0)), multipliers_table(nets)
    options.progress("recorded orientation")
    recorded, notes = stretches(options.data)
    turns = turns_table(faired_turns(recorded))
    tables = (
        pareto_table(points),
        _keyframe_table(keyframes),
        _border_table(borders),
        _amount_table(amounts),
        break_table(breaks),
        *forms,
        turns,
    )
    figures = (pareto_figure(points), _path_figure(nets[0]), break_figure(nets[0]), turns_figure(recorded[0]))
    text, answer = _conclusion(points, keyframes, borders, amounts, breaks), _answer(points, keyframes)
    return StudyResult(tables, figures, tuple(runs), f"{text}\n\n{turns_told(turns)}", notes, answer=answer)


def near(motion: TwoParameterMotion, count: int, seed: int) -> list:
    """Displacements of the motion at random parameters inside."""
    rng, ((a, b), (c, d)) = np.random.default_rng(seed), motion.domain
    at = [(float(rng.uniform(a + 1, b - 1)), float(rng.uniform(c + 1, d - 1))) for _ in range(count)]
    return [(place, motion(*place)) for place in at]


def keyframe_costs(net: TwoParameterMotion, smooth: TwoParameterMotion, seed: int) -> tuple[float, ...]:
    """G by least squares without keyframes, with 4 of the truth, with 4 turned by 2°, and with weights 1 beside."""
    keys = near(smooth, 4, seed)
    turn = DualQuaternions.from_axis_angle([0.0, 0, 1], np.deg2rad(2.0))
    turned = [(at, DualQuaternions.from_matrices(k.linear) @ turn) for at, k in keys]
    strict = [sm.fairing.NetKeyframe(at, k, weight=1.0) for at, k in turned]
    results: list[FairingResult] = [
        fair(net, "least-squares", weight=1.0),
        *(fair(net, "least-squares", weight=1.0, keyframes=k) for k in (keys, turned, strict)),
        fair(net, "orthogonal", max_steps=600, keyframes=turned),
    ]
    return tuple(r.final for r in results)


def how_much(net: TwoParameterMotion, smooth: TwoParameterMotion) -> tuple[float, ...]:
    """RMS error against the truth in degrees: as measured, at the corner, by the discrepancy, at the best weight."""
    path = fairing_path(net)
    weights = (path.corner(), fair(net, noise=SIGMA).weight or 1.0)
    errors = [rms(turn_error(fair(net, "least-squares", weight=w).motion, smooth)) for w in weights]
    tried = np.geomspace(1e-3, 1e3, 13)
    best = [rms(turn_error(fair(net, "least-squares", weight=float(w)).motion, smooth)) for w in tried]
    return rms(turn_error(net, smooth)), *errors, min(best), *weights, float(tried[int(np.argmin(best))])


def _keyframe_table(rows: list[tuple[float, ...]]) -> Table:
    names = (
        "none",
        "4 of the truth",
        "4 turned by 2°",
        "the same with weight 1",
        "the same turned, orthogonal steps",
    )
    values = np.array(rows)
    table = tuple(
        (name, *middling(values[:, k]), *middling(values[:, k] / values[:, 0])) for k, name in enumerate(names)
    )
    columns = (
        Column("keyframes"),
        Column("G, median"),
        Column("least", end=True),
        Column("largest", end=True),
        Column("over that without, median"),
        Column("least ratio", end=True),
        Column("largest ratio", end=True),
    )
    return Table("keyframes", columns, table, f"Least squares with w = 1, {len(rows)} nets.")


def _border_table(rows: list[list[float]]) -> Table:
    values = np.array(rows)
    table = tuple((b, *middling(values[:, k])) for k, b in enumerate(BORDERS))
    columns = (Column("border"), Column("G, median"), Column("least", end=True), Column("largest", end=True))
    return Table("borders", columns, table, f"All four sides, weight by the discrepancy, {len(rows)} nets.")


def _amount_table(rows: list[tuple[float, ...]]) -> Table:
    values = np.array(rows)
    names = ("as measured", "corner of the L-curve", "discrepancy", "best weight")
    weights = (None, 4, 5, 6)
    table = tuple(
        (name, *middling(values[:, k]), None if w is None else float(np.median(values[:, w])))
        for k, (name, w) in enumerate(zip(names, weights, strict=True))
    )
    columns = (
        Column("weight by"),
        Column("error, RMS, median", "°"),
        Column("least", "°", end=True),
        Column("largest", "°", end=True),
        Column("weight, median"),
    )
    return Table("how much", columns, table, "Error of the control rotations against the true net, which has ripples.")


def _path_figure(net: TwoParameterMotion) -> Figure:
    path = fairing_path(net)
    w = np.geomspace(path.weights[0], path.weights[-1], 300)[1:-1]
    g, d = path.at(w)
    with new_figure(7.0, 3.0) as figure:
        axes = figure.subplots()
        axes.loglog(d, g, color=COLOURS[0], label="all weights")
        axes.loglog(path.displacement, path.fairness, "o", color=COLOURS[0], markersize=3, label="solved")
        for weight, label, colour in (
            (path.corner(), "corner", COLOURS[1]),
            (path.discrepancy(SIGMA), "discrepancy", COLOURS[2]),
        ):
            axes.loglog(*(float(x) for x in reversed(path.at(weight))), "D", color=colour, label=label)
        axes.set_xlabel("Σ|d − d⁰|²")
        axes.set_ylabel("G")
        figure.legend(loc="outside upper left", ncols=4)
        return to_figure(figure, "path", "The L-curve of the first net, its corner, and where the noise says to stop.")


def _answer(points: list[Point], keyframes: list) -> str:
    base = {(p.seed, k): p.fairness for k, p in levels(points, "least squares", "uniform")}
    greedy, gaussian = (
        spread(p.fairness / base[p.seed, k] for k, p in levels(points, m, "uniform")) for m in ("greedy", "Gaussian")
    )
    dearer = spread(k[1] / k[0] for k in keyframes)
    return (
        f"At equal displacement greedy steps leave {greedy} times the G of least squares, Gaussian smoothing "
        f"{gaussian}; four keyframes multiply G by {dearer}, over {len(keyframes)} nets."
    )


def _conclusion(points: list[Point], keyframes: list, borders: list, amounts: list, breaks: list[tuple]) -> str:
    base = {(p.seed, k): p.fairness for k, p in levels(points, "least squares", "uniform")}
    ratio = {
        m: middling([p.fairness / base[p.seed, k] for k, p in levels(points, m, "uniform")])
        for m in ("greedy", "orthogonal", "Gaussian")
    }
    k, b, a = np.array(keyframes), np.median(borders, axis=0), np.median(amounts, axis=0)
    shown = "; ".join(f"{m} {r[0]:.3g} times (from {r[1]:.3g} to {r[2]:.3g})" for m, r in ratio.items())
    return (
        f"At equal displacement the G of other methods over that of least squares, over {len(keyframes)} nets: {shown}."
        f"\n\nFour keyframes of the truth multiply G by {np.median(k[:, 1] / k[:, 0]):.3g}, four turned by 2° by "
        f"{np.median(k[:, 2] / k[:, 0]):.3g}, with weights {np.median(k[:, 3] / k[:, 0]):.3g}. By the discrepancy "
        f"G is {b[0]:.3g} with free borders, {b[1]:.3g} with G0, {b[2]:.3g} with G1, {b[3]:.3g} with G2.\n\n"
        f"The noise known, the discrepancy leaves an error of {a[2]:.3g}° of {a[0]:.3g}°; the best weight {a[3]:.3g}°, "
        f"the corner of the L-curve {a[1]:.3g}°.\n\nAcross knots isophotes of a C¹ surface break by "
        f"{breaks[0][1]:.3g}° (RMS), of a C² one by {breaks[1][1]:.2g}°; their curvature breaks by {breaks[1][2]:.2g} "
        f"of its size there, and by {breaks[2][2]:.2g} after fairing."
    )


STUDY = Study(
    "fairing_conditions",
    "What do keyframes, borders and bounds cost a faired net, and how much should it be faired?",
    "PCG and Hahmann's step with conditions",
    run,
    order=44,
)
