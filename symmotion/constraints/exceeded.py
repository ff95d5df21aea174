"""By how far a motion that is there exceeds a constraint, anywhere along it or at the times that are asked."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from symmotion.constraints.along import watched
from symmotion.constraints.constraint import JetConstraint, MotionConstraint
from symmotion.constraints.setting import Setting
from symmotion.errors import InputError
from symmotion.jets.linear import LinearSpace, space_of
from symmotion.jets.seen import Seen, Timed, seen
from symmotion.motions import AffineMotion, Keyframes
from symmotion.program import BlockEvaluator, Constraint, Excess, excess_at
from symmotion.splines import Spline


def excess(
    motion: Timed | Mapping[str, Timed], constraint: MotionConstraint, *, keys: Keyframes | None = None
) -> Excess:
    """By how far a constraint is exceeded anywhere along a motion, whoever made it.

    max(0, (value − upper) / |upper|, (lower − value) / |lower|), absolute where a bound is 0, over all components and
    times, of the quantity that is named: ‖v‖ of a speed, whatever is compared. A constraint `at` times is looked at
    there alone.

    motion: affine, pose, orientation or curve; any other that is called with (times, order) and has a `domain`;
        or a mapping of several by name, for a constraint that couples them.
    keys: the keyframes of constraints that speak of them (`Tolerance`, `Velocity`, …).

    Returns an `Excess`: `value`, `time`, `kind`. "certified" is a bound: expressions of sums, products, quotients,
    whole powers and roots of the jet are polynomials on every span of a spline (or their quotients and roots), and lie
    in the hull of their Bernstein coefficients, which subdivision closes to 1e-9; quaternion curves are polynomials up
    to a remainder that is bounded too (`jets.turned`). "sampled" is the largest of many samples, where the motion is
    no spline or the expression something else. Source: Farouki 2012.

        import symmotion as sm

        keys = sm.examples.spatial_keyframes()
        motion = sm.ExactNewton().solve(sm.affine_program(keys)).motion
        print(sm.excess(motion, sm.SpeedBound([[0.0, 0.0, 0.0]], 2.0)))

    Raises InputError where the constraint speaks of what the motion does not have.

    >>> motion = sm.interpolants.component_cubic(sm.examples.spatial_keyframes())
    >>> found = sm.excess(motion, sm.SpeedBound(np.zeros((1, 3)), 14.0))
    >>> round(float(found), 4), found.kind
    (0.0086, 'certified')
    """
    if not isinstance(constraint, MotionConstraint):
        raise InputError(f"constraint {constraint!r} is no condition on a motion: excess(motion, constraint)")
    motions = [seen(m) for m in motion.values()] if isinstance(motion, Mapping) else [seen(motion)]
    space, controls = space_of(motion) if isinstance(motion, AffineMotion | Spline) else (None, None)
    setting = _setting(motions if space is None else [space], keys)
    if type(constraint).build not in (MotionConstraint.build, JetConstraint.build):
        if controls is None:
            raise InputError(
                f"{constraint.name}: a condition on the controls of a spline, not on a {type(motion).__name__}"
            )
        return _at_nodes(constraint.build(setting), controls)
    stated = constraint.stated(setting)
    if stated.at is None and stated.data is None:
        return watched(stated, motions, {k: np.asarray(v) for k, v in (stated.parameters or {}).items()}).excess()
    return stated.excess_at(motions)


def _setting(spaces: list[LinearSpace] | list[Seen], keys: Keyframes | None) -> Setting:
    # Any: what states a condition asks of a space what all jets have: symbols, domain and breakpoints.
    whole: Any = tuple(spaces)
    if keys is None:
        return Setting(whole, np.empty(0), held=False)
    rigid = not isinstance(spaces[0], LinearSpace)
    quaternions = keys.rotations().as_quat()[:, [3, 0, 1, 2]] if rigid else None
    return Setting(whole, keys.times, keys.linear, keys.translation, quaternions)


def _at_nodes(constraint: Constraint, controls: np.ndarray) -> Excess:
    """The excess of a constraint on the controls of a spline, at its nodes."""
    values = BlockEvaluator(constraint.block).out(controls)
    return excess_at(values, constraint.lower, constraint.upper, constraint.times, constraint.power)
