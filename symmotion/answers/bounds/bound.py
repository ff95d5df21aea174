"""How low an objective can be at all: a certified bound below every minimum, and the minimisers that attain it."""

from dataclasses import dataclass
from typing import Generic

from symmotion import checks
from symmotion.answers.bounds.extraction import points, rank
from symmotion.answers.bounds.proof import Proof, proved
from symmotion.answers.bounds.quartic import Chart, gram_forms
from symmotion.answers.bounds.relaxation import Moments, relaxed
from symmotion.program import DesignT, Program
from symmotion.program.program import require_program
from symmotion.solvers import ExactNewton, Solution, Solver, Status
from symmotion.solvers.minima import SAME, same
from symmotion.solvers.solver import require_solver, start_vector

TIME_LIMIT = 600.0


@dataclass(frozen=True, eq=False)
class LowerBound(Generic[DesignT]):
    """No point that meets a program's conditions has a lower objective than `value`.

    gap: f* − value, by which the lowest known minimum may still be undercut; rank: of the moment matrix, one where one
    minimiser is left, more where several tie or the relaxation is not exact. minimisers: the lowest solutions known,
    which tie, those read from the moments and polished among them; `best` the first.
    relaxation: the value of the relaxation itself, as the solver gives it; proof: what makes a bound of it, "proved"
    or "numerical" where `proof.valid` is False. moments, status: of the semidefinite program, their number, and what
    the solver says.

    >>> bound = sm.lower_bound(sm.affine_program(sm.examples.planar_keyframes(), refine=0))
    >>> bound.holds()
    True
    """

    program: Program[DesignT]
    value: float
    rank: int
    minimisers: tuple[Solution[DesignT], ...]
    relaxation: float
    proof: Proof
    moments: int
    status: str

    @property
    def best(self) -> Solution[DesignT]:
        """The lowest solution known."""
        return self.minimisers[0]

    @property
    def gap(self) -> float:
        """f* − value, in units of the objective."""
        return self.best.objective - self.value

    def holds(self, tolerance: float = 1e-6) -> bool:
        """Whether the lowest known minimum is proved to be global up to a share of the objective."""
        floor = self.best.certificate.rounding
        return self.proof.valid and self.gap <= tolerance * abs(self.best.objective) + floor

    def __repr__(self) -> str:
        kind = "proved" if self.proof.valid else "numerical"
        return (
            f"LowerBound({self.value:.9g}, {kind}, gap {self.gap:.2g} to {self.best.objective:.9g}, rank {self.rank}, "
            f"{len(self.minimisers)} minimisers)"
        )


def lower_bound(
    program: Program[DesignT],
    *,
    start: object = None,
    solver: Solver | None = None,
    time_limit: float = TIME_LIMIT,
) -> LowerBound[DesignT]:
    """A bound below every minimum of a program of polynomials, by Lasserre's relaxation of order two.

    Of programs with linear equalities whose terms are polynomials of degree four: R, R*, E and their sums. Squares are
    sought among the monomials 1, u_i and the products u_i u_j of free unknowns u that residuals multiply with each
    other; of long programs by the cliques of what the spans read, which are small in the plane.

    start: a solution known to be low, such as `explore(program, …).best`; ExactNewton's own when left out. solver: that
    polishes what is read from the moments. time_limit: wall-clock seconds for the semidefinite program.

    Needs Clarabel, the extra `symmotion[global]`. InputError for other programs, and for too large ones; SolveError
    where no minimum is known, or the semidefinite program is not solved. Source: Lasserre 2001; Waki et al. 2006.

    >>> bound = sm.lower_bound(sm.affine_program(sm.examples.planar_keyframes(), refine=0))
    >>> bound.value <= bound.best.objective
    True
    """
    require_program(program)
    checks.positive(time_limit, "time_limit")
    solver = ExactNewton() if solver is None else require_solver(solver)
    known = solver.solve(program, None if start is None else start_vector(program, start)).require()
    chart = Chart.of(program, known.x)
    places, forms = Moments.of(chart), gram_forms(program, chart)
    answer = relaxed(places, forms, time_limit)
    value = float(places.coefficients(forms) @ answer.moments)
    atoms = rank(places, answer)
    found = [known]
    for u in points(places, answer, atoms):
        solution = solver.solve(program, chart.point(u))
        if solution.status is Status.SOLVED and not any(same(solution, other) for other in found):
            found.append(solution)
    found.sort(key=lambda s: s.objective)
    best = found[0].objective
    tied = tuple(s for s in found if s.objective - best <= SAME * abs(best) + found[0].certificate.rounding)
    if found[0] is not known:
        # About the lowest point, where the Gram matrices' null vector is the monomial 1, nothing is lost to rounding.
        chart = chart.at(program, found[0].x)
        places, forms = Moments.of(chart), gram_forms(program, chart)
        answer = relaxed(places, forms, time_limit)
    proof = proved(program, places, forms, answer, tied)
    return LowerBound(program, proof.value, atoms, tied, value, proof, places.count, answer.status)
