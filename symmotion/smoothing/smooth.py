"""A recording to a motion, with all that has to be chosen on the way chosen and said."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from symmotion import checks
from symmotion.brief import in_a_line
from symmotion.design import affine_program, fit_program
from symmotion.design.amounts import ORDERS, Amount, amount, controls_of
from symmotion.design.fit_space import fit_basis
from symmotion.energies import Roughness
from symmotion.errors import InputError
from symmotion.files import read_recording
from symmotion.files.formats import FilePath
from symmotion.motions import Keyframes
from symmotion.program import Program
from symmotion.smoothing.interpolating import own_objective
from symmotion.solvers import ExactNewton, Solution
from symmotion.splines import BSplineBasis, Spline
from symmotion.splines.instants import distinct

Noise: TypeAlias = float | Sequence[float] | None
FEWEST = 8  # samples of which noise can be estimated
SHARE = 3.0  # controls per degree of freedom
TAKEN = 0.8  # degrees of freedom a sample beyond which what is left hardly tells the noise


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
    given = _noise(noise)
    if given is None and len(recording) < FEWEST:
        notes.append(f"{len(recording)} keyframes are too few to tell noise from motion: they are interpolated")
        given = (0.0, 0.0)
    if given == (0.0, 0.0):
        return _interpolating(recording, notes)
    return _fitting(recording, given, notes)


def _noise(noise: Noise) -> tuple[float, float] | None:
    if noise is None:
        return None
    if isinstance(noise, int | float) and not isinstance(noise, bool) and noise == 0:
        return 0.0, 0.0
    if isinstance(noise, str) or np.shape(noise) != (2,):
        raise InputError(f"noise {checks.told(noise)}: (σ of places, σ of turns in rad), 0 to interpolate, is needed")
    place, turn = (checks.not_negative(float(value), "noise") for value in np.asarray(noise))
    if (place == 0) != (turn == 0):
        raise InputError("noise of one part is 0 and of the other is not: give both, or 0 to interpolate")
    return place, turn


def _interpolating(keyframes: Keyframes, notes: list[str]) -> Plan:
    objective, said = own_objective(keyframes)
    notes.append(f"a motion through all {len(keyframes)} keyframes, of least {said}, a knot a segment")
    return Plan(affine_program(keyframes, objective=objective), tuple(notes))


def _fitting(samples: Keyframes, given: tuple[float, float] | None, notes: list[str]) -> Plan:
    m, d = len(samples), samples.dimension
    # A turn by a small angle about each axis with σ changes d² entries of A by d(d − 1)σ² in all.
    sigmas = (None, None) if given is None else (given[1] * np.sqrt((d - 1) / d), given[0])
    values = (samples.linear.reshape(m, -1), samples.translation)
    best = [_best(samples, part, sigma) for part, sigma in zip(values, sigmas, strict=True)]
    degree = max(2 * a.order - 1 for a in best)
    freedom = max(a.freedom for a in best)
    controls = int(min(m, max(degree + 2, np.ceil(SHARE * freedom))))
    basis = fit_basis(samples.times, np.arange(m), degree, controls, None)
    turn, place = best
    # The data term is the mean over the points ±e_k: ‖Δv‖² + ‖ΔA‖²/d.
    roughness = Roughness(turn.weight / d, place.weight, (turn.order, place.order))
    design = fit_program(samples, objective=roughness, degree=degree, controls=controls).design
    # The program is quadratic: its minimum is where it starts, and one step certifies it.
    start = [controls_of(basis, samples.times, part, a) for part, a in zip(values, best, strict=True)]
    left = place.noise, float(turn.noise * np.sqrt(d / (d - 1)))
    how = "by generalised cross-validation" if given is None else "by the noise given"
    unsure = [
        ", which leaves little to tell noise by: give it where it is known"
        if given is None and a.freedom > TAKEN * m
        else ""
        for a in best
    ]
    notes += [
        f"a spline of degree {degree} with {controls} controls follows {m} keyframes, smoothed {how}",
        f"place: λ = {place.weight:.3g} on ∫ ‖v^({place.order})‖², {place.freedom:.4g} degrees of freedom, "
        f"σ = {left[0]:.3g} left{unsure[1]}",
        f"turn: λ = {turn.weight:.3g} on ∫ ‖A^({turn.order})‖², {turn.freedom:.4g} degrees of freedom, "
        f"σ = {left[1]:.3g} rad left{unsure[0]}",
    ]
    design = replace(design, start=Spline(design.basis, np.concatenate(start, axis=1)), said=tuple(notes))
    return Plan(design.program(), tuple(notes), left)


def _best(samples: Keyframes, values: np.ndarray, sigma: float | None) -> Amount:
    """The amount of the order that serves best, of all splines: with a knot at every sample, as the least one has."""
    sites = distinct(samples.times, samples.times[[0, -1]])
    bases = {order: BSplineBasis.clamped(sites, 2 * order - 1) for order in ORDERS if len(sites) > 2 * order}
    found = (amount(basis, samples.times, values, order, sigma) for order, basis in bases.items())
    return min(found, key=lambda a: a.score)
