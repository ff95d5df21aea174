"""Motions made of motions: against closed forms, differences and the motions that they are made of."""

from typing import Any, cast

import numpy as np
import pytest
from movements import MOTIONS, PATH

import symmotion as sm
from symmotion.curves import ArcParameter, arc_length, slow_in_out, speed
from symmotion.errors import InputError
from symmotion.motions import PointPath, RelativeMotion, RetimedMotion, concatenate, part, reverse
from symmotion.motions.derived import matrices_of

ALL = pytest.mark.parametrize("name", MOTIONS)
AFFINE = MOTIONS["affine"]


class Sliding:
    """A motion of one's own, x ↦ (t², 0) + x."""

    domain = (0.0, 2.0)

    def __call__(self, t, nu=0):
        t = np.asarray(t, dtype=float)
        linear = np.broadcast_to(np.eye(2) * (nu == 0), (*t.shape, 2, 2))
        x = (t**2, 2 * t, 2 + 0 * t)[nu]
        return sm.Affine(linear, np.stack([x, 0 * t], axis=-1))


@ALL
def test_parts_and_reversals_are_where_the_motion_is(name):
    motion = MOTIONS[name]
    a, b = motion.domain
    c, d = a + 0.2 * (b - a), a + 0.7 * (b - a)
    t = np.linspace(c, d, 9)
    for nu in range(3):
        wanted = motion.matrix(t, nu)
        size = np.abs(wanted).max() + 1
        np.testing.assert_allclose(part(motion, c, d).matrix(t, nu), wanted, atol=1e-12 * size)
        np.testing.assert_allclose(reverse(motion).matrix(a + b - t, nu), (-1) ** nu * wanted, atol=1e-11 * size)
    assert part(motion, c, d).domain == (c, d) and reverse(motion).domain == (a, b)
    assert (
        type(part(motion, c, d))
        is type(reverse(motion))
        is (sm.AffineMotion if isinstance(motion, sm.AffineMotion) else RetimedMotion)
    )


@pytest.mark.parametrize(
    "basis",
    [
        sm.splines.BSplineBasis([0, 1, 2, 3, 4, 5.5, 6, 8, 9, 9.5], 3),
        sm.splines.BSplineBasis.clamped([1.4e9, 1.4e9 + 1, 1.4e9 + 3, 1.4e9 + 4], 2),
        sm.splines.BSplineBasis.closed([0.0, 0.3, 0.9, 1.4, 2.0], 3),
        sm.splines.BSplineBasis([0, 0, 1, 1, 2, 2], 1),
    ],
    ids=["not clamped", "far", "periodic", "jumps"],
)
def test_parts_and_reversals_of_splines(basis):
    spline = sm.splines.Spline(basis, np.random.default_rng(1).normal(size=(basis.n, 2)))
    a, b = spline.domain
    for c, d in ((a, b), (a + 0.3 * (b - a), a + 0.4 * (b - a)), (spline.breakpoints[1], b)):
        piece, t = spline.part(c, d), c + (d - c) * np.array([0.01, 0.3, 0.77, 0.99])
        np.testing.assert_allclose(piece.domain, (c, d), rtol=1e-15)
        np.testing.assert_allclose(piece(t), spline(t), atol=1e-6 if a > 1e6 else 1e-13)
    t = a + (b - a) * np.array([0.013, 0.31, 0.77, 0.99])
    np.testing.assert_allclose(spline.reversed()(a + b - t), spline(t), atol=1e-6 if a > 1e6 else 1e-12)
    with pytest.raises(InputError, match="part from"):
        spline.part(b, a)


def test_other_times_by_the_chain_rule():
    warp = slow_in_out(domain=(0.0, 3.0), values=(0.2, 1.7))
    motion, t = RetimedMotion(AFFINE, warp), np.array([0.1, 1.2, 2.9])
    w, dw, ddw = (warp(t, k)[:, None, None] for k in range(3))
    x, dx, ddx = (AFFINE.matrix(w[:, 0, 0], k) for k in range(3))
    np.testing.assert_allclose(motion.matrix(t), x)
    np.testing.assert_allclose(motion.matrix(t, 1), dx * dw)
    np.testing.assert_allclose(motion.matrix(t, 2), ddx * dw**2 + dx * ddw, atol=1e-12)
    inner = AFFINE.breakpoints[1:-1]
    np.testing.assert_allclose(np.isin(motion.breakpoints, warp.breakpoints).sum(), len(warp.breakpoints))
    assert all(np.abs(warp(motion.breakpoints) - at).min() < 1e-12 for at in inner)


def test_one_after_the_other():
    names = ["pose", "squad", "affine"]
    motions = [MOTIONS[name] for name in names]
    whole, lengths = concatenate(motions), [b - a for a, b in (m.domain for m in motions)]
    assert whole.domain == pytest.approx((motions[0].domain[0], motions[0].domain[0] + sum(lengths)))
    for k, motion in enumerate(motions):
        share = np.array([0.0, 0.4, 0.9])
        for nu in range(3):
            at = whole.ends[k] + share * lengths[k]
            np.testing.assert_allclose(
                whole.matrix(at, nu), motion.matrix(motion.domain[0] + share * lengths[k], nu), atol=1e-11
            )
    np.testing.assert_allclose(whole.matrix(whole.domain[1]), motions[-1].matrix(motions[-1].domain[1]))
    there_and_back = concatenate([AFFINE, reverse(AFFINE)])
    np.testing.assert_allclose(there_and_back.matrix(4.0), AFFINE.matrix(0.0), atol=1e-14)


def test_as_seen_from_another():
    seen, h = MOTIONS["seen from another"], 1e-4
    moving, frame = MOTIONS["affine"], MOTIONS["polar, slerp"]
    t = np.array([0.15, 0.5, 1.3, 1.8])
    np.testing.assert_allclose(frame.matrix(t) @ seen.matrix(t), moving.matrix(t), atol=1e-12)
    for nu in (1, 2):
        difference = (seen.matrix(t + h, nu - 1) - seen.matrix(t - h, nu - 1)) / (2 * h)
        np.testing.assert_allclose(seen.matrix(t, nu), difference, rtol=1e-5, atol=1e-5 * np.abs(difference).max())
    np.testing.assert_allclose(RelativeMotion(moving, moving).matrix(t), np.tile(np.eye(4), (4, 1, 1)), atol=1e-12)


@ALL
def test_paths_of_points_are_curves(name):
    motion = MOTIONS[name]
    point = np.array([0.3, -0.2, 0.5])[: motion.dimension]
    (a, b), path = motion.domain, PointPath(motion, point)
    t = np.linspace(a, b, 7)[1:-1]
    np.testing.assert_allclose(path(t, 1), motion.trajectory(point, t, 1)[:, 0], atol=1e-12)
    np.testing.assert_allclose(speed(path, t), np.linalg.norm(motion.trajectory(point, t, 1)[:, 0], axis=1))


def test_a_path_of_an_affine_motion_is_a_spline():
    path, t = PointPath(AFFINE, [0.1, 0.2, 0.3]), np.linspace(0, 2, 11)
    np.testing.assert_allclose(path.to_bspline()(t, 1), path(t, 1), atol=1e-13)
    with pytest.raises(InputError, match="the path of a point of a PoseMotion is no polynomial spline"):
        PointPath(MOTIONS["pose"], [0, 0, 0]).to_bspline()


def test_arc_length_and_constant_speed_of_a_point():
    keys = sm.Keyframes([0.0, 1.0, 4.0], np.tile(np.eye(3), (3, 1, 1)), PATH(np.array([0.0, 1.0, 3.0])))
    motion = sm.interpolants.component_cubic(keys)
    path = PointPath(motion, [1.0, 2.0, 3.0])
    assert arc_length(path) == pytest.approx(
        arc_length(sm.splines.cubic_interpolant(keys.times, keys.translation)), rel=1e-10
    )
    steady = RetimedMotion(motion, ArcParameter(path, (0.0, 2.0)))
    t = np.linspace(0.05, 1.95, 12)
    rates = np.linalg.norm(steady.trajectory([1.0, 2.0, 3.0], t, 1)[:, 0], axis=1)
    np.testing.assert_allclose(rates, arc_length(path) / 2, rtol=1e-8)


def test_motions_of_ones_own():
    both = concatenate([Sliding(), reverse(Sliding())])
    np.testing.assert_allclose(both([1.0, 3.0]).translation, [[1, 0], [1, 0]])
    np.testing.assert_allclose(both([1.0, 3.0], 1).translation, [[2, 0], [-2, 0]])
    assert arc_length(PointPath(Sliding(), [0, 0])) == pytest.approx(4)
    np.testing.assert_allclose(matrices_of(Sliding(), np.array([1.0]), 1)[0], [[0, 0, 2], [0, 0, 0], [0, 0, 0]])
    with pytest.raises(InputError, match="cannot be saved"):
        both.save("both.json")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: part(AFFINE, 1.0, 0.5), r"part from 1 to 0.5: both in \[0, 2\], in this order"),
        (lambda: part(AFFINE, 0.0, 2.5), "part from 0 to 2.5"),
        (lambda: part(MOTIONS["squad"], np.nan, 1.0), "start nan"),
        (lambda: part(3, 0.0, 1.0), "a int is no motion"),
        (lambda: reverse(3), "a int is no motion"),
        (lambda: concatenate(cast(Any, AFFINE)), "motions of type AffineMotion: a list of motions is needed"),
        (lambda: concatenate([]), "no motions: one or more"),
        (lambda: concatenate([AFFINE, MOTIONS["affine in the plane"]]), "in the plane and in space do not follow"),
        (lambda: concatenate([AFFINE, 3]), "a int is no motion"),
        (lambda: RelativeMotion(AFFINE, MOTIONS["affine in the plane"]), "are not seen from each other"),
        (lambda: RelativeMotion(AFFINE, RetimedMotion(AFFINE, slow_in_out(domain=(5.0, 6.0)))), "no time in common"),
        (lambda: RetimedMotion(AFFINE, slow_in_out(values=(0.0, 3.0))), "the warp leads from 0 to 3, out of"),
        (lambda: RetimedMotion(AFFINE, PATH), "a time warp must be a curve of scalars"),
        (lambda: reverse(MOTIONS["squad"])(9.0), "parameter 9 is outside the domain"),
        (lambda: PointPath(AFFINE, [1.0, 2.0]), r"point of shape \(2,\)"),
        (lambda: RelativeMotion(AFFINE, sm.AffineMotion(AFFINE.basis, 0 * AFFINE.linear))(1.0), "singular at time 1"),
        (lambda: sm.splines.cubic_interpolant([0, 1, 2], [0, np.nan, 1]), "the value of key 1 is not finite"),
    ],
)  # fmt: skip
def test_what_cannot_be(call, message):
    with pytest.raises(InputError, match=message):
        call()
