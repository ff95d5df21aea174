"""The explicit saddle system against the eliminated one: condition, accuracy of multipliers, regularity, and cost."""

from collections.abc import Mapping, Sequence
from statistics import median
from time import process_time

import numpy as np

import symmotion as sm
from studies.shares import ends, ratio, spread, with_interval
from studies.solving.contest import tables
from studies.solving.contest.attempts import PATIENCE
from studies.solving.problem_set import load
from studies.solving.problem_set.families import CORNERS, DEGENERATE, FAMILIES
from studies.solving.problem_set.tasks import program, quick
from symmotion.report import Column, Figure, Study, StudyOptions, StudyResult, Table, to_figure
from symmotion.systems import Condensed, Saddle
from symmotion.views import COLOURS, new_figure

DEGREES, REFINES = (3, 5, 7), (1, 2, 4)
KEYFRAMES, ANGLE = 8, 40
# R alone comes near zero, where hardly anything is curved, as freedom grows: it is looked at with one knot per segment.
OBJECTIVES = {"R": sm.Rigidity(), "R + 0.01 E": sm.Rigidity() + 1e-2 * sm.TrajectoryEnergy(CORNERS)}
Conditions = Mapping[tuple[str, int, int], list[tuple[float, ...]]]
SYSTEMS = ("explicit, as it is", "explicit, rows of length one", "eliminated", "orthonormal null space")
# Singular values, relative to the largest, below which conditions depend on each other, and curvature is none.
REGULAR, CURVED = 1e-7, 1e-10
STRICT = 1e-5  # multipliers relative to the heaviest, below which a bound that is met does not press
SAME_POINT = 1e-3  # relative: minimisers that are nearer are the same
DENSE = 1000  # unknowns of the largest that are looked at
SOLVERS = {
    "newton, condensed": sm.ExactNewton(kernels="interpreted", time_limit=PATIENCE),
    "newton, sparse": sm.ExactNewton(kernels="interpreted", time_limit=PATIENCE, system="sparse"),
    "ipopt": sm.Ipopt(kernels="interpreted", time_limit=PATIENCE),
    "elimination": sm.Elimination(time_limit=PATIENCE),
}


def run(options: StudyOptions) -> StudyResult:
    seeds = range(8 if options.full else 2)  # of the costs; one of the conditions in the quick form
    options.progress("condition")
    refines = REFINES if options.full else REFINES[:1]
    cases = [(name, p, r) for name in OBJECTIVES for p in DEGREES for r in refines if name != "R" or r == 1]
    conditions = {
        (name, p, r): [condition(name, p, r, seed) for seed in (seeds if options.full else (0,))]
        for name, p, r in cases
    }
    names = [r["name"] for r in load.manifest()["problems"] if r["unknowns"] <= DENSE] if options.full else []
    names = names or [t.name for t in quick(1, 110)]
    agreed = agreements(names, options)
    options.progress("regularity")
    regular = [
        (row, regularity(row["name"])) for row in load.manifest()["problems"] if row["name"] in names and row["best"]
    ]
    options.progress("cost")
    spent = {n: [cost(n, seed) for seed in seeds] for n in ((20, 100, 400, 1000) if options.full else (20, 100))}
    shown = (_conditions(conditions), _agreements(agreed), _regular(regular), _costs(spent))
    explicit, reduced = ([spread((c[k] for c in conditions["R", p, 1]), 2) for p in DEGREES] for k in (1, 2))
    factor, low, high = ratio(*zip(*spent[100], strict=True))
    answer = (
        "At degrees 3, 5, 7 the explicit system has condition "
        f"{', '.join(f'{v:.0e}' for v in _middle(conditions, 1))}, "
        f"the eliminated one {', '.join(f'{v:.0e}' for v in _middle(conditions, 2))}; at 100 keyframes it takes "
        f"{factor:.2g} ({low:.2g}–{high:.2g}) times the CPU."
    )
    text = (
        f"Condition at the minimum of R, {KEYFRAMES} keyframes in space, one knot per segment, median (least–most) "
        "over "
        f"{len(seeds)} seeds: explicit with rows of length one {'; '.join(explicit)}; eliminated {'; '.join(reduced)} "
        "for degrees 3, 5 and 7. Both grow by orders of magnitude with the degree of the B-splines, and far less with "
        "refinement: it is the Hessian that is ill-conditioned, not the conditions.\n\n"
        "The explicit form gives every condition its multiplier, without which there are no prices and no derivatives "
        "of the optimum; eliminating banded conditions gives the same multipliers from the pivots' rows. It costs the "
        "ratio in the last table, and takes conditions that no control of their own can carry, curved ones and bounds "
        f"too.\n\n{_told(regular)}"
    )
    note = "Limits: dense linear algebra, so at most 1,000 unknowns; multipliers are compared where they are unique."
    return StudyResult(shown, (_figure(conditions),), (), text, (note,), answer=answer)


def condition(name: str, degree: int, refine: int, seed: int) -> tuple[float, ...]:
    """The 2-norm condition numbers of SYSTEMS at a minimum."""
    keys = sm.examples.random_keyframes(KEYFRAMES, ANGLE, seed)
    made = sm.affine_program(keys, degree=degree, refine=refine, objective=OBJECTIVES[name])
    solution = sm.ExactNewton(max_iterations=1000, kernels="interpreted").solve(made).require(1e-6)
    evaluator = sm.program.Evaluator(made, "interpreted")
    saddle = Saddle(made, evaluator.jacobian(solution.x))
    flat = evaluator.second_order(solution.x, saddle.pattern, solution.multiplier_vector)[1]
    whole, n = saddle.matrix(flat).toarray(), made.unknowns
    hessian, jacobian = whole[:n, :n], evaluator.jacobian(solution.x).toarray()
    hessian = hessian / np.linalg.norm(hessian, 2)
    rows = jacobian / np.linalg.norm(jacobian, axis=1, keepdims=True)
    orthonormal = np.linalg.svd(rows)[2][len(rows) :].T
    condensed = Condensed.of(made)
    assert condensed is not None
    eliminated = np.kron(condensed.basis.toarray(), np.eye(condensed.channels))
    matrices = (
        np.block([[hessian, jacobian.T], [jacobian, np.zeros((len(rows), len(rows)))]]),
        np.block([[hessian, rows.T], [rows, np.zeros((len(rows), len(rows)))]]),
        eliminated.T @ hessian @ eliminated,
        orthonormal.T @ hessian @ orthonormal,
    )
    return tuple(float(np.linalg.cond(m)) for m in matrices)


def _middle(found: Conditions, k: int) -> list[float]:
    return [median(c[k] for c in found["R", p, 1]) for p in DEGREES]


def _conditions(found: Conditions) -> Table:
    rows = []
    for (name, degree, refine), values in found.items():
        for k, system in enumerate(SYSTEMS):
            column = sorted(v[k] for v in values)
            rows.append((name, degree, refine, system, median(column), column[0], column[-1]))
    columns = (
        Column("objective"),
        Column("degree"),
        Column("knots per segment"),
        Column("system"),
        Column("condition"),
        Column("least", end=True),
        Column("most", end=True),
    )
    caption = (
        f"2-norm condition numbers at a minimum, {KEYFRAMES} keyframes in space turned by {ANGLE}°; the Hessian "
        f"scaled to norm one. Median, least and most of {len(next(iter(found.values())))} seeds."
    )
    return Table("condition", columns, tuple(rows), caption)


def _figure(found: Conditions) -> Figure:
    with new_figure(6.0, 2.8) as figure:
        axes = figure.subplots()
        for k, (system, marker) in enumerate(zip(SYSTEMS, "osv^", strict=True)):
            values = np.array([[c[k] for c in found["R", p, 1]] for p in DEGREES])
            middle = np.median(values, axis=1)
            bars = middle - values.min(axis=1), values.max(axis=1) - middle
            place = np.array(DEGREES) + 0.12 * (k - 1.5)
            axes.errorbar(place, middle, bars, color=COLOURS[k], marker=marker, capsize=2, label=system)
        axes.set_yscale("log")
        axes.set_xticks(DEGREES)
        axes.set_xlabel("degree")
        axes.set_ylabel("condition")
        figure.legend(loc="outside upper left", ncols=2)
        caption = (
            "Condition of the systems for R by degree, one knot per segment: median, least and most over the seeds."
        )
        return to_figure(figure, "condition", caption)


def agreements(names: Sequence[str], options: StudyOptions) -> dict[str, list[tuple[float, float]]]:
    """By solver, how far minimiser and multipliers are from those of the finest solve, at the same minimum."""
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in SOLVERS}
    finest = sm.ExactNewton(tolerance=1e-13, kernels="interpreted", time_limit=PATIENCE)
    rows = {row["name"]: row for row in load.manifest()["problems"]}
    for name in names:
        if rows[name]["family"] == DEGENERATE:  # its multipliers are not unique
            continue
        options.progress(f"multipliers: {name}")
        made = program(name)
        solutions = {}
        for method, solver in SOLVERS.items():
            try:
                solutions[method] = solver.solve(made)
            except sm.InputError:
                continue
        good = [s for s in solutions.values() if s.certified]
        if not good:
            continue
        least = min(good, key=lambda s: s.objective)
        best = finest.solve(made, least.x)
        if best.certificate.degenerate or not best.certificate.holds(1e-8):
            continue
        for method, s in solutions.items():
            if s.certified and _off(s.x, best.x) < SAME_POINT:
                found[method].append((_off(s.x, best.x), _off(s.multiplier_vector, best.multiplier_vector)))
    return found


def _off(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs(a - b).max(initial=0.0) / (np.abs(b).max(initial=0.0) or 1.0))


def _agreements(found: dict[str, list[tuple[float, float]]]) -> Table:
    rows = []
    for method, pairs in found.items():
        if pairs:
            columns = [np.quantile([p[k] for p in pairs], (0.5, 0.9, 1.0)).tolist() for k in (0, 1)]
            rows.append((method, len(pairs), *columns[0], *columns[1]))
    names = [Column(f"{what}, {q}") for what in ("Δ minimiser", "Δ multipliers") for q in ("median", "of 90 %", "most")]
    caption = (
        "How far, relative to the largest entry, each solver's minimiser and multipliers at 1e-8 are from those of "
        "Newton's method at 1e-13 from the best of them, where both are at the same minimum."
    )
    return Table("multipliers", (Column("solver"), Column("problems"), *names), tuple(rows), caption)


def regularity(name: str) -> dict[str, float]:
    """What the set's own loader finds at the best minimum known, by CasADi's derivatives of the plain problem."""
    problem = load.load(name)
    assert problem.x is not None and problem.multipliers is not None
    found = problem.check(problem.x, problem.multipliers)
    g = np.asarray(problem.function(problem.x, problem.p0)[1]).ravel()
    unequal = problem.lbg < problem.ubg
    reach = np.maximum(np.abs(g), 1.0)
    met = unequal & (np.minimum(problem.ubg - g, g - problem.lbg) < STRICT * reach)
    heaviest = np.abs(problem.multipliers).max(initial=0.0) or 1.0
    weak = met & (np.abs(problem.multipliers) < STRICT * heaviest)
    return {**found, "met": float(met.sum()), "weak": float(weak.sum())}


def _regular(found: Sequence[tuple[dict, dict[str, float]]]) -> Table:
    rows = []
    for family in (*FAMILIES, "all"):
        mine = [f for row, f in found if family in (row["family"], "all")]
        if mine:
            counts = [sum(test(f) for f in mine) for test in (_independent, _curved, _strict)]
            shares = [end for n in counts for end in with_interval(n, len(mine))]
            curvature = [f["curvature"] for f in mine]
            rows.append((family, len(mine), *shares, min(f["independence"] for f in mine), min(curvature)))
    columns = (
        Column("family"),
        Column("problems"),
        Column("LICQ", "%"),
        *ends("LICQ"),
        Column("second order", "%"),
        *ends("second order"),
        Column("strict complementarity", "%"),
        *ends("strict complementarity"),
        Column("least singular value"),
        Column("least curvature"),
    )
    caption = (
        f"At the best minima known. LICQ: conditions that press, rows of length one, have no singular value below "
        f"{REGULAR:g} of the largest; second order: the Hessian of the Lagrangian along them has no eigenvalue below "
        f"{CURVED:g} of the largest; strict: no bound is met without a multiplier ({STRICT:g} of the heaviest)."
    )
    return Table("regularity", columns, tuple(rows), caption)


def _independent(found: dict[str, float]) -> bool:
    return found["independence"] > REGULAR


def _curved(found: dict[str, float]) -> bool:
    return found["curvature"] > CURVED


def _strict(found: dict[str, float]) -> bool:
    return not found["weak"]


def _told(found: Sequence[tuple[dict, dict[str, float]]]) -> str:
    tested = [f for _, f in found]
    names = ("LICQ", "second-order conditions", "strict complementarity")
    counts = [sum(test(f) for f in tested) for test in (_independent, _curved, _strict)]
    parts = [f"{name} at {tables.share(n, len(tested))}" for name, n in zip(names, counts, strict=True)]
    return f"Of the best minima known, by the derivatives of CasADi's plain problem: {', '.join(parts)}."


def cost(count: int, seed: int) -> tuple[float, float]:
    """CPU seconds of the same descent on the explicit and on the eliminated system."""
    made = sm.affine_program(sm.examples.random_keyframes(count, ANGLE, seed))
    found = []
    for system in ("sparse", "condensed"):
        solver = sm.ExactNewton(kernels="interpreted", system=system)
        solver.solve(made)  # functions and patterns are made
        began = process_time()
        solver.solve(made).require()
        found.append(process_time() - began)
    return found[0], found[1]


def _costs(found: dict[int, list[tuple[float, float]]]) -> Table:
    rows = []
    for count, pairs in found.items():
        made = sm.affine_program(sm.examples.random_keyframes(count, ANGLE, 0))
        explicit, eliminated = zip(*pairs, strict=True)
        sizes = made.unknowns + made.conditions, made.unknowns - made.conditions
        times = 1e3 * median(explicit), 1e3 * median(eliminated)
        rows.append((count, *sizes, *times, *ratio(explicit, eliminated)))
    columns = (
        Column("keyframes"),
        Column("explicit, rows"),
        Column("eliminated, rows"),
        Column("explicit, CPU", "ms"),
        Column("eliminated, CPU", "ms"),
        Column("ratio"),
        Column("from", end=True),
        Column("to", end=True),
    )
    caption = "Solves of R at 40°; medians, and the geometric mean of the ratios with its 95 % interval over seeds."
    return Table("cost", columns, tuple(rows), caption)


STUDY = Study(
    "conditioning",
    "Explicit conditions or eliminated ones: which system is better conditioned, what do multipliers cost and give?",
    "HJK 4.3; Nocedal, Wright 2006, chapters 12 and 16",
    run,
    order=9,
    effort=6.0,
)
