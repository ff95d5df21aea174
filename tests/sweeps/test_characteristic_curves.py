"""Characteristic curves: on the quadric, as many as there are, none where the whole surface goes one way."""

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from sweeping import GOES, LINE, SKEW, scaling, sliding, wild

from symmotion.errors import InputError
from symmotion.motions import AffineMotion
from symmotion.sweeps import MovingEllipsoid, characteristic_curves
from symmotion.sweeps.characteristic import surface_speed_range
from symmotion.sweeps.ellipsoid import SurfaceSpeed
from symmotion.sweeps.marching import sphere


def components(form: SurfaceSpeed) -> int:
    """How many loops g = 0 has on the sphere, counted as regions between them on a fine triangulation."""
    nodes, faces = sphere(24)
    positive = form(nodes) >= 0
    edges = np.concatenate([faces[:, [i, (i + 1) % 3]] for i in range(3)])
    edges = edges[positive[edges[:, 0]] == positive[edges[:, 1]]]
    graph = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(len(nodes),) * 2)
    return connected_components(graph)[0] - 1


@pytest.mark.parametrize("travel", [0.05, 0.4, 2.0])
def test_characteristic_curves_are_where_the_surface_glides(travel):
    found = []
    for seed in range(12):
        body = MovingEllipsoid(wild(seed, 0.2, travel), [1, 0.6, 0.8], [0.2, 0, 0.1])
        form = body.surface_speed(0.3)
        curves = characteristic_curves(body, 0.3, 60)
        assert len(curves) == components(form)
        found.append(len(curves))
        for curve in curves:
            size = np.abs([surface_speed_range(body, 0.3)]).max()
            assert np.abs(form(curve.sphere)).max() < 1e-13 * size
            np.testing.assert_allclose(np.linalg.norm(curve.sphere, axis=1), 1, rtol=1e-14)
            steps = np.linalg.norm(curve.sphere - np.roll(curve.sphere, 1, axis=0), axis=1)
            assert steps.max() < 0.35
            # HJK's own condition, with the translation: det(x_t, x_u, x_v) = 0 at x = w + B s.
            matrix, centre = body(0.3, 1)
            across = np.cross(curve.sphere, [0.3, 0.5, 0.8])
            along = np.cross(curve.sphere, across)
            now = body(0.3).matrix
            tangents = np.stack([centre + curve.sphere @ matrix.T, across @ now.T, along @ now.T], axis=1)
            assert np.abs(np.linalg.det(tangents)).max() < 1e-12 * size
    assert set(found) - {0} >= ({1, 2} if travel < 1 else {1})


def test_a_translated_ellipsoid_glides_along_a_plane_section():
    (curve,) = characteristic_curves(MovingEllipsoid(sliding(SKEW)), 0.4)
    normal = np.linalg.solve(SKEW, GOES)
    assert np.abs(curve.sphere @ normal).max() < 1e-14 * 10
    length = np.linalg.norm(curve.sphere - np.roll(curve.sphere, 1, axis=0), axis=1).sum()
    assert length == pytest.approx(2 * np.pi, rel=1e-3)


def test_where_all_of_the_surface_goes_one_way_there_is_no_curve():
    for motion in (scaling(1, 2), scaling(2, 1)):
        assert characteristic_curves(MovingEllipsoid(motion), 0.5) == ()
    # A ball that grows at a rate of 1 outruns its centre at speeds below 1, and not above.
    for speed, loops in ((0.9, 0), (1.1, 1)):
        motion = AffineMotion(LINE, np.array([np.eye(3), 2 * np.eye(3)]), [[0, 0, 0], [speed, 0, 0]])
        curves = characteristic_curves(MovingEllipsoid(motion), 0.5)
        assert len(curves) == loops
    np.testing.assert_allclose(curves[0].sphere[:, 0], -1 / 1.1, atol=1e-14)


@pytest.mark.parametrize("seed", range(4))
def test_the_range_of_the_surface_speed_bounds_it_and_is_reached(seed):
    rng = np.random.default_rng(seed)
    motion = wild(seed, 0.3, rng.choice([0.0, 1e-12, 0.3, 3.0]))
    body, times = MovingEllipsoid(motion), np.linspace(0, 1, 7)
    least, greatest = surface_speed_range(body, times)
    form = body.surface_speed(times)
    values = np.array([SurfaceSpeed(h, b)(sphere(40)[0]) for h, b in zip(*form, strict=True)])
    spread = greatest - least
    assert (least <= values.min(axis=1) + 1e-12 * spread).all()
    assert (greatest >= values.max(axis=1) - 1e-12 * spread).all()
    np.testing.assert_allclose(values.min(axis=1), least, atol=3e-3 * spread.max())
    np.testing.assert_allclose(values.max(axis=1), greatest, atol=3e-3 * spread.max())


flat = AffineMotion(LINE, np.array([np.eye(3), np.diag([1.0, 1, 0])]))
UP = sliding(np.eye(3), [0, 0, 1.0])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: characteristic_curves(MovingEllipsoid(flat), 1.0), "flattens the ellipsoid at time 1"),
        (lambda: characteristic_curves(MovingEllipsoid(UP), 2.0), "parameter 2 is outside"),
        (lambda: characteristic_curves(MovingEllipsoid(UP), 0.5, 4), "4 meridians are too few"),
    ],
)
def test_bad_input_names_the_culprit(make, message):
    with pytest.raises(InputError, match=message):
        make()
