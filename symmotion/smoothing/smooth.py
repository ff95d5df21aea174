"""A recording to a motion, with all that has to be chosen on the way chosen and said."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import casadi as ca
import numpy as np

from symmotion import checks
from symmotion.brief import in_a_line
from symmotion.design import affine_program, fit_program
from symmotion.design.fit_space import fit_basis
from symmotion.energies import Energy, Rigidity, TrajectoryEnergy
from symmotion.errors import InputError
from symmotion.files import read_recording
from symmotion.files.formats import FilePath
from symmotion.jets import Jet
from symmotion.motions import Keyframes
from symmotion.program import Program
from symmotion.smoothing.choosing import ORDERS, Amount, amount, controls_of
from symmotion.solvers import ExactNewton, Solution
from symmotion.splines import Spline

Noise: TypeAlias = float | Sequence[float] | None
FEWEST = 8  # samples of which noise can be estimated
SHARE = 3.0  # controls per degree of freedom
MOST = 0.9  # controls per sample: with as many, least squares alone would be close to singular
RIGID = 1e-6
# Of the median step squared: with less R leaves free how fast a rigid body turns, with more it is not kept rigid.
BENDING = 0.1


@dataclass(frozen=True, eq=False)
class Roughness(Energy):
    """∫ w_A ‖A^(k)‖² + w_v ‖v^(l)‖² dt: how rough turn and place are, each by a derivative of its own.

    turn, place: w_A and w_v; orders: (k, l), 2 or 3.

    >>> from symmotion.smoothing import Roughness
    >>> motion = sm.interpolants.component_cubic(sm.examples.planar_keyframes())
    >>> sm.measure(motion, Roughness(1.0, 1.0)) > 0
    True
    """

    turn: float
    place: float
    orders: tuple[int, int] = (2, 2)

    def residuals(self, jet: Jet) -> ca.SX:
        turns, places = {2: jet.ddA, 3: jet.dddA}, {2: jet.ddv, 3: jet.dddv}
        weighted = (np.sqrt(self.turn) * ca.vec(turns[self.orders[0]]), np.sqrt(self.place) * places[self.orders[1]])
        return ca.vertcat(*weighted)

    def nodes(self, degree: int) -> int:
        return max(1, degree - min(self.orders) + 1)

    @property
    def exact(self) -> bool:
        return True


@dataclass(frozen=True, eq=False)
class Plan:
    """What `smooth` solves: the program, and in notes what was chosen and why.

    >>> from symmotion.smoothing import plan
    >>> plan(sm.examples.recorded_tour(30)).program.unknowns > 0
    True
    """

    program: Program
    notes: tuple[str, ...]

    __repr__ = in_a_line

    def __str__(self) -> str:
        return "\n".join(self.notes)

    def solve(self, solver: ExactNewton | None = None) -> Solution:
        """The solution; SolveError where there is none."""
        return (solver or ExactNewton()).solve(self.program).require()


def smooth(recording: Keyframes | FilePath, *, noise: Noise = None) -> Solution:
    """The motion behind a recording, as the solution of a program that suits it; `plan` says what was chosen.

    With noise the spline of least Σ ‖x(t_i) − x_i‖² + λ ∫ ‖x^(k)‖² dt, x the linear part and the translation, each
    with a k ∈ {2, 3} and λ of its own: by the noise where it is given (Mallows 1973), else by generalised
    cross-validation; controls are three times the degrees of freedom that this leaves. Without noise the
    motion through all keyframes of least R + w E, w a tenth of the median step squared.

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


def is_rigid(keyframes: Keyframes) -> bool:
    """Whether all linear parts are rotations, to 1e-6.

    keyframes: affine, in the plane or in space.

    >>> from symmotion.smoothing import is_rigid
    >>> is_rigid(sm.examples.quarter_turn()), is_rigid(sm.examples.planar_keyframes())
    (True, False)
    """
    a = keyframes.linear
    off = np.abs(np.swapaxes(a, 1, 2) @ a - np.eye(keyframes.dimension)).max()
    return bool(off <= RIGID and (np.linalg.det(a) > 0).all())


def _interpolating(keyframes: Keyframes, notes: list[str]) -> Plan:
    d = keyframes.dimension
    bends = TrajectoryEnergy(np.concatenate([np.eye(d), -np.eye(d)]))
    weight = BENDING * float(np.median(np.diff(keyframes.times))) ** 2
    notes.append(f"a motion through all {len(keyframes)} keyframes, of least R + {weight:.3g} E, a knot a segment")
    return Plan(affine_program(keyframes, objective=Rigidity() + weight * bends), tuple(notes))


def _fitting(samples: Keyframes, given: tuple[float, float] | None, notes: list[str]) -> Plan:
    m, d = len(samples), samples.dimension
    # A turn by a small angle about each axis with σ changes d² entries of A by d(d − 1)σ² in all.
    sigmas = (None, None) if given is None else (given[1] * np.sqrt((d - 1) / d), given[0])
    values = (samples.linear.reshape(m, -1), samples.translation)
    best = [_best(samples, part, sigma) for part, sigma in zip(values, sigmas, strict=True)]
    degree = max(2 * a.order - 1 for a in best)
    freedom = max(a.freedom for a in best)
    controls = int(min(max(degree + 1, MOST * m), max(degree + 2, np.ceil(SHARE * freedom))))
    basis = fit_basis(samples.times, np.arange(m), degree, controls, None)
    turn, place = (
        amount(basis, samples.times, part, a.order, sigma) for part, a, sigma in zip(values, best, sigmas, strict=True)
    )
    # The data term is the mean over the points ±e_k: ‖Δv‖² + ‖ΔA‖²/d.
    roughness = Roughness(turn.weight / d, place.weight, (turn.order, place.order))
    design = fit_program(samples, objective=roughness, degree=degree, controls=controls).design
    # The program is quadratic: its minimum is where it starts, and one step certifies it.
    chosen = (turn, place)
    start = [controls_of(basis, samples.times, part, a) for part, a in zip(values, chosen, strict=True)]
    how = "by generalised cross-validation" if given is None else "by the noise given"
    notes += [
        f"a spline of degree {degree} with {controls} controls follows {m} keyframes, smoothed {how}",
        f"place: λ = {place.weight:.3g} on ∫ ‖v^({place.order})‖², {place.freedom:.4g} degrees of freedom, "
        f"σ = {place.noise:.3g} left",
        f"turn: λ = {turn.weight:.3g} on ∫ ‖A^({turn.order})‖², {turn.freedom:.4g} degrees of freedom, "
        f"σ = {turn.noise * np.sqrt(d / (d - 1)):.3g} rad left",
    ]
    design = replace(design, start=Spline(design.basis, np.concatenate(start, axis=1)), said=tuple(notes))
    return Plan(design.program(), tuple(notes))


def _best(samples: Keyframes, values: np.ndarray, sigma: float | None) -> Amount:
    """The amount of the order that serves best, with as many controls as samples."""
    m = len(samples)
    found = []
    for order in ORDERS:
        degree = 2 * order - 1
        if m > degree + 1:
            basis = fit_basis(samples.times, np.arange(m), degree, m, None)
            found.append(amount(basis, samples.times, values, order, sigma))
    return min(found, key=lambda a: a.score)
