"""Orientation motions of least torque through keyframes, as programs on control quaternions."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import casadi as ca
import numpy as np

from symmotion.design.affine import refined_times
from symmotion.design.control_nodes import UNKNOWN, ControlSpace, Node
from symmotion.design.control_start import carried, motion_of
from symmotion.errors import InputError
from symmotion.jets import rotation
from symmotion.motions.quaternions.algebra import Signs, conjugate
from symmotion.motions.quaternions.curve import QuaternionMotion
from symmotion.motions.quaternions.interpolation import ENDS, interpolate_keys
from symmotion.motions.quaternions.keys import OrientationKeys
from symmotion.program import Block, Constraint, Program
from symmotion.splines import BSplineBasis, gauss


@dataclass(frozen=True)
class Limits:
    """Upper bounds on the norms of angular rate [rad/s], acceleration [rad/s²] and torque; None: no bound.

    per_span: parameters, equally spaced, at which each span of the curve is held to them.
    """

    rate: float | None = None
    acceleration: float | None = None
    torque: float | None = None
    per_span: int = 5

    def __post_init__(self):
        for name in ("rate", "acceleration", "torque"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0):
                raise InputError(f"bound {value!r} on the {name}: a positive finite number is needed")
        if int(self.per_span) != self.per_span or self.per_span < 1:
            raise InputError(f"per_span {self.per_span!r}: a whole number of parameters, 1 or more, is needed")


NO_LIMITS = Limits()


def orientation_program(
    keys,
    quaternions=None,
    *,
    inertia=None,
    knots_per_interval: int = 2,
    degree: int = 3,
    ends: str = "natural",
    end_rates=None,
    end_accelerations=None,
    turns=None,
    signs: Signs = "align",
    limits: Limits = NO_LIMITS,
    tolerances=None,
    nodes: int = 6,
) -> Program:
    """The orientation motion of least torque through keyframes: KKS 6.1 leave it open.

    Minimise ∫ ‖τ‖² dt, τ = J Ω̇ + Ω × JΩ, over the control quaternions of a B-spline quaternion
    curve, subject to |q_j|² = 1 and 2 log(q_i⁻¹ q(t_i)) = 0. The multipliers of "keyframes"
    (M, 3) tell what turning one costs: the optimum changes by −λ_i · ε with q_i → q_i exp(ε/2).

    keys: rigid `Keyframes` in space, whose rotations are taken; or times (M,) increasing, beside
        quaternions: (M, 4) scalar first, or a SciPy `Rotation`.
    inertia: J, (3, 3) symmetric positive definite or (3,) principal moments; the identity when
        left out, which makes it the energy ∫ ‖Ω̇‖² dt of the angular acceleration.
    knots_per_interval: k ≥ 1, so that each keyframe interval has k spans.
    ends: "natural" (free: no torque there at the optimum), "clamped" with `end_rates` (2, 3), body
        rates in rad/s, and `end_accelerations` (2, 3) in rad/s² if wanted; or "periodic".
    turns, signs: extra turns and the reading of signs, as in `interpolate_quaternions`.
    limits: bounds along the motion; tolerances: one number or (M,), the angle in rad by which a
        keyframe may be missed, 0 for not at all. Both are inequalities, for Ipopt().
    nodes: Gauss nodes per span; the integrand is no polynomial, except about a single axis.

    Raises InputError for what cannot be; starts from the interpolating curve, so SolveError where there is none.
    """
    began = perf_counter()
    given = OrientationKeys.of(keys, quaternions, turns, signs)
    design = OrientationDesign.of(
        given, inertia, knots_per_interval, degree, ends, end_rates, end_accelerations, limits, tolerances, nodes
    )
    return replace(design.program(), build_seconds=perf_counter() - began)


@dataclass(frozen=True, eq=False)
class OrientationDesign:
    """The question of an orientation program: keyframes, body, ends, bounds, and the curve to start from."""

    keys: OrientationKeys
    inertia: np.ndarray
    knots_per_interval: int
    degree: int
    ends: str
    end_rates: np.ndarray | None
    end_accelerations: np.ndarray | None
    limits: Limits
    tolerances: np.ndarray
    nodes: int
    start: QuaternionMotion
    space: ControlSpace

    @staticmethod
    def of(
        keys: OrientationKeys,
        inertia: Any,
        knots_per_interval: int,
        degree: int,
        ends: str,
        end_rates: Any,
        end_accelerations: Any,
        limits: Limits,
        tolerances: Any,
        nodes: int,
        channels: int = 4,
    ) -> "OrientationDesign":
        """The checked question, with its start: the interpolating curve carried into the space."""
        require_whole(knots_per_interval, 1, "knots per interval")
        require_whole(degree, 2, "degree")
        require_whole(nodes, 1, "Gauss nodes")
        if ends not in ENDS:
            raise InputError(f"end condition {ends!r} is unknown; there are {', '.join(ENDS)}")
        if end_accelerations is not None:
            if ends != "clamped":
                raise InputError("end_accelerations go with clamped ends")
            end_accelerations = np.array(end_accelerations, dtype=float)
            if end_accelerations.shape != (2, 3) or not np.isfinite(end_accelerations).all():
                raise InputError(f"end_accelerations of shape {end_accelerations.shape}: finite, (2, 3), are needed")
        if ends == "periodic" and len(keys) < 4:
            raise InputError(f"{len(keys)} keyframes are too few for periodic ends: at least 4 are needed")
        tolerance = np.zeros(len(keys)) if tolerances is None else np.broadcast_to(tolerances, len(keys)).astype(float)
        if not (np.isfinite(tolerance) & (tolerance >= 0)).all():
            i = int(np.argmin(np.isfinite(tolerance) & (tolerance >= 0)))
            raise InputError(f"the tolerance of keyframe {i} is {tolerance[i]:g}: 0 rad or more is needed")
        moments = as_inertia(inertia)
        interpolant = interpolate_keys(keys, ends, end_rates)
        rates = None if end_rates is None else np.array(end_rates, dtype=float)
        breakpoints = refined_times(keys.times, knots_per_interval - 1)
        make = BSplineBasis.closed if ends == "periodic" else BSplineBasis.clamped
        basis = make(breakpoints, degree)
        start, space = carried(interpolant, basis, channels)
        require_room(basis, keys, ends, rates, end_accelerations)
        return OrientationDesign(
            keys,
            moments,
            knots_per_interval,
            degree,
            ends,
            rates,
            end_accelerations,
            limits,
            tolerance,
            nodes,
            start,
            space,
        )

    def program(self) -> Program:
        """The program of this question."""
        controls = {UNKNOWN: self.start.control_points.copy()}
        return Program(controls, (self.torque_term(),), self.constraints(), self)

    def torque_term(self, weight: float = 1.0) -> Block:
        """∫ ‖τ‖² dt as a block of the program."""
        points, weights = self.space.gauss(self.nodes)
        moments = ca.DM(self.inertia)
        plain = np.array_equal(self.inertia, np.eye(3))

        def residuals(node: Node) -> ca.SX:
            return node.extra[0] * (node.jet.acceleration if plain else node.jet.torque(moments))

        roots = np.sqrt(weight * weights)[..., None]
        return self.space.block("acceleration" if plain else "torque", points, residuals, roots, squares=True)

    @property
    def held(self) -> slice:
        """Which keyframes are conditions of their own: all, but the last of a closed motion, which is the first."""
        return slice(0, len(self.keys) - 1) if self.ends == "periodic" else slice(None)

    def constraints(self) -> tuple[Constraint, ...]:
        """Unit norms, keyframes, end conditions and bounds."""
        times, tolerance = self.keys.times[self.held], self.tolerances[self.held]
        inverse = conjugate(self.keys.quaternions[self.held])
        exact = tolerance == 0
        found = [self.space.norms()]

        def missed(node: Node) -> ca.SX:
            return 2 * rotation.log(rotation.product(node.extra[:4], node.quaternion))

        if exact.any():
            found.append(self.space.at("keyframes", times[exact], missed, inverse[exact]))
        if not exact.all():
            # Relative to the tolerance: the condition is of the order of one.
            extra = np.column_stack([inverse[~exact], 1 / tolerance[~exact]])
            block = self.space.block_at(
                "keyframe tolerances", times[~exact], lambda n: ca.sumsqr(n.extra[4] * missed(n)), extra
            )
            found.append(_at_most_one(block))
        ends = self.keys.times[[0, -1]]
        if self.end_rates is not None:
            found.append(self.space.at("end rates", ends, lambda n: n.jet.rate - n.extra, self.end_rates))
        if self.end_accelerations is not None:
            wanted = self.end_accelerations
            found.append(self.space.at("end accelerations", ends, lambda n: n.jet.acceleration - n.extra, wanted))
        return (*found, *self._bounds())

    def _bounds(self) -> Iterable[Constraint]:
        moments, limits = ca.DM(self.inertia), self.limits
        breaks = self.space.basis.breakpoints
        # Inside the spans: at a knot two of them would say the same.
        inside = (np.arange(limits.per_span) + 0.5) / limits.per_span
        times = (breaks[:-1, None] + np.diff(breaks)[:, None] * inside).ravel()
        asked = {
            "rate bound": (limits.rate, lambda n: n.jet.rate),
            "acceleration bound": (limits.acceleration, lambda n: n.jet.acceleration),
            "torque bound": (limits.torque, lambda n: n.jet.torque(moments)),
        }
        for name, (most, vector) in asked.items():
            if most is not None:
                yield _at_most_one(self.space.block_at(name, times, lambda n, v=vector, m=most: ca.sumsqr(v(n)) / m**2))

    def motion(self, unknowns: Mapping[str, np.ndarray]) -> QuaternionMotion:
        """The curve of the program's unknowns, its controls normalised."""
        return motion_of(self.space, unknowns[UNKNOWN])

    def unknowns(self, motion: QuaternionMotion) -> dict[str, np.ndarray]:
        """The unknowns closest to a curve: its own controls where the space is the same."""
        basis = self.space.basis
        if motion.degree == basis.degree and np.array_equal(motion.basis.knots, basis.knots):
            return {UNKNOWN: motion.control_points.copy()}
        return {UNKNOWN: carried(motion, basis)[0].control_points.copy()}

    def multipliers(self, multipliers: Mapping[str, np.ndarray]) -> dict[str, Any]:
        """Multipliers by constraint; those of "keyframes" (M, 3), zero where a keyframe has a tolerance."""
        shaped = np.zeros((len(self.keys), 3))
        if "keyframes" in multipliers:
            shaped[np.flatnonzero(self.tolerances[self.held] == 0)] = multipliers["keyframes"]
        return {**multipliers, "keyframes": shaped}

    def with_keyframes(self, program: Program, keyframes: Any) -> Program:
        """The program for other quaternions (M, 4) at the same times, each way between them on the branch it had."""
        began = perf_counter()
        keys = self.keys.turned(keyframes)
        interpolant = interpolate_keys(keys, self.ends, self.end_rates)
        start, space = carried(interpolant, self.space.basis, self.space.channels)
        same = np.array_equal(space.signs, self.space.signs) and np.array_equal(space.turns, self.space.turns)
        fresh = replace(self, keys=keys, start=start, space=space).program()
        # The structure depends on which branches the logarithms take, and on nothing else that changes here.
        structure = program.structure if same else fresh.structure
        return replace(fresh, structure=structure, build_seconds=perf_counter() - began)

    def stages(self, by: str) -> Iterable[Program]:
        """Orientation programs have no stages: InputError."""
        raise InputError("stages are for affine motions; start a finer orientation program from a coarser solution")


def measure_torque(motion: QuaternionMotion, inertia=None, nodes: int = 8) -> float:
    """∫ ‖τ‖² dt of a quaternion curve, by Gauss nodes on every span; ∫ ‖Ω̇‖² dt without inertia."""
    points, weights = gauss(motion.basis, nodes)
    jet, moments = motion.jet(points, 2), as_inertia(inertia)
    torque = jet.acceleration @ moments + np.cross(jet.rate, jet.rate @ moments)
    return float(np.sum(weights * np.sum(torque**2, axis=-1)))


def as_inertia(inertia) -> np.ndarray:
    """(3, 3) the inertia from a matrix, principal moments (3,) or None; InputError unless positive definite."""
    if inertia is None:
        return np.eye(3)
    moments = np.array(inertia, dtype=float)
    moments = np.diag(moments) if moments.shape == (3,) else moments
    if moments.shape != (3, 3) or not np.isfinite(moments).all():
        raise InputError(f"inertia of shape {np.shape(inertia)}: finite, (3, 3) or (3,), is needed")
    if not np.allclose(moments, moments.T, rtol=1e-9, atol=0):
        raise InputError("inertia must be symmetric")
    least, *_, largest = np.linalg.eigvalsh(moments)
    if least <= 1e-12 * max(largest, 0.0) or largest <= 0:
        raise InputError(
            f"inertia is singular or not positive (least moment {least:.3g}): a body needs extent about every axis"
        )
    return moments


def require_whole(value: Any, least: int, what: str) -> None:
    """InputError unless a value is a whole number of at least `least`."""
    if isinstance(value, bool) or int(value) != value or value < least:
        raise InputError(f"{what} {value!r}: a whole number, {least} or more, is needed")


def require_room(basis: BSplineBasis, keys: OrientationKeys, ends: str, rates: Any, accelerations: Any) -> None:
    """InputError where there are more conditions than controls."""
    conditions = len(keys) - (ends == "periodic") + 2 * (rates is not None) + 2 * (accelerations is not None)
    if conditions > basis.n:
        raise InputError(
            f"{conditions} conditions for {basis.n} control quaternions: more knots per interval or a higher degree "
            "is needed"
        )


def _at_most_one(block: Block) -> Constraint:
    shape = (block.count, 1)
    return Constraint(block, np.full(shape, -np.inf), np.ones(shape))
