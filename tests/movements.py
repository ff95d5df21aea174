"""One motion, and one curve, of every class that there is, for tests of what they have in common."""

import numpy as np

import symmotion as sm
from symmotion.curves import constant_speed, smooth_step
from symmotion.motions import CurveMotion
from symmotion.motions.nets import smooth_net
from symmotion.motions.quaternions.algebra import exp

RNG = np.random.default_rng(4)
BASIS = sm.splines.BSplineBasis.clamped([0.0, 0.7, 1.5, 2.0], 3)
CLOSED = sm.splines.BSplineBasis.closed([0.0, 0.3, 0.9, 1.4, 2.0], 3)
RIGID = sm.examples.random_keyframes(4, 50, 2)
QUATERNIONS = exp(0.4 * RNG.normal(size=(6, 3)))
NET = smooth_net(6, spatial=True)


def affine(dimension: int, basis: sm.splines.BSplineBasis = BASIS) -> sm.AffineMotion:
    linear = RNG.normal(size=(basis.n, dimension, dimension))
    return sm.AffineMotion(basis, linear, RNG.normal(size=(basis.n, dimension)))


TURNING = sm.quaternions.QuaternionMotion(BASIS, QUATERNIONS)
ALONG = sm.splines.Spline(
    sm.splines.BSplineBasis.clamped([0.0, 1.0, 2.0], 2), np.array([[3.0, 3], [3.4, 5], [5, 4], [6, 6]])
)
MOTIONS = {
    "affine": affine(3),
    "affine in the plane": affine(2),
    "affine, periodic": affine(3, CLOSED),
    "quaternion": TURNING,
    "quaternion, periodic": sm.quaternions.QuaternionMotion(CLOSED, QUATERNIONS[:4]),
    "quaternion, interpolated": sm.quaternions.interpolate_quaternions(RIGID),
    "product of turns": sm.quaternions.ProductMotion.over(
        sm.curves.catmull_rom(RIGID.times, np.eye(4)), RIGID.rotations()
    ),
    "product in the world": sm.quaternions.ProductMotion.over(BASIS, QUATERNIONS, [0, 1, 0, -1, 0], frame="world"),
    "pose": sm.motions.PoseMotion(
        TURNING, sm.splines.Spline(sm.splines.BSplineBasis.clamped([0.0, 1.1, 2.0], 3), RNG.normal(size=(5, 3)))
    ),
    "rational": NET.isoparametric(u=3.7),
    "rational, spherical": smooth_net(6).isoparametric(v=3.2),
    "along a curve": CurveMotion(NET, ALONG),
    "component cubic": sm.interpolants.component_cubic(RIGID),
    "polar, spline": sm.interpolants.polar_blend(RIGID),
    "polar, slerp": sm.interpolants.polar_blend(RIGID, "slerp"),
    "polar in the plane": sm.interpolants.polar_blend(sm.examples.planar_keyframes()),
    "logarithm": sm.interpolants.log_blend(RIGID),
    "logarithm, cubic": sm.interpolants.log_blend(RIGID, 3),
    "steady": sm.interpolants.steady_morph(sm.examples.planar_keyframes()),
    "slerp": sm.interpolants.slerp_curve(RIGID.times, RIGID.rotations()),
    "squad": sm.interpolants.squad(RIGID.times, RIGID.rotations()),
    "Shoemake": sm.interpolants.shoemake_interpolant(RIGID.times, RIGID.rotations()),
    "Shoemake's Bézier": sm.interpolants.shoemake_bezier(QUATERNIONS[:4], [1.0, 3.0]),
    "B-spline by slerps": sm.interpolants.slerp_bspline(BASIS, QUATERNIONS),
    "Barry and Goldman": sm.interpolants.barry_goldman(RIGID),
    "monotone": sm.interpolants.monotone_curve(RIGID, turns=[0, 1, 0]),
    "rational spline": sm.interpolants.rational_spline(RIGID),
}
MOTIONS["pose, monotone"] = sm.motions.PoseMotion(
    MOTIONS["monotone"], sm.curves.catmull_rom(RIGID.times, RIGID.translation)
)
MOTIONS |= {
    "at other times": sm.motions.RetimedMotion(
        MOTIONS["pose"], sm.curves.slow_in_out(domain=(1.0, 4.0), values=(0.1, 1.9))
    ),
    "backwards": sm.motions.reverse(MOTIONS["squad"]),
    "one after the other": sm.motions.concatenate([MOTIONS[name] for name in ("pose", "squad", "affine", "rational")]),
    "seen from another": sm.motions.RelativeMotion(MOTIONS["affine"], MOTIONS["polar, slerp"]),
}
PATH = sm.curves.catmull_rom([0.0, 1.0, 1.5, 3.0], RNG.normal(size=(4, 3)))
CURVES = {
    "spline": PATH,
    "scalar": smooth_step(2),
    "periodic": sm.splines.Spline(CLOSED, RNG.normal(size=(4, 2))),
    "rational quadratic": sm.curves.RationalQuadratic(RNG.normal(size=(3, 2)), np.sqrt(0.5), (1.0, 4.0)),
    "retimed": sm.curves.Retimed(PATH, sm.curves.slow_in_out(values=(0.0, 3.0))),
    "constant speed": constant_speed(PATH, (0.0, 2.0)),
    "path of a point": sm.motions.PointPath(MOTIONS["pose"], [0.3, -0.2, 0.5]),
}
