"""PCG figures 1–5: a 15 × 15 net of rotations, faired."""

import numpy as np

import symmotion as sm
from studies.fairing.fairing_nets import (
    body,
    counts_table,
    detail_figure,
    fairness_figure,
    first_below,
    history_figure,
    largest_jumps,
    net_with,
    positions_figure,
    quartiles,
    rms,
    surface_figure,
    turn_error,
    turning_player,
)
from studies.shares import share, spread
from symmotion.fairing import fair, local_step_program
from symmotion.motions.quaternions import conjugate, product
from symmotion.report import Column, Figure, Run, Study, StudyOptions, StudyResult, Table, to_figure
from symmotion.views import COLOURS, draw_net, new_figure

INITIAL, TARGET, PCG_STEPS, PCG_SECONDS = 7.84, 0.002, 1930, 5.0
CHANGES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7)


def run(options: StudyOptions) -> StudyResult:
    seeds = range(50 if options.full else 8)
    rows, exact, noisy = [], [], []
    for ring in (False, True):
        options.progress("noisy ring" if ring else "exact ring")
        found = [_one(seed, ring) for seed in seeds]
        (noisy if ring else exact).extend(found)
        for seed, (smooth, net, sigma, r) in enumerate(found[:4]):
            name = f"{'noisy' if ring else 'exact'} ring, seed {seed}"
            errors = (rms(turn_error(net, smooth)), rms(turn_error(r.motion, smooth)))
            cost = 1e6 * r.seconds / max(r.steps, 1)
            rows.append((name, sigma, r.initial, r.final, r.best_step, r.seconds, cost, r.displacement.max(), *errors))
    rows.insert(0, ("PCG, as printed", None, INITIAL, TARGET, PCG_STEPS, PCG_SECONDS, None, None, None, None))
    steps = np.array([r.steps for _, _, _, r in exact if r.final <= TARGET])
    late = np.array([r.steps for _, _, _, r in noisy if r.final <= TARGET])
    smooth, net, _, _ = exact[0]
    options.progress("to the minimum")
    far = fair(net, max_steps=300_000 if options.full else 60_000, divergence=1e9)
    result = fair(net, target=TARGET)
    runs = _steps_as_programs(net, result.before)
    history = far.history
    up = float(np.mean(np.diff(history[: far.best_step + 1]) > 0))
    stops = tuple(_stop_row(change, [r.history for _, _, _, r in exact]) for change in CHANGES)
    continuity = tuple((name, *largest_jumps(motion)) for name, motion in (("before", net), ("after", result.motion)))
    counts = tuple(
        (name, len(c), len(exact), *quartiles(c)) for name, c in (("exact ring", steps), ("noisy ring", late))
    )
    tables = (_iterations(rows), counts_table(counts, PCG_STEPS), _stops(stops), _continuity(continuity))
    mesh, name, note = body()
    motions = (net, result.motion)
    small = mesh.scaled(1.1)
    figures = (
        _nets(motions),
        surface_figure(
            motions,
            "rotation",
            "isophotes",
            "The quaternion surface as Rodrigues vectors about the mean rotation (central projection of the image "
            "space): isophotes under two lights, and zebra stripes.",
        ),
        detail_figure(motions, "rotation", "detail", "Isophotes on the middle of the quaternion surface."),
        fairness_figure(result),
        positions_figure(
            motions,
            small,
            "control-positions",
            f"The {name} at the 15 × 15 control rotations, set apart in the plane.",
            controls=True,
            spread=1.0,
        ),
        positions_figure(
            motions,
            mesh.scaled(1.4),
            "motion",
            f"The {name} under the motion, at 9 × 9 parameters, set apart in the plane.",
            controls=False,
            spread=1.0,
        ),
        history_figure(
            {"G": history, "best so far": np.minimum.accumulate(history)},
            "history",
            f"G over the steps of PCG table 1 on the net of seed 0, run on past its minimum; dashed: {TARGET}.",
            TARGET,
        ),
    )
    conclusion = _conclusion(steps, late, len(exact), far, up, stops, continuity)
    moving = turning_player(motions, small, f"The {name} along the middle curve v = const of the motion.")
    answer = (
        f"Local fairing reaches G ≤ {TARGET} on {share(len(steps), len(exact))} nets whose ring is exact, in "
        f"{spread(steps, 4)} steps, and on {share(len(late), len(noisy))} with noise in the ring."
    )
    return StudyResult(tables, figures, runs, conclusion, (note,), (moving,), answer)


def _one(seed: int, ring: bool):
    smooth, net, sigma = net_with(INITIAL, seed=seed, ring=ring)
    return smooth, net, sigma, fair(net, target=TARGET)


def _steps_as_programs(net, measures: np.ndarray) -> tuple[Run, ...]:
    """The step at the unfairest knot as a constrained program, by our Newton method and by IPOPT."""
    k, l = np.unravel_index(int(measures.argmax()), measures.shape)  # noqa: E741 - PCG's letters
    runs = []
    for step in ("nine", "orthogonal"):
        program = local_step_program(net, (int(k), int(l)), step=step)
        case = f"local step at knot ({k}, {l}), {program.unknowns // 4} controls"
        runs += [Run.of(case, solver.solve(program)) for solver in (sm.ExactNewton(), sm.Ipopt())]
    return tuple(runs)


def _stop_row(change: float, histories: list[np.ndarray]) -> tuple:
    stops = [first_below(h, change) for h in histories]
    values = [float(h[s]) for h, s in zip(histories, stops, strict=True)]
    fired = sum(s < len(h) - 1 for h, s in zip(histories, stops, strict=True))
    return change, fired, min(stops), max(stops), min(values), max(values)


def _iterations(rows: list) -> Table:
    return Table(
        "iterations",
        (
            Column("net"),
            Column("σ of the noise"),
            Column("G before"),
            Column("G after"),
            Column("steps"),
            Column("time", "s"),
            Column("per step", "µs"),
            Column("largest displacement"),
            Column("error before, RMS", "°"),
            Column("error after, RMS", "°"),
        ),
        tuple(rows),
        f"PCG table 1 until G ≤ {TARGET}. Uniform knots at distance 1, unit control quaternions but for the noise; G "
        "goes with the square of their scale and the sixth power of the distance. Error: control rotations against the "
        "smooth net. The noise is scaled so that G before is PCG's.",
    )


def _stops(rows: tuple) -> Table:
    return Table(
        "the stop rule",
        (
            Column("ε"),
            Column("nets where it fires"),
            Column("first step"),
            Column("last step"),
            Column("least G there"),
            Column("largest G there"),
        ),
        rows,
        f"Where |Gʲ⁺¹ − Gʲ| < ε, PCG (23), would stop the iteration, before G ≤ {TARGET}; nets with exact ring.",
    )


def _continuity(rows: tuple) -> Table:
    return Table(
        "third-order continuity",
        (Column("net"), Column("largest jump at the knots"), Column("largest jump on the knot lines")),
        rows,
        "Largest |Δuuu| or |Δvvv| of the quaternion surface: PCG's C³ is at the knots; on the lines between them "
        "the third derivatives across still jump.",
    )


def _conclusion(
    steps: np.ndarray, late: np.ndarray, count: int, far, up: float, stops: tuple, continuity: tuple
) -> str:
    history = far.history
    reached = f"G ≤ {TARGET} is reached on {len(steps)} of {count} nets whose ring is exact"
    if len(steps):
        reached += f", after {steps.min()} to {steps.max()} steps (median {np.median(steps):.0f}; PCG: {PCG_STEPS})"
    other = f"With noise in the ring too, which no step can move, it is reached on {len(late)} of {count}"
    if len(late):
        other += f", after {late.min()} to {late.max()} steps"
    end = "grows again" if history[-1] > 1.05 * history[far.best_step] else "stays near it"
    fired = [s for s in stops if s[1]]
    widest = max(fired, key=lambda s: s[5] / s[4]) if fired else None
    rule = (
        f"PCG's stop |Gʲ⁺¹ − Gʲ| < ε fires by chance: with ε = {widest[0]:g} between G = {widest[4]:.3g} and "
        f"{widest[5]:.3g}, depending on the net"
        if widest
        else "PCG's stop |Gʲ⁺¹ − Gʲ| < ε does not fire before the target for the ε tried"
    )
    return (
        f"{reached}. {other}.\n\n"
        f"G is not monotone: {100 * up:.0f} % of the steps up to the minimum raise it. The least G is "
        f"{history[far.best_step]:.3g} at step {far.best_step}; after {far.steps} steps G is {history[-1]:.3g}: it "
        f"{end}, since moving 9 of the 21 controls that the two jumps read is an oblique projection. The best net "
        f"seen is what `fair` returns.\n\n{rule}. A target for G and the best net kept take its place.\n\n"
        f"At the knots the largest jump falls from {continuity[0][1]:.3g} to {continuity[1][1]:.3g}, along the knot "
        f"lines from {continuity[0][2]:.3g} to {continuity[1][2]:.3g}: continuity of third order at the knots is not "
        "continuity across the lines."
    )


def _nets(motions) -> Figure:
    mean = conjugate(motions[0].mean_rotation)
    with new_figure(7.0, 2.9) as figure:
        for k, (axes, motion) in enumerate(zip(figure.subplots(1, 2), motions, strict=True)):
            q = product(mean, motion.real)
            draw_net(axes, q[..., 1:] / q[..., :1], colour=(COLOURS[1], COLOURS[0])[k])
            axes.set_title(("before", "after")[k])
        return to_figure(
            figure,
            "control-net",
            "The 15 × 15 control quaternions in E³, as Rodrigues vectors about the mean rotation.",
        )


STUDY = Study(
    "fairing_spherical",
    "Does local fairing make a two-parameter spherical motion third-order continuous, and how fast?",
    "PCG 4–5, table 1, figures 1–5",
    run,
    order=40,
)
