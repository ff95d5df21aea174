"""Sweep surfaces: exact control nets, normals, and meshes that trimesh measures."""

import numpy as np
import pytest
import trimesh
from scipy.interpolate import NdBSpline
from scipy.spatial.transform import Rotation
from sweeping import LINE, scaling, sliding, wild

from symmotion.errors import InputError
from symmotion.motions import AffineMotion
from symmotion.splines import BSplineBasis, Spline, cubic_interpolant
from symmotion.sweeps import SweepSurface, sweep_surface

PROFILES = {
    "open": Spline(BSplineBasis.clamped([0, 1, 3], 2), np.random.default_rng(1).normal(size=(4, 3))),
    "periodic": Spline(BSplineBasis.closed(np.arange(7.0), 3), np.random.default_rng(2).normal(size=(6, 3))),
}


def circle(points: int = 24, radius: float = 1.0, height: float = 0.0) -> Spline:
    s = np.linspace(0, 2 * np.pi, points + 1)
    ring = np.column_stack([radius * np.cos(s), radius * np.sin(s), np.full_like(s, height)])
    return cubic_interpolant(s, ring, "periodic")


@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES)
@pytest.mark.parametrize("order", [(0, 0), (1, 0), (0, 1), (1, 1), (2, 1), (0, 4)])
def test_a_sweep_surface_is_its_motion_applied_to_its_profile(profile, order):
    motion = wild(3)
    surface = sweep_surface(motion, profile)
    a, b = profile.domain
    u = np.linspace(a, b, 9)[:, None]
    t = np.linspace(0, 1, 13)
    linear, translation = motion(t, order[1])
    expected = np.einsum("tij,uj->uti", linear, profile(u[:, 0], order[0]))
    if order[0] == 0:
        expected += translation
    np.testing.assert_allclose(surface(u, t, order), expected, atol=1e-12 * max(1, np.abs(expected).max()))


def test_a_sweep_surface_equals_a_tensor_product_by_scipy():
    motion, profile = wild(4), PROFILES["open"]
    surface = sweep_surface(motion, profile)
    theirs = NdBSpline((surface.u.knots, surface.t.knots), surface.control_points, (2, 3))
    x = np.random.default_rng(0).random((50, 2)) * [3, 1]
    np.testing.assert_allclose(surface(x[:, 0], x[:, 1]), theirs(x), atol=1e-13)
    np.testing.assert_allclose(surface(3.0, 1.0), surface.control_points[-1, -1], atol=1e-13)


def test_planar_sweeps_have_values_and_no_mesh():
    motion = AffineMotion(LINE, np.array([np.eye(2), 2 * np.eye(2)]), np.array([[0.0, 0], [5, 1]]))
    surface = sweep_surface(motion, Spline(LINE, np.array([[0.0, 1], [1, 1]])))
    np.testing.assert_allclose(surface(0.5, 0.5), [3.25, 2.0], atol=1e-14)
    for make in (surface.mesh, lambda: surface.normals(0.5, 0.5)):
        with pytest.raises(InputError, match="in the plane"):
            make()


def test_normals_are_those_of_a_cone():
    motion = AffineMotion(LINE, np.array([np.eye(3), np.diag([2.0, 2, 1])]), np.array([[0, 0, 0], [0, 0, 1.0]]))
    surface = sweep_surface(motion, circle(64))
    u = np.linspace(0, 6, 11)
    expected = np.column_stack([np.cos(u), np.sin(u), -np.ones(11)]) / np.sqrt(2)
    np.testing.assert_allclose(surface.normals(u, 0.5), expected, atol=1e-5)
    point = sweep_surface(scaling(0, 1), circle())
    assert np.isnan(point.normals(1.0, 0.0)).all()


@pytest.mark.parametrize("seed", range(3))
def test_capped_tubes_are_closed_and_as_big_as_trimesh_says(seed):
    mesh = sweep_surface(wild(seed, 0.1, 0.1), circle(8, 0.3)).mesh(24, 20, caps=True)
    theirs = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    assert theirs.is_watertight
    assert theirs.is_winding_consistent
    assert mesh.euler_characteristic == 2
    assert theirs.volume == pytest.approx(mesh.volume, rel=1e-12)
    assert mesh.volume > 0


def test_a_frustum_has_the_volume_of_its_polygons():
    motion = AffineMotion(LINE, np.array([np.eye(3), np.diag([2.0, 2, 1])]), np.array([[0, 0, 0], [0, 0, 3.0]]))
    surface, n = sweep_surface(motion, circle(48)), 96
    mesh = surface.mesh(n, 5, caps=True)
    ring = surface(np.linspace(*surface.u.domain, n + 1), 0.0)[:-1]
    base = 0.5 * np.cross(ring, np.roll(ring, -1, axis=0))[:, 2].sum()
    # Chords of straight rulings: the solid between two similar polygons, but for the twist of its side's triangles.
    assert mesh.volume == pytest.approx(3 * base * (1 + 2 + 4) / 3, rel=1e-3)
    assert mesh.closed
    bare = surface.mesh(n, 5)
    assert len(bare.boundary_edges) == 2 * n
    assert bare.area < mesh.area


@pytest.mark.parametrize("far", [1e6, 1e9])
def test_closed_profiles_are_closed_far_from_the_origin(far):
    small = AffineMotion(LINE, 1e-3 * np.array([np.eye(3), np.eye(3)]), far + np.array([[0, 0, 0], [0, 0, 1e-3]]))
    assert sweep_surface(small, circle()).mesh(24, 4, caps=True).closed


def test_a_point_at_an_end_needs_no_cap_and_a_closed_motion_has_no_ends():
    cone = sweep_surface(AffineMotion(LINE, np.array([0 * np.eye(3), np.eye(3)]), [[0, 0, 0], [0, 0, 2.0]]), circle(48))
    mesh = cone.mesh(64, 8, caps=True)
    assert mesh.closed
    assert mesh.euler_characteristic == 2
    assert mesh.volume == pytest.approx(2 * np.pi / 3, rel=5e-3)
    s = np.linspace(0, 2 * np.pi, 13)
    turns = Rotation.from_rotvec(np.outer(s, [0, 0, 1])).as_matrix().reshape(13, 9)
    round_ = AffineMotion.from_spline(cubic_interpolant(s, np.column_stack([turns, np.zeros((13, 3))]), "periodic"), 3)
    upright = Spline(circle().basis, circle(24, 0.5).control_points[:, [0, 2, 1]] + [2, 0, 0])
    torus = sweep_surface(round_, upright).mesh(64, 96, caps=True)
    assert torus.closed
    assert torus.euler_characteristic == 0
    assert torus.volume == pytest.approx(2 * np.pi**2 * 2 * 0.25, rel=5e-3)


planar = AffineMotion(LINE, np.tile(np.eye(2), (2, 1, 1)))
star = Spline(
    BSplineBasis.clamped(np.arange(6.0), 1),
    np.array([[0, 0, 0], [4, 0, 0], [4, 4, 0], [3.9, 0.1, 0], [0, 0.1, 0], [0, 0, 0]]),
)
UP = sliding(np.eye(3), [0, 0, 1.0])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sweep_surface(UP, Spline(LINE, np.zeros((2, 2)))), r"in 3D: points \(3,\) are needed; append a zero"),
        (lambda: sweep_surface(planar, Spline(LINE, np.zeros((2, 3)))), r"in 2D: points \(2,\)"),
        (lambda: SweepSurface(LINE, LINE, np.zeros((2, 3, 3))), r"\(2, 3, 3\): \(2, 2, 2 or 3\)"),
        (lambda: SweepSurface(LINE, LINE, np.full((2, 2, 3), np.inf)), r"control point \(0, 0\) of the net"),
        (lambda: sweep_surface(UP, circle())(7.0, 0.5), "u: parameter 7 is outside"),
        (lambda: sweep_surface(UP, circle())(1.0, [0.5, 2.0]), "t: parameter 2 is outside"),
        (lambda: sweep_surface(UP, circle())(1.0, 0.5, (0, -1)), "derivative orders"),
        (lambda: sweep_surface(UP, circle()).mesh(2, 1), "2 × 1 pieces are too few"),
        (lambda: sweep_surface(UP, PROFILES["open"]).mesh(caps=True), "caps close the ends of closed profiles"),
        (lambda: sweep_surface(UP, star).mesh(5, 2, caps=True), "section at time 0 is not star-shaped"),
    ],
)
def test_bad_input_names_the_culprit(make, message):
    with pytest.raises(InputError, match=message):
        make()
