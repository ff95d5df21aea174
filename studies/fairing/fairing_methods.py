"""All ways to fair a net, on the same nets: how fair, how far from the start and from the truth, how fast."""

from time import perf_counter

import numpy as np

import symmotion as sm
from studies.fairing import fairing_seeds
from studies.fairing.fairing_nets import fairness, history_figure, net_with, rippled, rms, turn_error
from studies.shares import spread
from symmotion.fairing import FairingResult, Method, fair, fairing_program
from symmotion.motions import noisy_net, smooth_net
from symmotion.report import Column, Figure, Run, Study, StudyOptions, StudyResult, Table, to_figure
from symmotion.views import COLOURS, new_figure

INITIAL = 7.84  # PCG's G before, for their 121 knots
PER_KNOT = 0.002 / 121  # and what they reach


def run(options: StudyOptions) -> StudyResult:
    rows, runs, results = [], [], {}
    for n in (15, 30, 60) if options.full else (15,):
        knots = (n - 4) ** 2
        smooth, net, sigma = net_with(INITIAL * knots / 121, n)
        for name, keywords in _methods(PER_KNOT * knots, sigma, n, options.full):
            options.progress(f"{n} × {n}, {name}")
            r = fair(net, **keywords)
            results[n, name] = r
            rows.append(_row(n, name, r, net, smooth))
        runs += _programs(n, net, sigma)
    options.progress("past the minimum")
    smooth, net, _ = net_with(INITIAL)
    steps = 300_000 if options.full else 50_000
    local: tuple[Method, ...] = ("greedy", "orthogonal")
    past = {str(m): fair(net, m, max_steps=steps, divergence=1e9) for m in local}
    options.progress("over-fairing")
    truth = rippled(smooth, 3.0)
    rough = truth.with_controls(truth.real + (net.real - smooth.real), None)
    compared: tuple[Method, ...] = ("greedy", "orthogonal", "least-squares")
    curves = {str(name): _path(rough, truth, name) for name in compared}
    options.progress("growth")
    growth = tuple(_growth(n) for n in ((15, 30, 60, 120, 240) if options.full else (15, 30)))
    seeds = fairing_seeds.study(options.full, options.progress)
    shown = fairing_seeds.tables(seeds)
    tables = (*shown, _table(rows), _past_table(past), _curves_table(curves), _growth_table(growth))
    figures = (
        fairing_seeds.figure(seeds),
        history_figure(
            {m: r.history for m, r in past.items()},
            "past-the-minimum",
            "G over the steps on a 15 × 15 net, run on past the minimum; dashed: PCG's 0.002.",
            0.002,
        ),
        _over_fairing(curves, rms(turn_error(rough, truth)), fairness(truth)),
        _growth_figure(growth),
    )
    steps = spread(seeds.steps[fairing_seeds.SPACINGS[0], "greedy"], 4)
    first, least = results[15, "greedy"], results[15, "least squares"]
    grows = sum(points[-1][1] > 1.02 * min(p[1] for p in points) for points in curves.values())
    answer = (
        f"To G ≤ 0.002 a 15 × 15 net moves by {rms(least.displacement):.3g} (RMS) by least squares, by "
        f"{rms(first.displacement):.3g} by {steps} greedy steps; faired on, the "
        "error against the truth grows again in "
        f"{grows} of {len(curves)} ways."
    )
    text = f"{fairing_seeds.told(seeds)}\n\n{_conclusion(results, past, curves, growth)}"
    return StudyResult(tables, figures, tuple(runs), text, answer=answer)


def _methods(target: float, sigma: float, n: int, full: bool) -> list[tuple[str, dict]]:
    methods: list[tuple[str, dict]] = [
        ("greedy", {"method": "greedy", "target": target}),
        ("greedy, no target", {"method": "greedy"}),
        ("greedy, displacement ≤ 3σ", {"method": "greedy", "tolerance": 3 * sigma, "max_steps": 10 * (n - 4) ** 2}),
        ("orthogonal", {"method": "orthogonal", "target": target}),
        ("least squares", {"method": "least-squares", "target": target}),
        ("least squares, w = 1", {"method": "least-squares", "weight": 1.0}),
    ]
    if n == 15 or (full and n == 30):
        methods.append(("bounded, displacement ≤ 3σ", {"method": "bounded", "tolerance": 3 * sigma}))
    return methods


def _row(n: int, name: str, r: FairingResult, net, smooth) -> tuple:
    errors = rms(turn_error(net, smooth)), rms(turn_error(r.motion, smooth))
    most = float(r.displacement.max())
    return f"{n} × {n}", name, r.initial, r.final, str(r.status), r.steps, r.seconds, most, rms(r.displacement), *errors


def _programs(n: int, net, sigma: float) -> list[Run]:
    """The global problems as programs: their certificates."""
    quadratic = fairing_program(net, weight=1.0)
    runs = [Run.of(f"{n} × {n}, least squares, w = 1", sm.ExactNewton().solve(quadratic))]
    if n <= 15:
        runs.append(Run.of(f"{n} × {n}, least squares, w = 1", sm.Ipopt().solve(quadratic)))
        bounded = fairing_program(net, tolerance=3 * sigma)
        runs.append(Run.of(f"{n} × {n}, displacement ≤ 3σ", sm.Ipopt().solve(bounded)))
    return runs


def _path(net, smooth, method: Method) -> list[tuple[float, float]]:
    """G and the error against the smooth net, for targets ever lower."""
    found = []
    for target in np.geomspace(4.0, 1e-3 if method != "least-squares" else 1e-4, 12):
        r = fair(net, method, target=float(target))
        if r.final <= target * 1.001:
            found.append((r.final, rms(turn_error(r.motion, smooth))))
    return found


def _growth(n: int) -> tuple:
    net = noisy_net(smooth_net(n), 0.015, seed=1)
    greedy = fair(net, max_steps=3000)
    least = [fair(net, "least-squares", weight=1.0).seconds for _ in range(2 if n > 60 else 5)]
    began = perf_counter()
    fair(net, max_steps=1)
    setup = perf_counter() - began
    return n, (n - 4) ** 2, setup, 1e6 * max(greedy.seconds - setup, 0.0) / greedy.steps, min(least)


def _table(rows: list) -> Table:
    columns = (
        Column("net"),
        Column("method"),
        Column("G before"),
        Column("G after"),
        Column("ended by"),
        Column("steps"),
        Column("time", "s"),
        Column("largest displacement"),
        Column("displacement, RMS"),
        Column("error before, RMS", "°"),
        Column("error after, RMS", "°"),
    )
    return Table(
        "methods",
        columns,
        tuple(rows),
        "The same nets for all methods, ring exact, uniform knots at distance 1, unit quaternions but for the noise; G "
        "per knot before and the target are PCG's. Steps: local ones, or the solver's iterations. Error: control "
        "rotations against the smooth net. Solvers' times are for one thread, with what they build and compile.",
    )


def _past_table(past: dict[str, FairingResult]) -> Table:
    rows = []
    for name, r in past.items():
        h = r.history
        up = float(np.mean(np.diff(h[: r.best_step + 1]) > 0))
        above = float(np.max(h[: r.best_step + 1] / np.minimum.accumulate(h[: r.best_step + 1])))
        rows.append((name, r.best_step, float(h[r.best_step]), r.steps, float(h[-1]), 100 * up, above))
    columns = (
        Column("method"),
        Column("step of the least G"),
        Column("least G"),
        Column("steps"),
        Column("G at the end"),
        Column("steps that raise G", "%"),
        Column("G over the best so far, at most"),
    )
    caption = "Both local steps on a 15 × 15 net, run on past the minimum. The last columns: up to it."
    return Table("past the minimum", columns, tuple(rows), caption)


def _curves_table(curves: dict[str, list[tuple[float, float]]]) -> Table:
    rows = [(name, g, e) for name, points in curves.items() for g, e in points]
    return Table(
        "over-fairing",
        (Column("method"), Column("G"), Column("error, RMS", "°")),
        tuple(rows),
        "Error of the control rotations against a true net with ripples, for ever lower targets, 15 × 15.",
    )


def _growth_table(rows: tuple) -> Table:
    columns = (
        Column("n"),
        Column("knots"),
        Column("tables", "s"),
        Column("greedy step", "µs"),
        Column("least squares", "s"),
    )
    return Table("growth", columns, rows, "n × n nets: the tables made once, a step, and the least squares with w = 1.")


def _over_fairing(curves: dict[str, list[tuple[float, float]]], before: float, true: float) -> Figure:
    with new_figure(7.0, 3.0) as figure:
        axes = figure.subplots()
        for (name, points), colour, marker in zip(curves.items(), COLOURS, "osv", strict=False):
            g, e = np.array(points).T
            axes.plot(g, e, color=colour, marker=marker, label=name)
        axes.set_xscale("log")
        axes.axhline(before, color="#000000", linewidth=0.7, linestyle="--")
        axes.axvline(true, color="#000000", linewidth=0.7, linestyle=":")
        axes.invert_xaxis()
        axes.set_ylim(0, None)
        axes.set_xlabel("G, fairer to the right")
        axes.set_ylabel("error [°]")
        figure.legend(loc="outside upper left", ncols=3)
        return to_figure(
            figure,
            "over-fairing",
            "RMS error of the control rotations against the true net, over G; dashed: before fairing; dotted: G of "
            "the true net, which turns to and fro by 3° over six controls.",
        )


def _growth_figure(rows: tuple) -> Figure:
    n, _, tables, step, least = (np.array(c, dtype=float) for c in zip(*rows, strict=True))
    with new_figure(7.0, 2.8) as figure:
        axes = figure.subplots()
        for values, name, colour, marker in (
            (step * 1e-6, "one greedy step", COLOURS[0], "o"),
            (tables, "tables", COLOURS[2], "^"),
            (least, "least squares", COLOURS[1], "s"),
        ):
            axes.loglog(n, values, color=colour, marker=marker, label=name)
        axes.set_xticks(n, [f"{k:.0f}" for k in n])
        axes.minorticks_off()
        axes.set_xlabel("controls in each direction")
        axes.set_ylabel("time [s]")
        figure.legend(loc="outside upper left", ncols=3)
        return to_figure(figure, "growth", "Time over the size of the net.")


def _conclusion(results: dict, past: dict, curves: dict, growth: tuple) -> str:
    greedy, orthogonal = past["greedy"], past["orthogonal"]
    first, least = results[15, "greedy"], results[15, "least squares"]
    lowest = {name: min(points, key=lambda p: p[1]) for name, points in curves.items()}
    last = {name: points[-1] for name, points in curves.items()}
    grows = [name for name in curves if last[name][1] > 1.02 * lowest[name][1]]
    over = "; ".join(
        f"{name}: {lowest[name][1]:.3g}° at G = {lowest[name][0]:.3g}, {last[name][1]:.3g}° at {last[name][0]:.3g}"
        for name in grows
    )
    return (
        f"On a 15 × 15 net G ≤ 0.002 takes the greedy steps {first.steps} steps and {first.seconds:.3g} s, the "
        f"orthogonal ones {results[15, 'orthogonal'].steps}; the least squares reach it with an RMS displacement of "
        f"{rms(least.displacement):.3g} against {rms(first.displacement):.3g}.\n\n"
        f"Run on, the greedy steps have their least G, {greedy.history[greedy.best_step]:.3g}, at step "
        f"{greedy.best_step}; after {greedy.steps} steps G is {greedy.history[-1]:.3g}. The orthogonal steps are at "
        f"{orthogonal.history[-1]:.3g} then, and their least is {orthogonal.history[orthogonal.best_step]:.3g}.\n\n"
        + (
            "Over-fairing is real: where the truth itself is not all smooth, the error has a minimum and grows again "
            f"({over}).\n\n"
            if grows
            else "In this range of G the error against the truth falls all the way.\n\n"
        )
        + f"A step costs {growth[0][3]:.3g} µs at 15 × 15 and {growth[-1][3]:.3g} µs at {growth[-1][0]}²; "
        f"the least squares {1e3 * growth[0][4]:.3g} ms and {growth[-1][4]:.3g} s."
    )


STUDY = Study(
    "fairing_methods",
    "Local steps, least squares or bounds: which way of fairing is the fairest, the closest, the fastest?",
    "PCG table 1 and Hahmann's step against global problems",
    run,
    order=42,
)
