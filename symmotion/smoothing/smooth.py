"""A recording to a motion, with all that has to be chosen on the way chosen and said."""

from dataclasses import dataclass, replace

from symmotion.brief import in_a_line
from symmotion.design import affine_program, fit_program
from symmotion.design.amounts import FEWEST, Noise, Smoothing, noise_levels
from symmotion.files import read_recording
from symmotion.files.formats import FilePath
from symmotion.motions import Keyframes
from symmotion.program import Program
from symmotion.smoothing.interpolating import own_objective
from symmotion.solvers import ExactNewton, Solution


@dataclass(frozen=True, eq=False)
class Plan:
    """What `smooth` solves: the program, and in notes what was chosen and why.

    noise: what was found to be left, (σ of places, σ of turns in rad) about each axis; None where keyframes are met.

    >>> from symmotion.smoothing import plan
    >>> plan(sm.examples.recorded_tour(30)).program.unknowns > 0
    True
    """

    program: Program
    notes: tuple[str, ...]
    noise: tuple[float, float] | None = None

    __repr__ = in_a_line

    def __str__(self) -> str:
        return "\n".join(self.notes)

    def solve(self, solver: ExactNewton | None = None) -> Solution:
        """The solution; SolveError where there is none."""
        # A start that is given is taken for close to the minimum, where one evaluation of the Hessian serves.
        start = None if self.noise is None else self.program.x0
        return (solver or ExactNewton()).solve(self.program, start=start).require()


def smooth(recording: Keyframes | FilePath, *, noise: Noise = None) -> Solution:
    """The motion behind a recording, as the solution of a program that suits it; `plan` says what was chosen.

    With noise the spline of least Σ ‖x(t_i) − x_i‖² + λ ∫ ‖x^(k)‖² dt, x the linear part and the translation, each
    with a k ∈ {2, 3} and λ of its own: by the noise where it is given (Mallows 1973), else by generalised
    cross-validation; controls are three times the degrees of freedom that this leaves, at most one a sample. Without
    noise the motion through all keyframes: of rigid ones of least `rigid_objective`, else of least R + w E, w a tenth
    of the median step squared.

    recording: keyframes, or a path for `read_keyframes`. noise: (σ of places, in the unit of length, σ of turns, in
    rad), standard deviations about each axis, 0 to interpolate; estimated when left out.

    Raises InputError for noise that is negative or of one part only, and SolveError as `Solution.require` does.

    >>> solution = sm.smooth(sm.examples.recorded_tour(40), noise=(0.001, 0.002))
    >>> solution.certified
    True
    """
    return plan(recording, noise=noise).solve()


def plan(recording: Keyframes | FilePath, *, noise: Noise = None) -> Plan:
    """The program that `smooth` solves, with what was chosen in words; arguments as there.

    recording, noise: as for `smooth`.

    Raises InputError for noise that is negative or of one part only.

    >>> from symmotion.smoothing import plan
    >>> len(plan(sm.examples.recorded_tour(30)).notes) > 0
    True
    """
    notes: list[str] = []
    if not isinstance(recording, Keyframes):
        read = read_recording(recording)
        recording, notes = read.keyframes, list(read.notes)
    given = noise_levels(noise, "0 to interpolate")
    if given is None and len(recording) < FEWEST:
        notes.append(f"{len(recording)} keyframes are too few to tell noise from motion: they are interpolated")
        given = (0.0, 0.0)
    if given == (0.0, 0.0):
        return _interpolating(recording, notes)
    return _fitting(recording, given, notes)


def _interpolating(keyframes: Keyframes, notes: list[str]) -> Plan:
    objective, said = own_objective(keyframes)
    notes.append(f"a motion through all {len(keyframes)} keyframes, of least {said}, a knot a segment")
    return Plan(affine_program(keyframes, objective=objective), tuple(notes))


def _fitting(samples: Keyframes, given: tuple[float, float] | None, notes: list[str]) -> Plan:
    chosen = Smoothing.of(samples, given)
    degree = chosen.degree
    controls = chosen.controls(degree)
    # The data term is the mean over the points ±e_k: ‖Δv‖² + ‖ΔA‖²/d.
    roughness = chosen.roughness(1 / samples.dimension)
    design = fit_program(samples, objective=roughness, degree=degree, controls=controls).design
    notes += chosen.notes(degree, controls)
    # The program is quadratic: its minimum is where it starts, and one step certifies it.
    design = replace(design, start=chosen.start(design.basis, samples), said=tuple(notes))
    return Plan(design.program(), tuple(notes), chosen.noise)
