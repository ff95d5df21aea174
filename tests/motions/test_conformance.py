"""What all motions have in common, and what all values do."""

import pickle
import re
from dataclasses import fields
from itertools import pairwise
from typing import Any, cast

import numpy as np
import pytest
from movements import CURVES, MOTIONS, NET, RIGID

import symmotion as sm
from symmotion.loading import load
from symmotion.motions import Affine, Motion, as_keyframes
from symmotion.motions.quaternions import OrientationKeys
from symmotion.motions.quaternions.algebra import rotate
from symmotion.saving import save

ALL = pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS)
VALUES = {
    **MOTIONS,
    **CURVES,
    "basis": sm.splines.BSplineBasis.clamped([0, 1, 2], 2),
    "keyframes": RIGID,
    "orientation keys": OrientationKeys.of(RIGID),
    "dual quaternions": NET.control_displacements,
    "two parameters": NET,
    "rigid samples": sm.motions.orthonormalise(MOTIONS["affine in the plane"], [0.0, 0.1]),
}
RNG = np.random.default_rng(9)


def inside(motion, count=12):
    """Times with breakpoints at some distance, a row for each piece."""
    breaks = motion.breakpoints
    shares = (np.arange(count) + 0.5) / count
    return np.stack([a + (b - a) * shares for a, b in pairwise(breaks)])


@ALL
def test_every_motion_has_a_domain_with_breakpoints_and_a_matrix_of_what_it_is_called_for(motion: Motion):
    a, b = motion.domain
    d, t = motion.dimension, inside(motion)
    assert isinstance(a, float) and isinstance(b, float) and a < b
    breaks = motion.breakpoints
    assert breaks[0] == a and breaks[-1] == b and (np.diff(breaks) > 0).all()
    for nu in range(3):
        matrix = motion.matrix(t, nu)
        assert matrix.shape == (*t.shape, d + 1, d + 1)
        np.testing.assert_array_equal(
            matrix[..., d, :], np.broadcast_to(np.eye(d + 1)[d] * (nu == 0), (*t.shape, d + 1))
        )
        value = motion(t, nu)
        if isinstance(value, Affine):
            np.testing.assert_array_equal(matrix[..., :d, :d], value.linear)
            np.testing.assert_array_equal(matrix[..., :d, d], value.translation)
        else:
            assert value.shape == (*t.shape, 4)
            assert not matrix[..., :3, 3].any()
            if nu == 0:
                turned = np.stack([rotate(value, axis) for axis in np.eye(3)], axis=-1)
                np.testing.assert_allclose(matrix[..., :3, :3], turned, atol=1e-14)
        one = motion.matrix(float(t[0, 2]), nu)
        np.testing.assert_allclose(one, matrix[0, 2], atol=1e-12 * (1 + np.abs(matrix).max()))
    assert motion.matrix([a, b]).shape == (2, d + 1, d + 1)


@ALL
def test_derivatives_of_trajectories_are_those_of_their_differences(motion: Motion):
    t, points, h = inside(motion, 3), RNG.normal(size=(4, motion.dimension)), 1e-5
    np.testing.assert_allclose(
        motion.trajectory(points, t),
        np.einsum("...ij,pj->...pi", motion.matrix(t), np.column_stack([points, np.ones(4)]))[..., :-1],
        atol=1e-12,
    )
    for nu in (1, 2):
        exact = motion.trajectory(points, t, nu)
        assert exact.shape == (*t.shape, 4, motion.dimension)
        rise = motion.trajectory(points, t + h, nu - 1) - motion.trajectory(points, t - h, nu - 1)
        np.testing.assert_allclose(rise / (2 * h), exact, atol=1e-6 * (1 + np.abs(exact).max()))


@ALL
def test_the_path_of_one_point_is_that_of_a_list_of_it(motion: Motion):
    p, t = RNG.normal(size=motion.dimension), inside(motion, 2)
    for nu in range(3):
        one = motion.trajectory(p, t, nu)
        assert one.shape == (*t.shape, 1, motion.dimension)
        np.testing.assert_array_equal(one, motion.trajectory(p[None], t, nu))
        assert motion.trajectory(p, float(t[0, 0]), nu).shape == (1, motion.dimension)


def test_so_it_is_in_two_parameters():
    for nu in ((0, 0), (1, 0), (0, 2)):
        one = NET.trajectory([0.1, 0.2, 0.3], [[3.2], [3.4]], [3.1, 3.3, 3.5], nu)
        assert one.shape == (2, 3, 1, 3)
        np.testing.assert_array_equal(one, NET.trajectory([[0.1, 0.2, 0.3]], [[3.2], [3.4]], [3.1, 3.3, 3.5], nu))


@ALL
def test_ends_are_met_up_to_rounding(motion: Motion):
    a, b = motion.domain
    for t, end in ((a - 1e-13 * (b - a), a), (b + 1e-13 * (b - a), b)):
        np.testing.assert_allclose(motion.matrix(t), motion.matrix(end), atol=1e-10)


@ALL
def test_no_motion_goes_on_outside_its_domain(motion: Motion):
    a, b = motion.domain
    for t in (a - 0.01, [a, b + 0.01]):
        for ask in (motion, motion.matrix, lambda t: motion.trajectory(np.eye(motion.dimension), t)):
            with pytest.raises(sm.InputError, match="domain"):
                ask(t)
    with pytest.raises(sm.InputError, match="body points"):
        motion.trajectory(np.zeros((2, 5)), a)
    with pytest.raises(sm.InputError, match="order"):
        motion(a, -1)


def test_along_a_curve_the_knot_lines_that_it_crosses_are_breakpoints():
    motion = MOTIONS["along a curve"]
    third = [np.abs(motion.curve(t) - np.round(motion.curve(t))).min() for t in motion.breakpoints]
    crossed = [t for t, off in zip(motion.breakpoints, third, strict=True) if off < 1e-9]
    assert len(crossed) >= 5
    assert {1.0} <= set(motion.breakpoints)


@pytest.mark.parametrize("value", VALUES.values(), ids=VALUES)
def test_values_are_equal_by_their_contents(value):
    again = pickle.loads(pickle.dumps(value))
    assert again is not value
    assert again == value and hash(again) == hash(value)
    assert value != "something else"
    assert sum(value == other for other in VALUES.values()) == 1
    line = repr(value)
    assert line.startswith(type(value).__name__) and len(line) < 250 and "array" not in line and "\n" not in line
    assert "_scipy" not in vars(again)


@pytest.mark.parametrize("value", VALUES.values(), ids=VALUES)
def test_arrays_of_values_refuse_writes(value):
    for held in (value, pickle.loads(pickle.dumps(value))):
        arrays = [a for f in fields(held) if isinstance(a := getattr(held, f.name), np.ndarray)]
        assert not any(a.flags.writeable for a in arrays)


def test_a_changed_number_makes_another_value():
    motion = MOTIONS["affine"]
    linear = motion.linear.copy()
    linear[1, 2, 0] = np.nextafter(linear[1, 2, 0], 9)
    assert sm.AffineMotion(motion.basis, linear, motion.translation) != motion
    nothing = sm.AffineMotion(motion.basis, np.full_like(linear, np.nan))
    assert nothing == pickle.loads(pickle.dumps(nothing))
    assert hash(nothing) == hash(pickle.loads(pickle.dumps(nothing)))


class Mine:
    """A user's own curve, which cannot be hashed."""

    __hash__ = None  # type: ignore
    domain = (0.0, 1.0)
    breakpoints = np.array([0.0, 1.0])

    def __call__(self, t, nu=0, extrapolate=False):
        return np.asarray(t, dtype=float) if nu == 0 else np.full(np.shape(t), float(nu == 1))


def test_nothing_hashes_an_object_of_the_users():
    curve = sm.curves.Retimed(Mine(), sm.curves.slow_in_out())  # type: ignore
    assert hash(curve) == hash(sm.curves.Retimed(Mine(), sm.curves.slow_in_out()))  # type: ignore
    assert curve != sm.curves.Retimed(Mine(), sm.curves.slow_in_out())  # type: ignore
    assert curve == curve


def given_arrays():
    """Constructors by name, each with the arrays that it is given."""
    basis, quaternions = MOTIONS["quaternion"].basis, MOTIONS["quaternion"].control_points
    times, net = np.array(RIGID.times), NET.real
    linear, place = MOTIONS["affine"].linear, MOTIONS["affine"].translation
    samples = np.arange(4.0), RIGID.linear, RIGID.translation, np.ones(4)
    return {
        "BSplineBasis": (lambda k: sm.splines.BSplineBasis(k, 3), basis.knots),
        "Spline": (lambda c: sm.splines.Spline(basis, c), place),
        "RationalQuadratic": (lambda c: sm.curves.RationalQuadratic(c, 0.5), place[:3]),
        "SymbolicSpline": (lambda c: sm.curves.SymbolicSpline(basis.knots, c, 3).to_bspline(), place),
        "bezier": (sm.curves.bezier, place),
        "hermite_spline": (sm.curves.hermite_spline, times, RIGID.translation, RIGID.translation),
        "catmull_rom": (sm.curves.catmull_rom, times, RIGID.translation),
        "cubic_interpolant": (sm.splines.cubic_interpolant, times, RIGID.translation),
        "Keyframes": (sm.Keyframes, times, RIGID.linear, RIGID.translation),
        "Keyframes.of": (sm.Keyframes.of, times, RIGID.linear, RIGID.translation),
        "OrientationKeys": (OrientationKeys, times, quaternions[:4], np.zeros((3, 3))),
        "AffineMotion": (lambda a, v: sm.AffineMotion(basis, a, v), linear, place),
        "QuaternionMotion": (lambda q: sm.quaternions.QuaternionMotion(basis, q), quaternions),
        "QuaternionMotion with increments": (
            lambda q, w: sm.quaternions.QuaternionMotion(basis, q, w),
            quaternions,
            MOTIONS["quaternion"].increments,
        ),
        "DualQuaternions": (sm.motions.DualQuaternions, net, NET.dual),
        "RationalMotion": (lambda q, d: sm.motions.RationalMotion(NET.u, q, d), net[0], np.asarray(NET.dual)[0]),
        "TwoParameterMotion": (lambda q, d: sm.motions.TwoParameterMotion(NET.u, NET.v, q, d), net, NET.dual),
        "RigidSamples": (sm.motions.RigidSamples, *samples),
        "interpolate_quaternions": (sm.quaternions.interpolate_quaternions, times, quaternions[:4]),
        "squad": (sm.interpolants.squad, times, quaternions[:4]),
        "slerp_curve": (sm.interpolants.slerp_curve, times, quaternions[:4]),
        "shoemake_bezier": (sm.interpolants.shoemake_bezier, quaternions),
    }


@pytest.mark.parametrize("name", given_arrays())
def test_what_a_caller_does_to_his_arrays_changes_nothing(name):
    make, *arrays = given_arrays()[name]
    own = [np.array(a) for a in arrays]
    made, same = make(*own), make(*arrays)
    for array in own:
        assert array.flags.writeable
        array[...] = np.nan
    assert made == same


@pytest.mark.parametrize(
    "name", [n for n in VALUES if n not in ("dual quaternions", "rigid samples", "basis", "orientation keys")]
)
def test_what_is_saved_is_loaded_bit_for_bit(name, tmp_path):
    value = VALUES[name]
    path = tmp_path / "value.json"
    if name == "keyframes":
        save(value, path)
    else:
        value.save(path)
    again = cast(Any, load(path))  # one of many classes
    assert type(again) is type(value)
    assert again == value
    if name in MOTIONS:
        t = inside(value)
        np.testing.assert_array_equal(again.matrix(t, 1), value.matrix(t, 1))


def test_a_bad_shape_among_positions_is_refused():
    with pytest.raises(sm.InputError, match=re.escape("positions of shape (4, 5)")):
        as_keyframes(np.arange(4.0), np.zeros((4, 5)))
