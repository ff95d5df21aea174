"""Motion fitting: few controls that follow many samples (HJK 2.3, application 4), as programs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from time import perf_counter

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.brief import in_a_line
from symmotion.constraints import EndRates, ExactSamples, MotionConstraint, Periodic, Setting
from symmotion.design.amounts import FEWEST, ORDERS, Smoothing, noise_levels
from symmotion.design.fit_space import (
    body_points,
    fit_basis,
    least_squares,
    require_determined,
    require_free,
    root_of,
    sample_weights,
)
from symmotion.design.independence import require_independent
from symmotion.design.quadratures import nodes_at, term_quadratures
from symmotion.design.question import (
    as_constraints,
    built,
    other_keyframes,
    rates_at_ends,
    require_start,
    require_times,
    require_volume,
    targets_of,
)
from symmotion.design.spans import spline_degree
from symmotion.design.terms import as_objective, terms_of
from symmotion.energies import Energy
from symmotion.errors import InputError
from symmotion.jets import Jet
from symmotion.jets.linear import LinearSpace, affine_space
from symmotion.jets.space import UNKNOWN, block_of
from symmotion.motions import Affine, AffineMotion, Keyframes, as_keyframes
from symmotion.motions.crowding import opposite_note, require_apart
from symmotion.program import Block, Multipliers, Program, Quadrature, Target, Targets
from symmotion.program.state import made_of
from symmotion.renamed import renamed
from symmotion.splines import BSplineBasis, Spline, amid

SAMPLES = "samples"
EXACT = "exact samples"


@renamed(samples="keys")
def fit_program(
    keys: Keyframes,
    *,
    objective: Energy | None = None,
    constraints: Sequence[MotionConstraint] = (),
    degree: int = 3,
    knots: ArrayLike | None = None,
    ends: str = "natural",
    end_rates: Affine | None = None,
    controls: int | None = None,
    noise: Sequence[float] | None = None,
    weights: ArrayLike | None = None,
    points: ArrayLike | None = None,
    huber: float | None = None,
    exact: Sequence[int] = (),
) -> "Program[FitDesign]":
    """The affine spline motion that follows many samples with few controls, as a program.

    Minimise Σ w_i s_i + objective, s_i = mean over the body points p of
    ‖(v(t_i) + A(t_i) p) − (v*_i + A*_i p)‖², over all control matrices and points; with `huber` = δ
    the data term is Σ w_i 2δ² (√(1 + s_i/δ²) − 1): s_i for distances far below δ, 2δ√s_i far
    above it (the smooth form of Huber's loss; HJK 2.3, application 4). It is the sum of the
    squares of the residuals times √(2/(1 + √(1 + s_i/δ²))), so that both the exact Hessian and a
    Gauss–Newton matrix are at hand. The start is the spline of least squares.

    keys: the samples, `Keyframes`. They may crowd, but for exact ones: no motion passes through them. `program.notes`
    names those of opposite orientations.
    controls: how many, their knots at equal numbers of samples, from three in four of these on at samples; or `knots`,
    the inner knots; chosen where neither is given.
    objective: an energy or a weighted sum of energies that smooths; when left out with controls or knots, nothing.
    noise: (σ of places, σ of turns in rad), standard deviations about each axis of a sample of weight 1. By it, else
    by generalised cross-validation, how many controls there are is chosen where that is not given, and a `Roughness`
    of turn and place where no objective is and either the noise is or the controls are not. `program.notes` tells
    what was chosen, which is told by the samples without constraints and ends. `sm.smooth` chooses the degree too.
    constraints: conditions on the jet (`Jet`), as in `affine_program`. ends: what holds at the ends: "natural"
    (nothing), "clamped" with `end_rates` (linear (2, d, d), translation (2, d)), or "periodic", the closed motion.
    weights: (M,) not negative, ones when left out; zero leaves a sample out.
    points: (P, d) body points, the unit vectors and their opposites when left out.
    huber: δ, in the unit of length. exact: numbers of samples that are met exactly, by linear
        conditions with multipliers under "exact samples"; short for the constraint `ExactSamples`.

    Raises InputError where the samples do not determine the controls (Schoenberg and Whitney
    1953) or the exact ones crowd, naming the samples, for weights, δ and numbers out of range, and where there is
    nothing that noise could choose or too few samples to tell it.

    degree: of the splines, at least 1.

    >>> samples = sm.examples.recorded_tour(60)
    >>> fit = sm.ExactNewton().solve(sm.fit_program(samples, controls=20, objective=1e-3 * sm.Rigidity())).require()
    >>> fit.motion.basis.n
    20
    """
    began = perf_counter()
    samples, asked = as_keyframes(keys), as_constraints(constraints)
    energy = None if objective is None else as_objective(objective, objective)
    degree = spline_degree(degree)
    huber = None if huber is None else checks.positive(huber, "huber")
    rates = rates_at_ends(ends, end_rates, samples.dimension)
    chosen = checks.indices(exact, len(samples), "exact sample")
    met = [ExactSamples(chosen)] if chosen else []
    every = [c.which(len(samples)) for c in (*met, *asked) if isinstance(c, ExactSamples)]
    kept = np.unique(np.concatenate([np.empty(0, dtype=int), *every]))
    weights = sample_weights(weights, len(samples))
    if energy is None and len(kept) == len(samples):
        raise InputError("all samples are exact and there is no objective: nothing is left to minimise")
    used = np.union1d(np.flatnonzero(weights), kept)
    points, free = body_points(points, samples.dimension), controls is None and knots is None
    smoothing = None
    if free or noise is not None:
        if huber is not None:
            raise InputError("how much to smooth is chosen for squares: with huber give controls and an objective")
        if not free and energy is not None:
            raise InputError("controls and objective are given: noise has nothing to choose, leave it out")
        basis = None if free else fit_basis(samples.times, used, degree, controls, knots)
        smoothing = _smoothing(samples, weights, noise, degree, basis)
        controls = smoothing.controls(degree) if free else controls
    basis = fit_basis(samples.times, used, degree, controls, knots)
    require_determined(basis, samples.times, used)
    require_free(basis, samples.times, kept)
    if len(kept) > 1:
        require_apart(samples.times[kept], "exact samples", kept)
    if energy is not None:
        require_volume(energy, samples, used)
    start, said = least_squares(basis, samples, used, weights), ()
    if smoothing is not None and energy is None:
        followed = np.flatnonzero(weights)
        energy = smoothing.roughness(float(np.var(points, axis=0).mean()))
        start = smoothing.start(basis, samples[followed], weights[followed])
        said = tuple(smoothing.notes(degree, basis.n))
    elif smoothing is not None:
        said = (f"{smoothing.counted(degree, basis.n)}, as many as serve {smoothing.how}",)
    at_ends = {"clamped": [EndRates(rates)], "periodic": [Periodic()]}.get(ends, [])
    conditions = (*met, *at_ends, *asked)
    fit = FitDesign(samples, energy, start, weights, points, huber, kept, conditions, said=said)
    return replace(fit.program(), build_seconds=perf_counter() - began)


@dataclass(frozen=True, eq=False)
class FitDesign:
    """The question of a fit: samples, their weights and loss, what smooths, the spline space with its start.

    start: controls (n, d² + d); weights: (M,); points: (P, d); exact: numbers of the samples that are met.

    objective, huber, constraints: as in the program; nodes: by term, more Gauss nodes than it asks for; said: what
    the program tells of the samples. Other samples than as many, at the same times, raise InputError.

    >>> program = sm.fit_program(sm.examples.recorded_tour(30), controls=10)
    >>> len(program.design.samples)
    30
    """

    samples: Keyframes
    objective: Energy | None
    start: Spline
    weights: np.ndarray
    points: np.ndarray
    huber: float | None
    exact: np.ndarray
    constraints: tuple[MotionConstraint, ...] = ()
    # By term, Gauss nodes per span where they are not those that the start needs.
    nodes: Mapping[str, int] = field(default_factory=dict)
    # What whoever asked has to say of it.
    said: tuple[str, ...] = ()

    __repr__ = in_a_line

    __getstate__ = made_of

    @property
    def basis(self) -> BSplineBasis:
        """The B-spline basis of the unknown motion, over the times of the samples."""
        return self.start.basis

    @cached_property
    def followed(self) -> np.ndarray:
        """(N,) numbers of the samples in the data term: those with a weight that are not exact."""
        return np.setdiff1d(np.flatnonzero(self.weights), self.exact)

    @cached_property
    def space(self) -> LinearSpace:
        """The linear map from controls (n, d² + d) to the jet of the motion at a time."""
        d = self.samples.dimension
        return affine_space(self.basis, d, d * d + d, self.shift)

    @cached_property
    def shift(self) -> np.ndarray:
        """(d² + d,) what the program subtracts from every control: a point amid samples that are far from zero."""
        return np.concatenate([np.zeros(self.samples.dimension**2), amid(self.samples.translation)])

    @property
    def notes(self) -> tuple[str, ...]:
        """What is said before solving: of the samples, and that orientations (signs of det A) are opposite."""
        # Samples may crowd: they are not met.
        note = opposite_note(self.samples.linear[np.union1d(self.followed, self.exact)])
        return self.said if note is None else (*self.said, note)

    @property
    def setting(self) -> Setting:
        """What constraints may know of this program: its samples, which are followed and not met."""
        samples = self.samples
        return Setting((self.space,), samples.times, samples.linear, samples.translation, held=False)

    def program(self) -> "Program[FitDesign]":
        """The program of this question."""
        start = {UNKNOWN: self.start.control_points - self.shift}
        terms = [self._data_term()] if len(self.followed) else []
        if self.objective:
            terms += terms_of(self.objective, self.space, start[UNKNOWN], self.nodes)
        lengths, given = {UNKNOWN: slice(self.samples.dimension**2, None)}, built(self.constraints, self.setting, [])
        program = Program(start, tuple(terms), tuple(given), self, lengths=lengths, shifts={UNKNOWN: self.shift})
        if any(not isinstance(c, ExactSamples) for c in self.constraints):
            require_independent(program)
        return program

    def _data_term(self) -> Block:
        d, jet = self.samples.dimension, self.space.symbols()
        assert isinstance(jet, Jet)
        targets, delta = ca.SX.sym("target", d * d + d), ca.SX.sym("delta")
        change = ca.vertcat(ca.vec(jet.A.T), jet.v) - targets
        linear, translation = ca.reshape(change[: d * d], d, d).T, change[d * d :]
        out = ca.vec(ca.horzcat(linear, translation) @ ca.DM(root_of(self.points)))
        if self.huber is not None:
            out = out * ca.sqrt(2 / (1 + ca.sqrt(1 + ca.sumsqr(out) / delta**2)))
        return block_of(
            SAMPLES,
            out,
            [self.space],
            self.samples.times[self.followed, None],
            data=ca.vertcat(targets, delta),
            numbers=self._data,
            squares=True,
            weights=self.weights[self.followed],
            width=d * d + d,
        )

    @property
    def _data(self) -> np.ndarray:
        targets = self.samples.coordinates[self.followed] - self.shift
        return np.column_stack([targets, np.full(len(targets), self.huber or 0.0)])

    def targets(self, program: Program) -> dict[str, Targets]:
        """Where the samples are in the program: in the data term, and in constraints that have them."""
        d, every = self.samples.dimension, slice(None)
        places = [Target(SAMPLES, program.terms[0].data.shape[1] - 1 - d * d - d, self.followed, every)]
        places = places[: len(self.followed)] + targets_of(program, self.constraints, self.setting)
        return {SAMPLES: Targets(len(self.samples), d, tuple(places))}

    def distances(self, motion: AffineMotion) -> np.ndarray:
        """(M,) √s_i: how far the body points are from their samples, root mean square over the points."""
        linear, translation = motion(self.samples.times)
        change = np.concatenate(
            [linear - self.samples.linear, (translation - self.samples.translation)[..., None]], axis=2
        )
        return np.linalg.norm(change @ root_of(self.points), axis=(1, 2))

    def influence(self, motion: AffineMotion) -> np.ndarray:
        """(M,) by how much each sample's pull is weaker than its weight: 1/√(1 + s_i/δ²), ones without Huber's loss."""
        ratio = self.distances(motion) / (self.huber or np.inf)
        return 1 / np.sqrt(1 + ratio**2)

    def motion(self, unknowns: Mapping[str, np.ndarray]) -> AffineMotion:
        """The motion of the program's unknowns."""
        return AffineMotion.from_spline(Spline(self.basis, unknowns[UNKNOWN] + self.shift), self.samples.dimension)

    def unknowns(self, motion: AffineMotion) -> dict[str, np.ndarray]:
        """The unknowns closest to a motion at the samples, exactly where the space holds it."""
        require_start(motion, AffineMotion, self.samples.dimension)
        times = self.samples.times
        seen = Keyframes(times, *motion(times))
        used = np.union1d(self.followed, self.exact)
        return {UNKNOWN: least_squares(self.basis, seen, used, np.ones(len(times))).control_points - self.shift}

    def multipliers(self, multipliers: Mapping[str, np.ndarray]) -> Multipliers:
        """Multipliers by constraint; the exact samples' as `.linear` (K, d, d) and `.translation` (K, d).

        ∂f*/∂A*_i = −linear[k] and ∂f*/∂v*_i = −translation[k] for the k-th exact sample i.
        """
        d = self.samples.dimension
        shaped = np.asarray(multipliers.get(EXACT, np.empty((0, d * d + d))))
        return {**multipliers, EXACT: Affine(shaped[:, : d * d].reshape(-1, d, d), shaped[:, d * d :])}

    def quadratures(self, program: Program, x: np.ndarray) -> dict[str, Quadrature]:
        """By term, how well its nodes integrate at x (unknowns,)."""
        return term_quadratures(program, x, self.objective, self.motion(program.unpack(x)), self.samples.times)

    def refined(self, program: "Program[FitDesign]", x: np.ndarray) -> "Program[FitDesign] | None":
        """The program with the nodes that ten digits need at x (unknowns,); None where it has them, or can have."""
        nodes = nodes_at(program, x, self.objective, self.motion(program.unpack(x)))
        if not nodes:
            return None
        return replace(self, nodes={**self.nodes, **nodes}).program().with_parameters(**program.parameters)

    def with_keyframes(self, program: "Program[FitDesign]", keyframes: Keyframes) -> "Program[FitDesign]":
        """The program for other samples at the same times; structure and kernels are kept."""
        keyframes = other_keyframes(keyframes, self.samples)
        require_times(keyframes.times, self.samples.times)
        began = perf_counter()
        used = np.union1d(self.followed, self.exact)
        start = least_squares(self.basis, keyframes, used, self.weights)
        design = replace(self, samples=keyframes, start=start)
        times, terms = keyframes.times, program.terms
        if len(self.followed):
            data = np.column_stack([times[self.followed], design._data])
            terms = (terms[0].with_data(data), *terms[1:])
        changes = {"start": {UNKNOWN: start.control_points}, "terms": terms, "design": design}
        if self.shift.any() or design.shift.any() or any(not isinstance(c, ExactSamples) for c in self.constraints):
            return replace(design.program(), build_seconds=perf_counter() - began)
        for c in program.constraints:
            # These hold the samples alone, and are met by others as well.
            which = np.searchsorted(times, c.block.data[:, 0])
            program = program.with_data(c.name, np.column_stack([times[which], keyframes.coordinates[which]]))
        return replace(program, **changes, build_seconds=perf_counter() - began)


def _smoothing(
    samples: Keyframes, weights: np.ndarray, noise: Sequence[float] | None, degree: int, basis: BSplineBasis | None
) -> Smoothing:
    """How much to smooth samples by their noise, over a basis where it is given."""
    levels, followed = noise_levels(noise, "or affine_program to interpolate"), np.flatnonzero(weights)
    if levels == (0.0, 0.0):
        raise InputError("noise 0 asks for a motion through all samples, which affine_program makes")
    if levels is None and len(followed) < FEWEST:
        raise InputError(f"{len(followed)} samples are too few to tell noise from motion: give noise, or controls")
    if degree < min(ORDERS):
        raise InputError(f"degree {degree}: bends tell how much to smooth, degree 2 or more, or controls, is needed")
    return Smoothing.of(samples[followed], levels, basis, [k for k in ORDERS if k <= degree], weights[followed])
