"""Tables of a contest: every share with its interval, every difference with its exact test."""

from collections.abc import Callable, Iterable, Sequence
from statistics import median

from studies.shares import ends, paired, ratio, share, shifted_mean, with_interval
from studies.solving.contest.attempts import SAME, Attempt, Contest
from symmotion.report import Column, Table

SHIFT = 0.01  # seconds, of the geometric means
LIMITS = (
    "Limits: all problems are symmotion's own, small kernels applied many times, and were chosen by its authors; they "
    "say nothing of other nonlinear programs. Random starts are noise about the programs' own. The best value known is "
    "no proof of a global minimum, and was looked for with the two solvers that it judges. Certificate and derivatives "
    "are symmotion's, the same for all, which spares IPOPT its own differentiation. One machine; CPU times of solves "
    "of milliseconds differ from run to run.",
)
Test = Callable[[Attempt], bool]


def by_problem(contest: Contest, method: str, starts: int, test: Test, family: str | None = None) -> dict[str, bool]:
    """Whether one of a method's first starts passes a test, by problem."""
    return {p: any(map(test, found)) for p, found in contest.of(method, starts, family).items()}


def passed(contest: Contest, method: str, starts: int, test: Test, family: str | None = None) -> str:
    """The share of problems on which one of a method's first starts passes a test, in words."""
    found = by_problem(contest, method, starts, test, family)
    return share(sum(found.values()), len(found))


def certified(attempt: Attempt) -> bool:
    return attempt.certified


def results(contest: Contest, budgets: Iterable[int], name: str = "equal budgets") -> Table:
    """What each method reaches from one start, and from as many as the budgets say."""
    rows = []
    for starts in budgets:
        for method in contest.methods:
            found = contest.of(method, starts)
            counts = [sum(by_problem(contest, method, starts, t).values()) for t in (certified, contest.reached)]
            seconds = [sum(a.seconds for a in attempts) for attempts in found.values()]
            evaluations = [float(sum(a.evaluations for a in attempts)) for attempts in found.values()]
            shares = [end for n in counts for end in with_interval(n, len(found))]
            per_second = counts[0] / sum(seconds) if sum(seconds) else None
            means = 1e3 * shifted_mean(seconds, SHIFT), shifted_mean(evaluations, 1.0)
            rows.append((starts, method, len(found), *shares, *means, per_second))
    columns = (
        Column("starts"),
        Column("solver"),
        Column("problems"),
        Column("certified", "%"),
        *ends("certified"),
        Column("best known", "%"),
        *ends("best known"),
        Column("CPU", "ms"),
        Column("evaluations"),
        Column("certified problems per second", "1/s"),
    )
    caption = (
        "From the same starts. Certified: a strict local minimum by symmotion's certificate, to the solver's "
        f"tolerance; best known: certified, and within {SAME:g} of the least certified value that anyone found. With "
        "several starts, one of them counts. In brackets: Wilson's 95 % interval. CPU of all starts, without building "
        "the program and deriving its functions, and evaluations of all kinds, failed runs too: geometric means, "
        f"shifted by {1e3 * SHIFT:g} ms and 1."
    )
    return Table(name, columns, tuple(rows), caption)


def differences(contest: Contest, first: str, starts: Sequence[int], others: Sequence[str] | None = None) -> Table:
    """One method against each other one, problem by problem."""
    rows = []
    for count in starts:
        for other in contest.methods if others is None else others:
            if other == first:
                continue
            for what, test in (("certified", certified), ("best known", contest.reached)):
                pairs = _pairs(contest, first, other, count, test)
                rows.append(
                    (count, other, what, len(pairs[0]), *paired(*pairs), *_faster(contest, first, other, count))
                )
    columns = (
        Column("starts"),
        Column(f"{first} against"),
        Column("what"),
        Column("problems"),
        Column(f"only {first}"),
        Column("only the other"),
        Column("p"),
        Column("CPU, other / first"),
        Column("from", end=True),
        Column("to", end=True),
    )
    caption = (
        "On the problems that both take. p: exact two-sided test of McNemar, not corrected for the number of rows. "
        "CPU: "
        "geometric mean of the ratios over the problems that both certify, with a 95 % interval of the bootstrap."
    )
    return Table("differences", columns, tuple(rows), caption)


def _pairs(contest: Contest, first: str, other: str, starts: int, test: Test) -> tuple[list[bool], list[bool]]:
    one, two = (by_problem(contest, method, starts, test) for method in (first, other))
    both = [p for p in one if p in two]
    return [one[p] for p in both], [two[p] for p in both]


def _faster(contest: Contest, first: str, other: str, starts: int) -> tuple[float, float, float] | tuple[None, ...]:
    one, two = (contest.of(method, starts) for method in (first, other))
    both = [p for p in one if any(map(certified, one[p])) and any(map(certified, two.get(p, ())))]
    if not both:
        return None, None, None
    return ratio(*([sum(a.seconds for a in found[p]) for p in both] for found in (two, one)))


def speedup(contest: Contest, first: str, other: str, starts: int = 1) -> str:
    """How many times as long the other one takes, on the problems that both certify: "2.1 (1.9–2.4)"."""
    middle, low, high = _faster(contest, first, other, starts)
    return "–" if middle is None else f"{middle:.3g} ({low:.3g}–{high:.3g})"


def outdone(contest: Contest, first: str, other: str, starts: int, test: Test) -> tuple[int, int, float]:
    """On how many problems only the first passes a test, on how many only the other, and p."""
    return paired(*_pairs(contest, first, other, starts, test))


def by_family(contest: Contest, methods: Sequence[str] | None = None) -> Table:
    """From one start, by family."""
    rows = []
    for family in (*contest.families, None):
        for method in contest.methods if methods is None else methods:
            found = [a for attempts in contest.of(method, 1, family).values() for a in attempts]
            if not found:
                continue
            counts = sum(a.certified for a in found), sum(map(contest.reached, found))
            iterations = [a.iterations for a in found if a.certified]
            means = 1e3 * shifted_mean((a.seconds for a in found), SHIFT), 1e3 * max(a.seconds for a in found)
            shares = [end for n in counts for end in with_interval(n, len(found))]
            rows.append(
                (family or "all", method, len(found), *shares, median(iterations) if iterations else None, *means)
            )
    columns = (
        Column("family"),
        Column("solver"),
        Column("problems"),
        Column("certified", "%"),
        *ends("certified"),
        Column("best known", "%"),
        *ends("best known"),
        Column("iterations"),
        Column("CPU", "ms"),
        Column("longest", "ms"),
    )
    caption = "From the programs' own starts. Iterations: medians over certified runs. The rest as under equal budgets."
    return Table("families", columns, tuple(rows), caption)


def claims(contest: Contest) -> Table:
    """What solvers say of themselves against what the certificate says."""
    rows = []
    for method in contest.methods:
        found = [a for attempts in contest.of(method, 1).values() for a in attempts]
        cases = [sum((a.claimed, a.certified) == case for a in found) for case in CASES]
        rows.append((method, len(found), *cases, *with_interval(cases[0] + cases[3], len(found))))
    columns = (
        Column("solver"),
        Column("problems"),
        Column("says solved and is"),
        Column("says solved and is not"),
        Column("says failed and is certified"),
        Column("says failed and is not"),
        Column("right", "%"),
        *ends("right"),
    )
    caption = "Of itself, before symmotion's certificate; solved: a certified strict minimum. From one start."
    return Table("claims", columns, tuple(rows), caption)


CASES = ((True, True), (True, False), (False, True), (False, False))
