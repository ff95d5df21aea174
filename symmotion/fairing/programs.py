"""The two questions of fairing as programs of symbols: one local step, and a whole net at once."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from time import perf_counter

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from symmotion import checks
from symmotion.constraints import MotionConstraint, Setting
from symmotion.design.question import as_constraints, assembled, require_start
from symmotion.errors import InputError
from symmotion.fairing.blocks import (
    KEYFRAMES,
    KeyframePlaces,
    border_constraints,
    bounds_constraint,
    change_block,
    closeness_block,
    fairness_block,
    fixed_constraint,
    kept_constraint,
    keyframe_constraints,
    on_displacements,
)
from symmotion.fairing.borders import Borders, Freedom
from symmotion.fairing.coordinates import Coordinates, Fairable
from symmotion.fairing.held_steps import HeldSteps
from symmotion.fairing.jumps import Jumps, Step
from symmotion.fairing.keyframes import Asked, held
from symmotion.fairing.least_squares import LeastSquares
from symmotion.fairing.metrics import Metric
from symmotion.jets.nets import NetSpace
from symmotion.jets.space import UNKNOWN
from symmotion.kernels import Kernel
from symmotion.program import Block, Constraint, Multipliers, Program

JUMPS = ("uuu", "vvv")


@dataclass(frozen=True, eq=False)
class FairingDesign:
    """How the unknowns of a fairing program read as a motion: they are some controls of a net, the others stay.

    start: (n, m, C) the net; controls: (P,) the unknowns' places in it, counted row by row; shift: (C,) what is
    subtracted from each.
    keyframes: which rows of which constraints each of them is, and the equations of its displacement.
    """

    coordinates: Coordinates
    start: np.ndarray
    controls: np.ndarray
    keyframes: KeyframePlaces = ()
    shift: np.ndarray | float = 0.0

    def net(self, unknowns: Mapping[str, np.ndarray]) -> np.ndarray:
        """(n, m, C) the net with the unknowns in it."""
        net = self.start.copy()
        net.reshape(-1, net.shape[-1])[self.controls] = unknowns[UNKNOWN] + self.shift
        return net

    def motion(self, unknowns: Mapping[str, np.ndarray]) -> Fairable:
        """The motion of the program's unknowns."""
        return self.coordinates.motion_of(self.net(unknowns))

    def unknowns(self, motion: Fairable) -> dict[str, np.ndarray]:
        """The unknowns that a motion over the same knots has."""
        require_start(motion, type(self.coordinates.motion), 3)
        net = replace(self.coordinates, motion=motion).net
        if net.shape != self.start.shape:
            raise InputError(f"a start with a net of shape {net.shape}: {self.start.shape} is needed")
        return {UNKNOWN: net.reshape(-1, net.shape[-1])[self.controls] - self.shift}

    def multipliers(self, multipliers: Mapping[str, np.ndarray]) -> Multipliers:
        """Multipliers by constraint, one row per jump or control; "keyframes": (M, d), on their displacements."""
        found = {name: values for name, values in multipliers.items() if not name.startswith(KEYFRAMES)}
        if self.keyframes:
            given = [None if p is None else multipliers[p.name][p.row] for p in self.keyframes]
            found[KEYFRAMES] = on_displacements([p and p.covector for p in self.keyframes], given)
        return found


def local_step_program(
    motion: Fairable, knot: tuple[int, ...], *, step: Step = "nine", parts: str | None = None, length: float = 1.0
) -> "Program[FairingDesign]":
    """The local fairing step at one knot as a program: PCG (18), (19) with explicit λ and μ.

    Minimise ½ Σ |d_ij − d⁰_ij|² subject to Δ_uuu = 0 ("uuu", multiplier λ) and Δ_vvv = 0 ("vvv",
    μ), of a curve Δ_uuu = 0 alone. PCG's objective has no ½ and their multipliers are twice these.

    knot: (k, l) counted from 0 at the first interior knot, of a curve (k,); step: "nine", moving
    the inner controls, or "orthogonal", all 21 inside the ring. parts, length: as for `fair`.

    motion: as for `fair`. Raises InputError for a knot that does not exist.

    >>> net = sm.motions.noisy_net(sm.motions.smooth_net(7), 0.01, seed=1)
    >>> step = sm.ExactNewton().solve(sm.fairing.local_step_program(net, (1, 1))).require()
    >>> sorted(step.multipliers)
    ['uuu', 'vvv']
    """
    began = perf_counter()
    coordinates = Coordinates.of(motion, parts, length)
    jumps = Jumps.of(coordinates.bases)
    place = int(knot[0]), int(knot[1]) if len(knot) > 1 else 0
    if len(knot) != len(coordinates.bases) or not all(
        0 <= k < count for k, count in zip(place, jumps.shape, strict=True)
    ):
        raise InputError(f"knot {knot!r}: indices below {jumps.shape[: len(coordinates.bases)]} are needed")
    program = LocalSteps(coordinates, jumps, step).program(place, coordinates.net)
    return replace(program, build_seconds=perf_counter() - began)


@dataclass(frozen=True, eq=False)
class LocalSteps:
    """Programs of local steps, whose structure each knot keeps.

    made: by knot the program made first, the controls that move in it, and the coefficients
    (kinds, n m) of those that stay.
    """

    coordinates: Coordinates
    jumps: Jumps
    step: Step
    metric: Metric = field(default_factory=Metric)
    held: HeldSteps | None = None
    made: dict[tuple[int, int], tuple[Program[FairingDesign], np.ndarray, np.ndarray]] = field(
        default_factory=dict, repr=False
    )

    def program(self, knot: tuple[int, int], net: np.ndarray) -> "Program[FairingDesign]":
        """The step at a knot (k, l) of a net (n, m, C), the same program with other data where it was made before."""
        if knot not in self.made:
            self.made[knot] = self._new(knot, net)
        program, controls, fixed = self.made[knot]
        flat = net.reshape(-1, net.shape[-1])
        points = flat[controls]
        for constraint, row in zip(program.constraints[: len(fixed)], fixed, strict=True):
            program = program.with_data(constraint.name, (row @ flat)[None])
        for constraint in program.constraints[len(fixed) :]:
            program = program.with_data(constraint.name, constraint.block.operator @ points.reshape(-1, 1))
        data = np.column_stack([points, program.terms[0].data[:, points.shape[1] :]])
        terms = (program.terms[0].with_data(data),)
        return replace(
            program, start={UNKNOWN: points}, terms=terms, design=FairingDesign(self.coordinates, net, controls)
        )

    def _new(self, knot: tuple[int, int], net: np.ndarray) -> tuple[Program[FairingDesign], np.ndarray, np.ndarray]:
        """The program, the controls that move, and the coefficients (kinds, n m) of those that stay."""
        k, l = knot  # noqa: E741 - PCG's letters
        u, v = self.jumps.u, self.jumps.v
        whole = [np.outer(u.jumps[k], v.values[l]).ravel(), np.outer(u.values[k], v.jumps[l]).ravel()]
        moved = [
            np.outer(u.moved(self.step)[k], v.values[l]).ravel(),
            np.outer(u.values[k], v.moved(self.step)[l]).ravel(),
        ]
        kinds, channels = self.jumps.kinds, net.shape[-1]
        controls = np.flatnonzero(np.abs(moved[:kinds]).sum(axis=0))
        points = net.reshape(-1, channels)[controls]
        # Each of the two is a kernel of one row of symbols; which controls that row combines is the operator's.
        z, other = ca.SX.sym("z", channels), ca.SX.sym("other", channels)
        rows = slice(0, channels)
        terms = (change_block(net, controls, self.metric),)
        jump = Kernel(z, other, z + other, channels)
        constraints = [
            Constraint.equality(
                Block(
                    JUMPS[q],
                    jump,
                    UNKNOWN,
                    rows,
                    sparse.csr_array(whole[q][None, controls]),
                    1,
                    np.ones(1),
                    np.zeros((1, channels)),
                )
            )
            for q in range(kinds)
        ]
        if self.held is not None and len(kept := self.held.kept(controls)):
            constraints.append(kept_constraint(kept))
        design = FairingDesign(self.coordinates, net, controls)
        fixed = np.array(whole[:kinds])
        fixed[:, controls] = 0.0
        return Program({UNKNOWN: points}, terms, tuple(constraints), design), controls, fixed


def fairing_program(
    motion: Fairable,
    *,
    constraints: Sequence[MotionConstraint] = (),
    weight: float = 0.0,
    tolerance: float | np.ndarray | None = None,
    region: object = None,
    parts: str | None = None,
    length: float = 1.0,
    keyframes: Sequence[Asked] = (),
    borders: Borders = "ring",
    weights: ArrayLike | None = None,
    metric: ArrayLike | None = None,
) -> "Program[FairingDesign]":
    """The fairing of a whole net as a program: min ΣL + w Σ|d − d⁰|², or subject to |d − d⁰| ≤ δ.

    constraints: conditions on the net's jet (`NetJet`), at (u, v), or at parameters of a curve.

    The controls that stay, the ring or all outside `region`, are the constraint "fixed", and
    their multipliers say what moving them would do to the objective; borders that are held or
    continued are "border u0" and so on, keyframes "keyframes"; the bounds are the constraint
    "bounds", |d − d⁰|²/δ² ≤ 1.

    weight: w ≥ 0; tolerance: δ > 0, one or (n, m) for all controls, None for no bounds; the
    others: as for `fair`.

    motion, parts, length, weights, metric: as for `fair`. Raises InputError as it does.

    weight: w ≥ 0; tolerance: δ.

    >>> program = sm.fairing.fairing_program(sm.motions.noisy_net(sm.motions.smooth_net(7), 0.01, seed=1), weight=1.0)
    >>> sm.ExactNewton().solve(program).require().inertia
    'positive'
    """
    began, asked = perf_counter(), as_constraints(constraints)
    coordinates = Coordinates.of(motion, parts, length)
    jumps = Jumps.of(coordinates.bases)
    freedom = Freedom.of(coordinates, jumps, region, borders)
    net = coordinates.net
    form = Metric.of(net.shape, weights, metric)
    given_keys = held(coordinates, keyframes)
    problem = LeastSquares(jumps, net, freedom, given_keys, form)
    checks.not_negative(weight, "weight")
    n, m, channels = net.shape
    shift = coordinates.shift(net)
    near, start = net - shift, (problem.start - shift).reshape(-1, channels)
    free = np.flatnonzero(freedom.free)
    terms = [fairness_block(jumps, channels)]
    if weight:
        # Of the controls that stay too, where it adds nothing but keeps the Hessian regular.
        terms.append(closeness_block(near, np.arange(n * m), weight, form))
    fixed = np.flatnonzero(~freedom.free)
    given = [fixed_constraint(start, fixed)] if len(fixed) else []
    given += border_constraints(freedom, start)
    blocks, places = keyframe_constraints(given_keys, problem.active, shift)
    given += blocks
    if tolerance is not None:
        limit = tolerances(tolerance, (n, m)).ravel()[free]
        if not (limit > 0).all():
            raise InputError("tolerance 0: bounds must leave room; exclude controls by the region instead")
        given.append(bounds_constraint(near, free, limit, form))
    design = FairingDesign(coordinates, net, np.arange(n * m), places, shift)
    setting = Setting((NetSpace(coordinates.bases, channels, shift=shift),), np.empty(0))
    lengths, shifts = {UNKNOWN: coordinates.lengths}, {UNKNOWN: shift}
    program = assembled({UNKNOWN: start.copy()}, terms, given, asked, setting, design, lengths, shifts)
    return replace(program, build_seconds=perf_counter() - began)


def tolerances(tolerance: float | np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """(n, m) a tolerance for every control; InputError for negative ones and other shapes."""
    limit = checks.numbers(tolerance, "tolerance")
    if limit.ndim == 1 and shape[1] == 1:
        limit = limit[:, None]
    if limit.shape not in ((), shape):
        raise InputError(f"tolerances of shape {limit.shape}: one number or {shape}, one for each control, is needed")
    if not (limit >= 0).all():
        raise InputError("tolerance: numbers, 0 or more, are needed")
    return np.broadcast_to(limit, shape)
