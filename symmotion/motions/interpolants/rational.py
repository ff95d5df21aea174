"""Rational spline motions through rigid keyframes: splines of dual quaternions."""

import numpy as np

from symmotion.checks import choice
from symmotion.errors import InputError
from symmotion.motions.dual import DualQuaternions
from symmotion.motions.keyframes import Keyframes
from symmotion.motions.rational import RationalMotion
from symmotion.splines import cubic_interpolant

ENDS = ("natural", "not-a-knot")


def rational_spline(keyframes: Keyframes, ends: str = "natural") -> RationalMotion:
    """The C² rational motion through rigid keyframes: the cubic spline through their unit dual quaternions (HJK 4.1).

    Q(t) + εQ⁰(t) = Σ N_j(t) (Q_j + εQ⁰_j) is no unit dual quaternion, but divided by QQ* its motion is rigid all the
    way, and points run on rational splines of degree 6. Seen from other frames, of the world or of the body, it is the
    same motion. Between neighbours that are θ apart |Q| falls to about cos θ/4, and the motion is the faster there.
    Source: Jüttler and Wagner 1996.

    ends: "natural" (no second derivative of the dual quaternion there), or "not-a-knot" (4 keyframes or more).

    Raises InputError for keyframes in the plane or not rigid, and ends that are none.

    >>> keys = sm.examples.random_keyframes(4, 60, seed=1)
    >>> motion = sm.interpolants.rational_spline(keys)
    >>> bool(np.allclose(motion(keys.times).linear, keys.linear))
    True
    >>> sm.motions.orthonormalise(motion, np.linspace(0, 3, 50)).deviation < 1e-12
    True
    """
    choice(ends, ENDS, "end condition")
    if keyframes.dimension != 3:
        raise InputError("rational motions are those of bodies in space: the keyframes are in the plane")
    poses = DualQuaternions.from_rotations(keyframes.rotations(), keyframes.translation).aligned()
    spline = cubic_interpolant(keyframes.times, np.concatenate([poses.real, poses.dual], axis=1), ends)
    return RationalMotion(spline.basis, spline.control_points[:, :4], spline.control_points[:, 4:])
