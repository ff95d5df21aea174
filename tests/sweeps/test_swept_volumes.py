"""Swept volumes: closed forms, theorems about winding numbers, and what bad input gets."""

from functools import cache
from typing import Any, cast

import numpy as np
import pytest
from sweeping import GOES, LINE, SKEW, scaling, sliding, wild

from studies.sweeps.swept_motions import Circle
from symmotion.bodies import Mesh
from symmotion.errors import InputError
from symmotion.motions import AffineMotion, PoseMotion
from symmotion.motions.quaternions import interpolate_quaternions
from symmotion.splines import BSplineBasis, cubic_interpolant
from symmotion.sweeps import MovingEllipsoid, swept_volume
from symmotion.sweeps.marching import sphere

BALL = 4 / 3 * np.pi


def winding(mesh: Mesh, points: np.ndarray) -> np.ndarray:
    """How often a closed mesh goes round points (P, 3): solid angles over 4π (van Oosterom and Strackee 1983)."""
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] - points[:, None] for k in range(3))
    x, y, z = (np.linalg.norm(v, axis=2) for v in (a, b, c))
    top = np.einsum("pfk,pfk->pf", a, np.cross(b, c))
    bottom = x * y * z + (a * b).sum(axis=2) * z + (b * c).sum(axis=2) * x + (c * a).sum(axis=2) * y
    return np.arctan2(top, bottom).sum(axis=1) / (2 * np.pi)


TRANSLATED = BALL * np.linalg.det(SKEW) + np.pi * np.linalg.det(SKEW) * np.linalg.norm(np.linalg.solve(SKEW, GOES))
ORACLES = {
    "translated ellipsoid": (MovingEllipsoid(sliding(SKEW)), TRANSLATED, None, 2),
    "capsule": (
        MovingEllipsoid(sliding(np.eye(3)), 0.5),
        BALL / 8 + np.pi * np.linalg.norm(GOES) / 4,
        np.pi + np.pi * np.linalg.norm(GOES),
        2,
    ),
    "torus": (MovingEllipsoid(Circle(2.0), 0.5), 2 * np.pi**2 * 2 * 0.25, 4 * np.pi**2, 0),
    "grown ball": (MovingEllipsoid(scaling(1, 2)), BALL * 8, 4 * np.pi * 4, 2),
}


@pytest.mark.parametrize(("body", "volume", "area", "euler"), ORACLES.values(), ids=ORACLES)
def test_closed_forms_are_reached_to_a_thousandth_with_the_second_order(body, volume, area, euler):
    errors = []
    for n in (6, 12, 24):
        swept = swept_volume(body, slices=4 * n, divisions=n)
        assert swept.mesh.closed
        assert swept.mesh.euler_characteristic == euler
        errors.append([1 - swept.volume / volume] + ([] if area is None else [swept.area / area - 1]))
    errors = np.abs(errors)
    assert errors[-1].max() < 1e-3
    orders = np.log2(errors[:-1] / errors[1:])
    assert (orders > 1.8).all() and (orders < 2.7).all()
    assert swept.overlap.value == 0


@pytest.mark.parametrize("name", ["translated ellipsoid", "torus"])
def test_the_implicit_method_reaches_the_closed_forms_too(name):
    body, volume, _, euler = ORACLES[name]
    errors = []
    for n in (8, 16, 32):
        swept = swept_volume(body, "implicit", slices=2 * n, divisions=n)
        assert swept.mesh.closed
        assert swept.mesh.euler_characteristic == euler
        errors.append(abs(1 - swept.volume / volume))
    assert errors[-1] < 3e-3
    assert np.log2(errors[0] / errors[2]) > 3.4


def test_a_path_through_a_spline_and_a_rigid_pose_are_motions_too():
    s = np.linspace(0, 2 * np.pi, 25)
    ring = cubic_interpolant(s, np.column_stack([2 * np.cos(s), 2 * np.sin(s), 0 * s]), "periodic")
    still = np.tile([1.0, 0, 0, 0], (2, 1))
    pose = PoseMotion(interpolate_quaternions(s[[0, -1]], still), ring)
    swept = swept_volume(MovingEllipsoid(pose, 0.5), slices=128, divisions=32)
    assert swept.closed
    assert swept.volume == pytest.approx(2 * np.pi**2 * 2 * 0.25, rel=1e-3)


@cache
def swept_wild(seed: int):
    return swept_volume(MovingEllipsoid(wild(seed), [1, 0.6, 0.8], [0.2, 0, 0.1]), slices=36, divisions=10)


WILD = (1, 2, 4, 5, 8, 11)


@pytest.mark.parametrize("seed", WILD)
def test_the_envelope_goes_round_a_point_as_often_as_the_body_visits_it(seed):
    swept = swept_wild(seed)
    assert swept.mesh.closed
    low, high = swept.body.box(swept.times)
    points = low + (high - low) * np.random.default_rng(seed).random((80, 3))
    times = np.linspace(0, 1, 401)
    # Points so close to a position's surface that the mesh may pass them on the other side do not count.
    clear = (np.abs(swept.body.distances(points, times) - 1) > 0.02).all(axis=1)
    visits = swept.body.visits(points, times)
    clear |= visits == 0  # outside, however close
    found = winding(swept.mesh, points[clear])
    np.testing.assert_allclose(found, np.round(found), atol=1e-9)
    assert clear.sum() > 30
    assert np.mean(np.round(found) == visits[clear]) > 0.99


@pytest.mark.parametrize("seed", WILD[:3])
def test_the_volume_is_what_the_surface_passes_forwards(seed):
    # V(first) + ∫∫ max(g, 0) |det B| dσ dt, by Gauss in time and the weights of a fine sphere.
    swept = swept_wild(seed)
    nodes, faces = sphere(20)
    mesh = Mesh(nodes, faces)
    weights = np.bincount(faces.ravel(), np.repeat(np.linalg.norm(mesh.area_vectors, axis=1) / 3, 3))
    weights *= 4 * np.pi / weights.sum()
    x, w = np.polynomial.legendre.leggauss(20)
    flux = 0.0
    for t, weight in zip(np.r_[(x + 1) / 4, (x + 3) / 4], np.r_[w, w] / 4, strict=True):
        forwards = swept.body.surface_speed(t)(nodes).clip(0)
        flux += weight * abs(np.linalg.det(swept.body(t).matrix)) * (weights @ forwards)
    expected = BALL * np.linalg.det(swept.body(0.0).matrix) + flux
    assert swept.volume == pytest.approx(expected, rel=6e-3)


@pytest.mark.parametrize("seed", WILD[:3])
def test_overlap_is_what_the_envelope_counts_too_often(seed):
    swept = swept_wild(seed)
    implicit = swept_volume(swept.body, "implicit", slices=40, divisions=24)
    assert swept.overlap.value > 10 * swept.overlap.error
    assert swept.volume - swept.overlap.value == pytest.approx(implicit.volume, rel=0.01)
    assert swept.union.value == pytest.approx(implicit.volume, abs=0.01 * implicit.volume + 4 * swept.union.error)


def test_a_turn_and_a_quarter_overlaps_by_a_quarter():
    swept = swept_volume(MovingEllipsoid(Circle(2.0, 1.25), 0.5), slices=100, divisions=16)
    quarter = 2 * np.pi**2 * 2 * 0.25 / 4 + BALL / 8
    assert not swept.closed
    assert swept.overlap.value == pytest.approx(quarter, abs=4 * swept.overlap.error + 1e-3 * quarter)
    assert swept.union.value == pytest.approx(2 * np.pi**2 * 2 * 0.25, abs=4 * swept.union.error)
    assert "overlap" in repr(swept)


@pytest.mark.parametrize("degree", [1, 3], ids=["at full speed", "from rest to rest"])
def test_out_and_back_on_a_line_is_visited_twice(degree):
    places = {1: [0, 1, 0], 3: [0, 0, 1, 1, 1, 0, 0]}[degree]
    basis = BSplineBasis.clamped(np.linspace(0, 1, len(places) - degree + 1), degree)
    motion = AffineMotion(basis, np.tile(np.eye(3), (len(places), 1, 1)), np.outer(places, [4.0, 0, 0]))
    swept = swept_volume(MovingEllipsoid(motion), slices=80, divisions=16)
    reach = motion.translation[:, 0].max() if degree == 1 else motion(0.5).translation[0]
    assert not swept.closed
    assert swept.mesh.closed
    assert swept.overlap.value == pytest.approx(np.pi * reach, abs=4 * swept.overlap.error + 0.01 * np.pi * reach)
    assert swept.volume == pytest.approx(BALL + 2 * np.pi * reach, rel=5e-3)


def test_an_affine_map_of_space_maps_the_mesh():
    motion = wild(2)
    moved = AffineMotion(motion.basis, SKEW @ motion.linear, motion.translation @ SKEW.T + GOES)
    one, other = (swept_volume(MovingEllipsoid(m, [1, 0.6, 0.8]), slices=12, divisions=5).mesh for m in (motion, moved))
    np.testing.assert_array_equal(one.triangles, other.triangles)
    np.testing.assert_allclose(other.vertices, one.vertices @ SKEW.T + GOES, atol=1e-7)
    assert other.volume == pytest.approx(np.linalg.det(SKEW) * one.volume, rel=1e-8)


def test_a_shape_and_its_mirror_image_are_the_same_ellipsoid():
    motion, shape = wild(2), np.diag([1, 0.6, 0.8])
    for mirrored in (-shape, shape @ np.diag([1, 1, -1])):
        swept = swept_volume(MovingEllipsoid(motion, mirrored), slices=24, divisions=10)
        assert swept.volume == pytest.approx(
            swept_volume(MovingEllipsoid(motion, shape), slices=24, divisions=10).volume, rel=2e-3
        )


def test_the_way_back_sweeps_the_same():
    motion = wild(5)
    back = AffineMotion(motion.basis, motion.linear[::-1], motion.translation[::-1])
    one, other = (swept_volume(MovingEllipsoid(m, 0.8), slices=32, divisions=12) for m in (motion, back))
    assert one.volume == pytest.approx(other.volume, rel=3e-3)
    assert one.area == pytest.approx(other.area, rel=1e-2)


def test_growing_shrinking_and_both():
    n = 4 / 3 * np.pi * (1 - 1 / 300)
    for sizes, volume in (((1, 2), 8), ((2, 1), 8), ((1, 3, 1), 8), ((2, 0, 2), 8)):
        swept = swept_volume(MovingEllipsoid(scaling(*sizes)), slices=20, divisions=16)
        assert len(swept.without_curve) == (21 if len(sizes) == 2 else 20)
        assert swept.mesh.closed
        factor = 15 if sizes == (2, 0, 2) else volume  # from 2 to 1 and back to 2: all beyond 1 is visited twice
        assert swept.volume == pytest.approx(factor * n, rel=5e-3)
        assert swept.union.value == pytest.approx(volume * n, rel=0.01)


@pytest.mark.parametrize("pauses", ["start", "end", "both", "middle"])
def test_rest_changes_nothing(pauses):
    places = {"start": [0, 0, 0, 1], "end": [0, 1, 1, 1], "both": [0, 0, 1, 1], "middle": [0, 0.5, 0.5, 1]}[pauses]
    translation = np.outer(places, GOES)
    for degree in (3, 1):
        basis = BSplineBasis.clamped(np.linspace(0, 1, 5 - degree), degree)
        motion = AffineMotion(basis, np.tile(SKEW, (4, 1, 1)), translation)
        swept = swept_volume(MovingEllipsoid(motion), slices=30, divisions=16)
        assert swept.mesh.closed
        assert swept.mesh.euler_characteristic == 2
        assert swept.volume == pytest.approx(TRANSLATED, rel=3e-3)
        straight = swept_volume(MovingEllipsoid(sliding(SKEW)), slices=30, divisions=16)
        assert swept.area == pytest.approx(straight.area, rel=5e-3)


def test_a_body_that_does_not_move_and_a_ball_that_spins():
    still = swept_volume(MovingEllipsoid(sliding(SKEW, np.zeros(3))), divisions=16)
    assert still.volume == pytest.approx(BALL * np.linalg.det(SKEW), rel=3e-3)
    spinning = swept_volume(MovingEllipsoid(Circle(0.0), 1.5), divisions=16)
    assert spinning.volume == pytest.approx(BALL * 1.5**3, rel=3e-3)
    assert spinning.overlap.value == 0
    assert len(spinning.without_curve) == 0


@pytest.mark.parametrize(
    ("scale", "far", "span"), [(1, 1e6, (1.7e9, 1.7e9 + 1)), (1e-6, 0, (0, 1e9)), (1e6, 0, (-1e-6, 0.1))]
)
def test_units_of_length_and_time_and_the_origin_do_not_matter(scale, far, span):
    motion, (a, b) = wild(2), span
    basis = BSplineBasis(a + (b - a) * motion.basis.knots, 3)
    other = AffineMotion(basis, scale * motion.linear, far + scale * motion.translation)
    sizes: dict[str, Any] = {"slices": 12, "divisions": 5, "samples": 2**10}
    one, same = (swept_volume(MovingEllipsoid(m, [1, 0.6, 0.8]), **sizes) for m in (motion, other))
    assert same.mesh.closed
    assert same.volume == pytest.approx(scale**3 * one.volume, rel=1e-6)
    assert same.area == pytest.approx(scale**2 * one.area, rel=1e-6)
    assert same.overlap.value == pytest.approx(scale**3 * one.overlap.value, rel=0.01)


flat = AffineMotion(LINE, np.array([np.eye(3), np.diag([1.0, 1, 0])]))
turned = AffineMotion(LINE, np.array([np.eye(3), np.diag([1.0, 1, -1])]))
jumping = AffineMotion(
    BSplineBasis([0, 0, 0.5, 0.5, 1, 1], 1), np.tile(np.eye(3), (4, 1, 1)), np.outer([0, 1, 5, 6], [1.0, 0, 0])
)
planar = AffineMotion(LINE, np.tile(np.eye(2), (2, 1, 1)))
UP = sliding(np.eye(3), [0, 0, 1.0])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: MovingEllipsoid(planar), "an ellipsoid moves in space"),
        (lambda: MovingEllipsoid(cast(Any, Circle(1.0).__call__)), "a method: an ellipsoid moves in space"),
        (
            lambda: MovingEllipsoid(cast(Any, interpolate_quaternions([0, 1], np.eye(4)[[0, 0]]))),
            "a QuaternionMotion: an ellipsoid",
        ),
        (lambda: MovingEllipsoid(UP, [1, 2]), r"a radius, semi-axes \(3,\)"),
        (lambda: MovingEllipsoid(UP, [1, 2, -1]), "positive ones are needed"),
        (lambda: MovingEllipsoid(UP, [1, 2, np.nan]), "positive ones are needed"),
        (lambda: MovingEllipsoid(UP, [1, 2, np.inf]), "flat or not finite"),
        (lambda: MovingEllipsoid(UP, np.ones((3, 3))), "flat or not finite"),
        (lambda: MovingEllipsoid(UP, 1.0, [0, 0]), "three finite coordinates"),
        (lambda: swept_volume(MovingEllipsoid(flat)), "flattens the ellipsoid at time 1"),
        (lambda: swept_volume(MovingEllipsoid(turned), slices=5), "inside out, through a flat one, at time 0.6"),
        (lambda: swept_volume(MovingEllipsoid(jumping)), "the motion jumps at time 0.5: sweep the parts"),
        (lambda: swept_volume(MovingEllipsoid(UP), "hull"), "method 'hull' is unknown; there are envelope, implicit"),  # type: ignore
        (lambda: swept_volume(MovingEllipsoid(UP), slices=2), "slices 2: a whole number, 3 or more"),
        (lambda: swept_volume(MovingEllipsoid(UP), divisions=0), "divisions 0: a whole number, 1 or more"),
        (lambda: swept_volume(MovingEllipsoid(UP), samples=2), "samples 2: a whole number, 8 or more"),
    ],
)
def test_bad_input_names_the_culprit(make, message):
    with pytest.raises(InputError, match=message):
        make()
