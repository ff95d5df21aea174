"""PCG figures 6–8: a 15 × 15 net of displacements in space, faired."""

import numpy as np

import symmotion as sm
from studies.fairing.fairing_nets import (
    body,
    counts_table,
    detail_figure,
    fairness,
    fairness_figure,
    history_figure,
    largest_jumps,
    positions_figure,
    quartiles,
    rms,
    surface_figure,
    turn_error,
    turning_player,
)
from studies.shares import share, spread
from symmotion.fairing import METHODS, FairingResult, Method, fair, local_step_program
from symmotion.motions import DualQuaternions, TwoParameterMotion, noisy_net, smooth_net
from symmotion.report import Column, Run, Study, StudyOptions, StudyResult, Table

REAL, DUAL, TARGET, PCG_STEPS = 7.84, 10.195, 0.003, 3052
CHOICES = ("dual", "translation", "real+dual", "real+translation")
POINT = np.array([0.0, 0.0, 2.0])


def net_in_space(seed: int) -> tuple[TwoParameterMotion, TwoParameterMotion, float]:
    """A smooth spatial net, the same with noise, and the length that makes G of its dual part PCG's.

    PCG take the real part as faired before: the noise of the dual part is that of the translation.
    """
    smooth = smooth_net(spatial=True)
    sigma = 0.01 * np.sqrt(REAL / fairness(noisy_net(smooth, 0.01, seed=seed), "real"))
    net = noisy_net(smooth, sigma, translation=0.05, seed=seed)
    faired = fair(net, target=0.002, parts="real").motion
    length = float(np.sqrt(fairness(faired, "dual") / DUAL))
    return smooth, net, length


def run(options: StudyOptions) -> StudyResult:
    rows, done, off = [], {}, []
    seeds = range(20 if options.full else 8)
    for seed in seeds:
        options.progress(f"seed {seed}")
        smooth, net, length = net_in_space(seed)
        off.append(rms(_place_error(net, smooth)))
        real = fair(net, target=0.002, parts="real")
        for parts in CHOICES:
            # The dual part or the translation alone after the real part, as PCG do it, or both in one go.
            start = net if parts.startswith("real+") else real.motion
            result = fair(start, target=TARGET, parts=parts, length=length)
            done[seed, parts] = result
            rows.append(_row(seed, parts, smooth, result, length))
    options.progress("all methods")
    ways = [by_method(seed) for seed in seeds[: None if options.full else 1]]
    smooth, net, length = net_in_space(0)
    result = done[0, "dual"]
    best = done[0, "real+translation"]
    motions = (net, result.motion)
    mesh, name, note = body()
    origins = tuple(_seen_from(net, offset, length) for offset in (0.0, 10.0, 100.0))
    steps = [done[s, "dual"].steps for s in seeds if done[s, "dual"].final <= TARGET]
    # Over the noise of each net, which is that of its seed.
    error = {p: spread(r[9] for r in rows if r[1] == p) for p in CHOICES}
    counts = []
    for p in CHOICES:
        taken = np.array([done[seed, p].steps for seed in seeds if done[seed, p].final <= TARGET])
        counts.append((p, len(taken), len(seeds), *quartiles(taken)))
    tables = (
        _table(rows),
        counts_table(tuple(counts), PCG_STEPS),
        methods_table(ways),
        Table(
            "origin",
            (Column("distance of the origin"), Column("G of the dual part"), Column("G of the translation")),
            origins,
            "The same motion in fixed frames whose origins lie further away: the motion is the same, its measure not.",
        ),
        Table(
            "third-order continuity",
            (Column("net"), Column("largest jump at the knots"), Column("largest jump on the knot lines")),
            tuple((n, *largest_jumps(m, "dual", length)) for n, m in zip(("before", "after"), motions, strict=True)),
            f"Of the dual part, in units of {length:.3g} lengths.",
        ),
    )
    figures = (
        surface_figure(
            motions, "dual", "dual-part", "The surface of the dual part, 2 vec(Q⁰M*): isophotes and zebra stripes."
        ),
        detail_figure(motions, "dual", "detail", "Isophotes on the middle of the surface of the dual part."),
        surface_figure(
            (net, best.motion),
            "trajectory",
            "trajectory-surface",
            "The trajectory surface of the body point (0, 0, 2), real part and translation faired.",
            POINT,
        ),
        fairness_figure(result),
        positions_figure(
            motions,
            mesh.scaled(1.1),
            "control-positions",
            f"The {name} at the control positions.",
            controls=True,
            spread=0,
        ),
        positions_figure(
            motions,
            mesh.scaled(1.6),
            "motion",
            f"The {name} under the motion, 9 × 9 parameters.",
            controls=False,
            spread=0,
        ),
        history_figure(
            {p: done[0, p].history for p in CHOICES}, "history", f"G over the steps; dashed: {TARGET}.", TARGET
        ),
    )
    by = {row[0]: row for row in origins}
    before = spread(off)
    conclusion = (
        f"With the real part faired first, G of the dual part falls from {result.initial:.4g} to {TARGET} on "
        f"{len(steps)} of {len(seeds)} nets"
        + (f", after {min(steps)} to {max(steps)} steps (PCG: {PCG_STEPS})" if steps else "")
        + ".\n\n"
        f"The motion that comes out depends on what is faired: the translations' error against the smooth net, "
        f"{before} before (RMS), is {error['dual']} where the dual part is faired and "
        f"{error['translation']} where the translation is.\n\n"
        f"A motion by dual quaternions does not depend on the frames, but its measure does: with the origin 100 "
        f"units away G of the dual part of the same motion is {by[100.0][1]:.3g} instead of {by[0.0][1]:.3g}, since "
        "Q⁰ = ½ d Q then holds the noise of Q times the distance. The translation's own G stays "
        f"{by[0.0][2]:.3g}. Fair the translation, or put the origin amid the motion."
    )
    moving = turning_player(motions, mesh.scaled(1.6), f"The {name} along the middle curve v = const of the motion.")
    answer = (
        f"G of the dual part falls to {TARGET} on {share(len(steps), len(seeds))} nets; translations, off by "
        f"{before} before, are by {error['dual']} then, by {error['translation']} where they are faired."
    )
    runs = _programs(net, result, length)
    return StudyResult(tables, figures, runs, conclusion, (note,), (moving,), answer)


def by_method(seed: int) -> dict[str, tuple[float, ...]]:
    """Real part and translation faired together by every method: G, RMS displacement, errors in degrees and lengths.

    Local steps and least squares to PCG's G; with bounds no further at any control than greedy steps or least squares.
    """
    smooth, net, length = net_in_space(seed)

    def faired(method: Method, target: float | None = None, bound: float | None = None):
        return fair(net, method, parts="real+translation", length=length, target=target, tolerance=bound)

    found = {method: faired(method, target=TARGET) for method in METHODS if method != "bounded"}
    most = {f"bounded as {name}": float(found[name].displacement.max()) for name in ("greedy", "least-squares")}
    found |= {name: faired("bounded", bound=bound) for name, bound in most.items()}
    return {
        name: (r.final, rms(r.displacement), rms(turn_error(r.motion, smooth)), rms(_place_error(r.motion, smooth)))
        for name, r in found.items()
    }


def methods_table(ways: list[dict[str, tuple[float, ...]]]) -> Table:
    """Medians over nets."""
    columns = (
        Column("method"),
        Column("nets"),
        Column("G, median"),
        Column("displacement, RMS"),
        Column("rotation error, RMS", "°"),
        Column("translation error, RMS", "length"),
    )
    rows = tuple((name, len(ways), *np.median([w[name] for w in ways], axis=0).tolist()) for name in ways[0])
    caption = (
        f"Real part and translation together; local steps and least squares until G ≤ {TARGET}, bounded: no control "
        "moves further than the furthest of that method."
    )
    return Table("every method", columns, rows, caption)


def _place_error(motion: TwoParameterMotion, smooth: TwoParameterMotion) -> np.ndarray:
    difference = motion.control_displacements.translation - smooth.control_displacements.translation
    return np.linalg.norm(difference, axis=-1)


def _row(seed: int, parts: str, smooth: TwoParameterMotion, r: FairingResult, length: float) -> tuple:
    errors = rms(turn_error(r.motion, smooth)), rms(_place_error(r.motion, smooth))
    return seed, parts, length, r.initial, r.final, str(r.status), r.steps, r.seconds, *errors


def _seen_from(net: TwoParameterMotion, offset: float, length: float) -> tuple[float, float, float]:
    moved = net.seen_from(DualQuaternions.from_parts([1.0, 0, 0, 0], [offset, 0, 0]))
    return offset, fairness(moved, "dual", length), fairness(moved, "translation", length)


def _programs(net: TwoParameterMotion, result: FairingResult, length: float) -> tuple[Run, ...]:
    k, l = np.unravel_index(int(result.before.argmax()), result.before.shape)  # noqa: E741 - PCG's letters
    runs = []
    for parts in ("dual", "real+dual", "real+translation"):
        program = local_step_program(net, (int(k), int(l)), parts=parts, length=length)
        runs += [Run.of(f"local step, {parts}", solver.solve(program)) for solver in (sm.ExactNewton(), sm.Ipopt())]
    return tuple(runs)


def _table(rows: list) -> Table:
    columns = (
        Column("seed"),
        Column("faired"),
        Column("unit of length"),
        Column("G before"),
        Column("G after"),
        Column("ended by"),
        Column("steps"),
        Column("time", "s"),
        Column("rotation error, RMS", "°"),
        Column("translation error, RMS", "length"),
    )
    return Table(
        "what is faired",
        columns,
        tuple(rows),
        f"PCG table 1 until G ≤ {TARGET}; dual part or translation alone start from the net whose real part is "
        f"faired to 0.002. The unit of length is chosen so that G of the dual part is PCG's {DUAL} before; one unit is "
        "the distance between neighbouring controls.",
    )


STUDY = Study(
    "fairing_spatial",
    "What of a spatial two-parameter motion should be faired: dual part or translation, with or after the real part?",
    "PCG 6, figures 6–8",
    run,
    order=41,
)
