"""Constraints along a motion: volumes, speeds, rates, accelerations, torques; each a few lines on `JetConstraint`."""

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.brief import instant
from symmotion.constraints.constraint import DENSITY, JetConstraint, MotionConstraint
from symmotion.constraints.keyframed import dimension
from symmotion.constraints.setting import Setting
from symmotion.energies import as_inertia
from symmotion.errors import InputError
from symmotion.jets import BodyJet, RigidJet


@dataclass(frozen=True, eq=False)
class UnitVolume(MotionConstraint):
    """det A(t) = 1 at given times, between the keyframes.

    times: (N,); name: of its multipliers. Raises InputError for times of keyframes, whose volume is given.

    >>> keys = sm.Keyframes([0.0, 1.0], [np.eye(2), sm.examples.rotation_2d(90)])
    >>> half = sm.constraints.UnitVolume([0.5])
    >>> solution = sm.ExactNewton().solve(sm.affine_program(keys, constraints=[half], refine=2)).require()
    >>> round(float(np.linalg.det(solution.motion(0.5).linear)), 9)
    1.0
    """

    times: ArrayLike
    name: str = "unit volume"

    def stated(self, setting: Setting) -> JetConstraint:
        times = setting.inside(np.atleast_1d(checks.numbers(self.times, f"{self.name}: times")), self.name)
        on_keyframe = np.isin(times, setting.times)  # exact: `inside` puts them there
        if on_keyframe.any():
            raise InputError(
                f"{self.name}: time {instant(times[on_keyframe][0])} is a keyframe's, whose volume is given"
            )
        return JetConstraint(lambda jet: ca.det(jet.A) - 1, at=times, name=self.name)


@dataclass(frozen=True, eq=False)
class NoInversion(MotionConstraint):
    """det A(t) ≥ ε along the motion, to begin with at `density` times per segment between the keyframes.

    least: ε > 0; name: of its multipliers. Raises InputError where a keyframe's determinant is below ε.

    >>> keys = sm.examples.planar_keyframes()
    >>> solution = sm.ExactNewton().solve(sm.affine_program(keys, constraints=[sm.constraints.NoInversion(0.5)]))
    >>> float(solution.require(1e-6).certificate.excess["no inversion"]) < 1e-6
    True
    """

    least: float
    density: int = DENSITY
    name: str = "no inversion"

    def __post_init__(self):
        super().__post_init__()
        checks.number(self.least, f"{self.name}: least")

    def stated(self, setting: Setting) -> JetConstraint:
        if setting.linear is not None:
            volumes = np.linalg.det(setting.linear)
            if (volumes < self.least).any():
                i, most = int(np.argmin(volumes)), int(np.argmax(volumes))
                if volumes[i] < 0 < volumes[most]:
                    raise InputError(
                        f"{self.name}: keyframe {i} has determinant {volumes[i]:.3g} and keyframe {most} "
                        f"{volumes[most]:.3g}: between them det A passes zero; leave it out, or mend the keyframe"
                    )
                raise InputError(f"{self.name}: keyframe {i} has determinant {volumes[i]:.3g}, below {self.least:g}")
        times = setting.between_keyframes(self.density, self.name)
        return JetConstraint(
            lambda jet: ca.det(jet.A),
            lower=float(self.least),
            upper=np.inf,
            first=times if times.size else None,
            name=self.name,
        )


@dataclass(frozen=True, eq=False)
class SpeedBound(MotionConstraint):
    """‖velocity of p‖ ≤ limit for body points p (P, d), to begin with at `density` times per segment and its ends.

    name: of its multipliers. Raises InputError for a limit that is not positive, and points of another dimension.

    >>> motion = sm.interpolants.component_cubic(sm.examples.spatial_keyframes())
    >>> round(float(sm.excess(motion, sm.SpeedBound(np.zeros((1, 3)), 14.0))), 4)
    0.0086
    """

    points: ArrayLike
    limit: float
    density: int = DENSITY
    name: str = "speed"

    def __post_init__(self):
        super().__post_init__()
        checks.positive(self.limit, f"{self.name}: limit")

    def stated(self, setting: Setting) -> JetConstraint:
        setting.require_translation(self.name)
        given = np.atleast_2d(checks.numbers(self.points, f"{self.name}: body points"))
        limit, points = self.limit, checks.array(given, ("P", dimension(setting)), f"{self.name}: body points")

        def squares(jet: BodyJet) -> ca.SX:
            return ca.vertcat(*(ca.sumsqr(jet.velocity(p)) for p in points))

        times = np.union1d(setting.between_keyframes(self.density, self.name), setting.times)
        return JetConstraint(
            squares, lower=-np.inf, upper=limit**2, first=times if times.size else None, name=self.name, power=2
        )


@dataclass(frozen=True, eq=False)
class RateBound(MotionConstraint):
    """‖Ω(t)‖ ≤ limit [rad per unit of time] along the motion, to begin with at `density` times in each span.

    name: of its multipliers. Raises InputError for a limit that is not positive.

    >>> keys = sm.examples.random_keyframes(4, 60, seed=1)
    >>> solution = sm.ExactNewton().solve(sm.orientation_program(keys, constraints=[sm.RateBound(1.2)], refine=2))
    >>> bool(np.linalg.norm(solution.require(1e-6).motion.rate(np.linspace(0, 3, 500)), axis=1).max() < 1.2 + 1e-6)
    True
    """

    limit: float
    density: int = 5
    name: str = "rate bound"

    def __post_init__(self):
        super().__post_init__()
        checks.positive(self.limit, "bound on the rate:")

    def stated(self, setting: Setting) -> JetConstraint:
        return _norm_bound(self, setting, lambda jet: jet.rate)


@dataclass(frozen=True, eq=False)
class AccelerationBound(MotionConstraint):
    """‖Ω̇(t)‖ ≤ limit [rad per unit of time²] along the motion, to begin with at `density` times in each span.

    name: of its multipliers. Raises InputError for a limit that is not positive.

    >>> keys = sm.examples.random_keyframes(3, 40, seed=1)
    >>> program = sm.orientation_program(keys, constraints=[sm.constraints.AccelerationBound(2.0)], refine=2)
    >>> sm.ExactNewton().solve(program).require(1e-6).certificate.excess["acceleration bound"].kind
    'certified'
    """

    limit: float
    density: int = 5
    name: str = "acceleration bound"

    def __post_init__(self):
        super().__post_init__()
        checks.positive(self.limit, "bound on the acceleration:")

    def stated(self, setting: Setting) -> JetConstraint:
        return _norm_bound(self, setting, lambda jet: jet.acceleration)


@dataclass(frozen=True, eq=False)
class TorqueBound(MotionConstraint):
    """‖τ(t)‖ ≤ limit along the motion, τ = J Ω̇ + Ω × JΩ, to begin with at `density` times in each span.

    inertia: J as in `Torque`, the identity when left out.

    name: of its multipliers. Raises InputError for a limit that is not positive, and an inertia that no body has.

    >>> keys = sm.examples.random_keyframes(3, 40, seed=1)
    >>> bound = sm.constraints.TorqueBound(3.0, (1.0, 2.0, 2.5))
    >>> program = sm.orientation_program(keys, objective=sm.Torque((1.0, 2.0, 2.5)), constraints=[bound], refine=2)
    >>> sm.ExactNewton().solve(program).require(1e-6).inertia
    'positive'
    """

    limit: float
    inertia: ArrayLike | None = None
    density: int = 5
    name: str = "torque bound"

    def __post_init__(self):
        super().__post_init__()
        checks.positive(self.limit, "bound on the torque:")

    def stated(self, setting: Setting) -> JetConstraint:
        moments = as_inertia(self.inertia)
        return _norm_bound(self, setting, lambda jet: jet.torque(moments))


def _norm_bound(
    bound: RateBound | AccelerationBound | TorqueBound,
    setting: Setting,
    vector: Callable[[RigidJet], ca.SX],
) -> JetConstraint:
    """‖vector(jet)‖² / limit² ≤ 1 of one of the bounds above: of the order of one, whatever the unit."""
    limit = float(bound.limit)
    times = setting.inside_spans(bound.density, bound.name)
    return JetConstraint(
        lambda jet: ca.sumsqr(vector(jet)) / limit**2,
        lower=-np.inf,
        upper=1.0,
        first=times if times.size else None,
        name=bound.name,
        power=2,
    )
