"""Constraints that refer to a program's keyframes: rates there, tolerances, closure."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from symmotion import checks
from symmotion.constraints.constraint import JetConstraint, MotionConstraint
from symmotion.constraints.setting import Setting
from symmotion.errors import InputError
from symmotion.jets import Jet, RigidJet, rotation
from symmotion.jets.linear import LinearSpace
from symmotion.jets.space import Shifted
from symmotion.kernels import Kernel
from symmotion.program import Block, Constraint


@dataclass(frozen=True, eq=False)
class Velocity(MotionConstraint):
    """v̇(tᵢ) = velocity (d,) of the origin at keyframe i.

    name: of its multipliers. Raises InputError for another dimension, and a keyframe that does not exist.

    >>> keys = sm.examples.spatial_keyframes()
    >>> start = sm.constraints.Velocity(0, [1.0, 0.0, 0.0])
    >>> objective = sm.Rigidity() + 0.01 * sm.TrajectoryEnergy(np.eye(3))
    >>> program = sm.affine_program(keys, objective=objective, constraints=[start])
    >>> sm.ExactNewton().solve(program).require().motion(0.0, 1).translation.round(9) + 0.0
    array([1., 0., 0.])
    """

    keyframe: int
    velocity: ArrayLike
    name: str = "velocity"

    def stated(self, setting: Setting) -> JetConstraint:
        setting.require_translation(self.name)
        i, d = setting.keyframe(self.keyframe, self.name), dimension(setting)
        given = ca.DM(checks.array(self.velocity, (d,), f"{self.name}: velocity"))
        return JetConstraint(lambda jet: jet.dv - given, at=setting.times[[i]], name=self.name)


@dataclass(frozen=True, eq=False)
class AngularRate(MotionConstraint):
    """The body turns with the rate ω at keyframe i: Ȧ(tᵢ) = [ω] A(tᵢ).

    rate: rad per unit of time about the fixed axes, (3,) in space, a number in the plane.

    rate: ω (3,), in the plane a number, in the frame of the world; name: of its multipliers. Raises InputError for
    other shapes.

    >>> rest = sm.constraints.AngularRate(0, [0.0, 0.0, 0.0])
    >>> program = sm.affine_program(sm.examples.spatial_keyframes(), constraints=[rest], refine=2)
    >>> solution = sm.ExactNewton().solve(program)
    >>> bool(np.abs(solution.require().motion(0.0, 1).linear).max() < 1e-9)
    True
    """

    keyframe: int
    rate: ArrayLike
    name: str = "angular rate"

    def stated(self, setting: Setting) -> JetConstraint:
        i, d = setting.keyframe(self.keyframe, self.name), dimension(setting)
        given = checks.array(
            np.atleast_1d(checks.numbers(self.rate, f"{self.name}: rate")), (3 if d == 3 else 1,), f"{self.name}: rate"
        )
        spin = ca.skew(ca.DM(given)) if d == 3 else ca.DM([[0, -given[0]], [given[0], 0]])

        def off(jet: Jet | RigidJet) -> ca.SX:
            if isinstance(jet, RigidJet):
                return jet.world_rate - ca.DM(given)
            return ca.vec((jet.dA - spin @ jet.A).T)

        return JetConstraint(off, at=setting.times[[i]], name=self.name)


@dataclass(frozen=True, eq=False)
class EndRates(MotionConstraint):
    """The rates at both ends: Ω (2, 3) in the body frame [rad per unit of time] of orientations and poses.

    Of affine motions Ȧ (2, d, d) and v̇ (2, d), an `Affine` or a pair; v̇ where the translation is unknown.

    name: of its multipliers. Raises InputError for other shapes.

    >>> keys = sm.examples.random_keyframes(3, 40, seed=1)
    >>> rest = sm.constraints.EndRates(np.zeros((2, 3)))
    >>> solution = sm.ExactNewton().solve(sm.orientation_program(keys, constraints=[rest], refine=2)).require()
    >>> bool(np.abs(solution.motion.rate([0.0, 2.0])).max() < 1e-8)
    True
    """

    rates: ArrayLike | tuple[ArrayLike, ArrayLike] | None
    name: str = "end rates"

    def stated(self, setting: Setting) -> JetConstraint:
        if isinstance(setting.space.symbols(), RigidJet):
            given = checks.array(self.rates, (2, 3), self.name)
            return JetConstraint(lambda jet, wanted: jet.rate - wanted, at=_ends(setting), name=self.name, data=given)
        linear, travel = affine_rates(self.rates, dimension(setting), self.name)
        given = np.concatenate([linear.reshape(2, -1), *([travel] if setting.moves else [])], axis=1)

        def off(jet: Jet, wanted: ca.SX) -> ca.SX:
            return ca.vertcat(ca.vec(jet.dA.T), *([jet.dv] if setting.moves else [])) - wanted

        return JetConstraint(off, at=_ends(setting), name=self.name, data=given)


def affine_rates(rates: object, d: int, what: str) -> tuple[np.ndarray, np.ndarray]:
    """Ȧ (2, d, d) and v̇ (2, d) at both ends from a pair of them; InputError that names what is none."""
    if not isinstance(rates, tuple | list) or len(rates) != 2:
        raise InputError(f"{what}: a pair of linear parts (2, {d}, {d}) and translations (2, {d}) is needed")
    return (
        checks.array(rates[0], (2, d, d), f"{what}: linear parts"),
        checks.array(rates[1], (2, d), f"{what}: translations"),
    )


@dataclass(frozen=True, eq=False)
class EndAccelerations(MotionConstraint):
    """Ω̇(t₁) and Ω̇(t_M), the angular accelerations (2, 3) at both ends in the body frame, rad per unit of time².

    name: of its multipliers. Raises InputError for other shapes, and for motions that do not turn rigidly.

    >>> keys = sm.examples.random_keyframes(3, 40, seed=1)
    >>> still = sm.constraints.EndAccelerations(np.zeros((2, 3)))
    >>> solution = sm.ExactNewton().solve(sm.orientation_program(keys, constraints=[still], refine=2)).require()
    >>> bool(np.abs(solution.motion.acceleration([0.0, 2.0])).max() < 1e-8)
    True
    """

    accelerations: ArrayLike
    name: str = "end accelerations"

    def stated(self, setting: Setting) -> JetConstraint:
        given = checks.array(self.accelerations, (2, 3), self.name)
        return JetConstraint(
            lambda jet, wanted: jet.acceleration - wanted, at=_ends(setting), name=self.name, data=given
        )


@dataclass(frozen=True, eq=False)
class Periodic(MotionConstraint):
    """The motion closes: derivatives 1 … degree − 1 agree at both ends, where the keyframes are the same.

    Of a fit, whose samples are not met, the places too.

    name: of its multipliers. Raises InputError where the first and the last keyframe differ.

    >>> keys = sm.examples.planar_keyframes()
    >>> closed = keys.moved(-1, keys.linear[0], keys.translation[0])
    >>> solution = sm.ExactNewton().solve(sm.affine_program(closed, constraints=[sm.constraints.Periodic()])).require()
    >>> start, end = solution.motion([0.0, 1.0], 1).linear
    >>> bool(np.abs(start - end).max() < 1e-9)
    True
    """

    name: str = "periodic"

    def stated(self, setting: Setting) -> JetConstraint:
        raise InputError(f'{self.name}: make a program with ends="periodic", whose curve is closed')

    def build(self, setting: Setting) -> Constraint:
        space = setting.space
        if not isinstance(space, LinearSpace):
            return super().build(setting)
        if setting.held:
            self._require_closed(setting)
        basis, channels = space.basis, space.channels
        if basis.degree < 2:
            raise InputError(f"{self.name}: degree {basis.degree} has no derivative to close; degree 2 is needed")
        ends = np.array(basis.domain)
        rows = [
            basis.matrix(ends[1:], nu) - basis.matrix(ends[:1], nu)
            for nu in range(1 if setting.held else 0, basis.degree)
        ]
        # Derivatives grow with their order as the span shrinks; scaled they weigh alike.
        rows = [row / abs(row).max() for row in rows]
        z = ca.SX.sym("z", channels)
        kernel = Kernel(z, ca.SX.sym("none", 0), z, channels)
        operator = sparse.csr_array(sparse.vstack(rows))
        n, whole = len(rows), slice(0, channels)
        return Constraint.equality(
            Block(self.name, kernel, space.variable, whole, operator, 1, np.ones(n), np.empty((n, 0)))
        )

    def _require_closed(self, setting: Setting) -> None:
        parts = [p for p in (setting.linear, setting.translation) if p is not None]
        scale = max([1.0, *(float(np.abs(p).max()) for p in parts)])
        apart = max((float(np.abs(p[0] - p[-1]).max()) for p in parts), default=0.0)
        if apart > 1e-9 * scale:
            raise InputError(f"{self.name}: the first and the last keyframe differ by {apart:.2g}; make them the same")


@dataclass(frozen=True, eq=False)
class OnLine(MotionConstraint):
    """v(tᵢ) lies on the line through keyframe i's translation along `direction` (d,), instead of being given.

    name: of its multipliers. Raises InputError for a direction that is zero or of another dimension.

    >>> keys = sm.examples.spatial_keyframes()
    >>> line = sm.constraints.OnLine(1, [0.0, 0.0, 1.0])
    >>> objective = sm.Rigidity() + 0.01 * sm.TrajectoryEnergy(np.eye(3))
    >>> program = sm.affine_program(keys, objective=objective, constraints=[line])
    >>> solution = sm.ExactNewton().solve(program).require()
    >>> (solution.motion(keys.times[1]).translation - keys.translation[1])[:2].round(9) + 0.0
    array([0., 0.])
    """

    keyframe: int
    direction: ArrayLike
    name: str = "line"

    def frees(self, setting: Setting) -> tuple[set[int], set[int]]:
        return set(), {setting.keyframe(self.keyframe, self.name)}

    def seen_from(self, setting: Setting) -> Setting:
        return near(setting)

    def follows(self, setting: Setting) -> tuple[np.ndarray, slice] | None:
        if setting.linear is None:
            return None
        return np.array([setting.keyframe(self.keyframe, self.name)]), slice(setting.linear.shape[-1] ** 2, None)

    def stated(self, setting: Setting) -> JetConstraint:
        setting.require_translation(self.name)
        i, d = setting.keyframe(self.keyframe, self.name), dimension(setting)
        direction = checks.array(self.direction, (d,), f"{self.name}: direction")
        if not direction.any():
            raise InputError(f"{self.name}: the direction is zero")
        if setting.translation is None:
            raise InputError(f"{self.name}: the keyframes have no translation")
        across = ca.DM(np.linalg.svd(direction[None])[2][1:])  # rows that span the directions across the line
        return JetConstraint(
            lambda jet, point: across @ (jet.v - point),
            at=setting.times[[i]],
            name=self.name,
            data=setting.translation[[i]],
        )


@dataclass(frozen=True, eq=False)
class Tolerance(MotionConstraint):
    """Keyframes met to within ε instead of exactly: each entry |A(tᵢ) − A*ᵢ| ≤ ε, or the Frobenius norm, `norm`.

    linear, translation: the two ε, None for exact; keyframes: which, all when left out. turn: of orientations and
    poses, by how many rad each of those keyframes may be missed, one number or one for each, 0 for not at all.

    name: of its multipliers. Raises InputError for an ε that is negative, and where none is given.

    >>> keys = sm.examples.planar_keyframes()
    >>> exact = sm.ExactNewton().solve(sm.affine_program(keys)).require()
    >>> near = sm.ExactNewton().solve(sm.affine_program(keys, constraints=[sm.Tolerance(linear=0.05)])).require()
    >>> near.objective < exact.objective
    True
    """

    linear: float | None = None
    translation: float | None = None
    norm: bool = False
    keyframes: Sequence[int] | None = None
    name: str = "tolerance"
    turn: ArrayLike | None = None

    def __post_init__(self):
        super().__post_init__()
        for what, value in (("linear", self.linear), ("translation", self.translation)):
            if value is not None:
                checks.positive(value, f"{self.name}: {what}")
        if self.linear is None and self.translation is None and self.turn is None:
            raise InputError(f"{self.name}: a tolerance on the linear part or the translation, or a turn, is needed")
        if self.turn is not None:
            turn = checks.numbers(self.turn, f"{self.name}: turn")
            good = np.isfinite(turn) & (turn >= 0)
            if turn.ndim > 1:
                raise InputError(f"{self.name}: turn of shape {turn.shape}: one number, or one for each, is needed")
            if not good.all():
                i = int(np.argmin(np.atleast_1d(good)))
                raise InputError(
                    f"the tolerance of keyframe {i} is {np.atleast_1d(turn)[i]:g}: 0 rad or more is needed"
                )

    def _which(self, setting: Setting) -> list[int]:
        every = range(len(setting.times)) if self.keyframes is None else self.keyframes
        return checks.indices(every, len(setting.times), f"{self.name}: keyframe")

    def _turns(self, setting: Setting) -> np.ndarray:
        """(M,) the turn by which each keyframe may be missed."""
        turns, which = np.zeros(len(setting.times)), self._which(setting)
        if self.turn is not None:
            try:
                turns[which] = self.turn
            except ValueError:
                raise InputError(
                    f"{self.name}: turns of shape {np.shape(self.turn)} for {len(which)} keyframes"
                ) from None
        return turns

    def frees(self, setting: Setting) -> tuple[set[int], set[int]]:
        which = set(self._which(setting))
        turned = set(np.flatnonzero(self._turns(setting)).tolist())
        return (which if self.linear else turned), (which if self.translation else set())

    def seen_from(self, setting: Setting) -> Setting:
        return near(setting)

    def follows(self, setting: Setting) -> tuple[np.ndarray, slice] | None:
        rigid = isinstance(setting.space.symbols(), RigidJet)
        return None if rigid else (np.array(self._which(setting)), slice(None))

    def stated(self, setting: Setting) -> JetConstraint:
        rigid = isinstance(setting.space.symbols(), RigidJet)
        if rigid and self.linear:
            raise InputError(f"{self.name}: orientations have no linear part to miss: give a turn, in rad")
        if not rigid and self.turn is not None:
            raise InputError(f"{self.name}: a turn is for orientations and poses: give linear, per entry")
        if self.translation:
            setting.require_translation(self.name)
        return self._of_turns(setting) if rigid else self._of_entries(setting)

    def _of_entries(self, setting: Setting) -> JetConstraint:
        which, d = self._which(setting), dimension(setting)
        assert setting.linear is not None and setting.translation is not None  # affine programs have both
        limits = [x for x in (self.linear, self.translation) if x]

        def parts(jet: Jet, target: ca.SX) -> list[ca.SX]:
            found = [ca.vec(jet.A.T) - target[: d * d]] if self.linear else []
            return found + ([jet.v - target[d * d :]] if self.translation else [])

        def off(jet: Jet, target: ca.SX) -> ca.SX:
            return ca.vertcat(*(ca.sumsqr(p) if self.norm else p for p in parts(jet, target)))

        sizes = [1 if self.norm else n for n, x in ((d * d, self.linear), (d, self.translation)) if x]
        upper = np.concatenate([np.full(n, x**2 if self.norm else x) for n, x in zip(sizes, limits, strict=True)])
        data = np.concatenate([setting.linear.reshape(-1, d * d), setting.translation], axis=1)[which]
        lower = np.full_like(upper, -np.inf) if self.norm else -upper
        power = 2 if self.norm else 1
        return JetConstraint(
            off, lower=lower, upper=upper, at=setting.times[which], name=self.name, data=data, power=power
        )

    def _of_turns(self, setting: Setting) -> JetConstraint:
        # Relative to the tolerance: the condition is of the order of one.
        turns, every = self._turns(setting), self._which(setting)
        which = np.flatnonzero(turns) if self.translation is None else np.array(every)
        turned = bool(turns.any())
        if not which.size:
            raise InputError(f"{self.name}: all turns are zero: nothing is left free")
        if turned and not turns[which].all():
            raise InputError(f"{self.name}: give turns and translations of different keyframes a constraint each")
        assert setting.quaternions is not None  # rigid programs have them
        inverse = setting.quaternions[which] * np.array([1.0, -1.0, -1.0, -1.0])
        data = [inverse, 1 / np.where(turns > 0, turns, 1.0)[which, None]]
        if self.translation:
            data += [setting.translation[which] / self.translation]  # pyright: ignore[reportOptionalSubscript]

        def off(jet: RigidJet, target: ca.SX) -> ca.SX:
            missed = 2 * rotation.log(rotation.product(target[:4], jet.quaternion))
            found = [ca.sumsqr(target[4] * missed)] if turned else []
            if self.translation:
                found.append(ca.sumsqr(jet.v / self.translation - target[5:8]))
            return ca.vertcat(*found)

        times, name = setting.times[which], self.name
        return JetConstraint(off, lower=-np.inf, upper=1.0, at=times, name=name, data=np.column_stack(data), power=2)


@dataclass(frozen=True, eq=False)
class ExactSamples(MotionConstraint):
    """Keyframes or samples of these numbers are met exactly: A(tᵢ) = A*ᵢ, v(tᵢ) = v*ᵢ (K, d² + d), rows of A first.

    name: of its multipliers. Raises InputError for numbers that do not exist, and programs that have no affine
    keyframes or samples.

    >>> samples = sm.examples.recorded_tour(40)
    >>> ends = sm.constraints.ExactSamples([0, 39])
    >>> fit = sm.ExactNewton().solve(sm.fit_program(samples, controls=15, constraints=[ends])).require()
    >>> bool(np.allclose(fit.motion(0.0).translation, samples.translation[0]))
    True
    """

    numbers: Sequence[int]
    name: str = "exact samples"

    def which(self, m: int) -> np.ndarray:
        """(N,) the numbers among m, each once, in order."""
        return np.array(checks.indices(self.numbers, m, "exact sample"), dtype=int)

    def seen_from(self, setting: Setting) -> Setting:
        return near(setting)

    def follows(self, setting: Setting) -> tuple[np.ndarray, slice] | None:
        return self.which(len(setting.times)), slice(None)

    def stated(self, setting: Setting) -> JetConstraint:
        if setting.linear is None or setting.translation is None or isinstance(setting.space.symbols(), RigidJet):
            raise InputError(f"{self.name}: affine keyframes or samples are needed")
        which, d = self.which(len(setting.times)), dimension(setting)
        data = np.concatenate([setting.linear.reshape(-1, d * d), setting.translation], axis=1)[which]
        return JetConstraint(
            lambda jet, target: ca.vertcat(ca.vec(jet.A.T), jet.v) - target,
            at=setting.times[which],
            name=self.name,
            data=data,
        )


def dimension(setting: Setting) -> int:
    """The dimension of the body; InputError where there is none."""
    jet = setting.space.symbols()
    if not isinstance(jet, Jet | RigidJet):
        raise InputError(f"a constraint of a body's motion, on a jet of kind {jet.kind}")
    return jet.dimension


def near(setting: Setting) -> Setting:
    """The setting with places that count from the shift of the program, as its unknowns do.

    What compares a place with a keyframe's says the same there, and loses no digits to how far away both are.
    """
    space, places = setting.space, setting.translation
    if not isinstance(space, Shifted) or space.shift is None or places is None:
        return setting
    return replace(setting, spaces=(space.unshifted,), translation=places - space.shift[-places.shape[1] :])


def _ends(setting: Setting) -> np.ndarray:
    return setting.times[[0, -1]] if len(setting.times) else np.array(setting.domain)
