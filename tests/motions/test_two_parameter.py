import json
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import BSpline
from scipy.spatial.transform import Rotation

import symmotion as sm
from symmotion.files import read_two_parameter, write_two_parameter
from symmotion.motions.dual import DualQuaternions
from symmotion.motions.nets import noisy_net, smooth_net
from symmotion.motions.two_parameter import TwoParameterMotion
from symmotion.splines import BSplineBasis, Spline

POINTS = np.array([[1.0, -2.0, 0.5], [0.0, 0.0, 0.0], [0.3, 0.2, 2.0]])
SPATIAL = noisy_net(smooth_net(9, 8, spatial=True, knots="clamped"), 0.03, translation=0.2, seed=1)
SPHERICAL = noisy_net(smooth_net(8), 0.05, seed=2)
# For input that the type checker would not let through.
spatial: Any = SPATIAL
net: Any = smooth_net
MOTIONS = {"spatial, clamped": SPATIAL, "spherical, uniform": SPHERICAL}


def inside(motion, count=7, margin=0.03):
    (a, b), (c, d) = motion.domain
    x = np.linspace(margin, 0.961, count)  # off the knots, where third derivatives jump
    return a + (b - a) * x[:, None], c + (d - c) * x**1.1


@pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS)
def test_positions_are_rotations_and_equal_a_tensor_product_by_scipy(motion):
    u, v = inside(motion)
    linear, translation = motion(u, v)
    np.testing.assert_allclose(
        np.swapaxes(linear, -1, -2) @ linear, np.broadcast_to(np.eye(3), linear.shape), atol=1e-13
    )
    by_u = BSpline(motion.u.knots, motion.real, 3)(u[:, 0])
    real = np.moveaxis(BSpline(motion.v.knots, np.moveaxis(by_u, 1, 0), 3)(v), 0, 1)
    expected = Rotation.from_quat(real[..., [1, 2, 3, 0]].reshape(-1, 4)).as_matrix()
    np.testing.assert_allclose(linear.reshape(-1, 3, 3), expected, atol=1e-13)
    if motion.spherical:
        assert not translation.any()


@pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS)
@pytest.mark.parametrize("order", [(1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (2, 1)])
def test_partial_derivatives_against_differences(motion, order):
    u, v = inside(motion)
    step = 1e-5
    lower, move = (order[0] - 1, order[1]), np.array([step, 0])
    if order[0] == 0:
        lower, move = (0, order[1] - 1), np.array([0, step])
    for function in (lambda u, v, nu: motion.trajectory(POINTS, u, v, nu), motion.rodrigues, motion.dual_image):
        forward, backward = (function(u + s * move[0], v + s * move[1], lower) for s in (1, -1))
        found = function(u, v, order)
        np.testing.assert_allclose(found, (forward - backward) / (2 * step), atol=2e-8 * max(1, np.abs(found).max()))


def test_control_scale_does_not_matter_and_their_signs_are_found():
    signs = np.random.default_rng(0).choice([-1.0, 1.0], size=(9, 8, 1))
    again = TwoParameterMotion.from_displacements(
        DualQuaternions.of(SPATIAL.real * signs, np.asarray(SPATIAL.dual) * signs), SPATIAL.u, SPATIAL.v
    )
    doubled = SPATIAL.with_controls(3 * SPATIAL.real, 3 * np.asarray(SPATIAL.dual))
    u, v = inside(SPATIAL)
    for other in (again, doubled):
        np.testing.assert_allclose(other.trajectory(POINTS, u, v), SPATIAL.trajectory(POINTS, u, v), atol=1e-12)
        np.testing.assert_allclose(np.abs(other.rodrigues(u, v)), np.abs(SPATIAL.rodrigues(u, v)), atol=1e-12)


def test_trajectory_surfaces_do_not_depend_on_the_frames():
    fixed = DualQuaternions.from_rotations(Rotation.random(random_state=1), [4.0, -2.0, 1.0])
    moving = DualQuaternions.from_rotations(Rotation.random(random_state=2), [0.5, 1.0, -3.0])
    seen = SPATIAL.seen_from(fixed, moving)
    u, v = inside(SPATIAL)
    (f, d), (m, e) = fixed.matrices, moving.matrices
    np.testing.assert_allclose(
        seen.trajectory(POINTS @ m.T + e, u, v), SPATIAL.trajectory(POINTS, u, v) @ f.T + d, atol=1e-11
    )
    turned = SPHERICAL.seen_from(DualQuaternions.from_rotations(Rotation.random(random_state=3)))
    assert turned.spherical


def test_boundary_motions_are_those_of_the_boundary_controls_of_clamped_knots():
    rows = {"u0": SPATIAL.real[0], "u1": SPATIAL.real[-1], "v0": SPATIAL.real[:, 0], "v1": SPATIAL.real[:, -1]}
    for side, controls in rows.items():
        boundary = spatial.boundary(side)
        np.testing.assert_allclose(boundary.real, controls, atol=1e-14)
        t = np.linspace(boundary.domain[0], boundary.domain[1], 9)
        fixed = spatial.domain["uv".index(side[0])][int(side[1])]
        u, v = (fixed, t) if side[0] == "u" else (t, fixed)
        np.testing.assert_allclose(boundary.trajectory(POINTS, t), SPATIAL.trajectory(POINTS, u, v), atol=1e-12)
    corner = SPATIAL(SPATIAL.domain[0][1], SPATIAL.domain[1][0])
    last = SPATIAL.control_displacements.matrices
    np.testing.assert_allclose(corner.linear, last.linear[-1, 0], atol=1e-13)
    np.testing.assert_allclose(corner.translation, last.translation[-1, 0], atol=1e-12)


@pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS)
def test_one_parameter_motions_by_lines_and_by_curves(motion):
    (a, b), (c, d) = motion.domain
    u0 = 0.3 * a + 0.7 * b
    iso = motion.isoparametric(u=u0)
    t = np.linspace(c, d, 11)
    np.testing.assert_allclose(iso(t).linear, motion(u0, t).linear, atol=1e-13)
    np.testing.assert_allclose(iso.trajectory(POINTS, t, 2), motion.trajectory(POINTS, u0, t, (0, 2)), atol=1e-10)
    corners = np.array([[a, c], [b, c], [b, d], [a, 0.5 * (c + d)], [a, d]])
    along = motion.along(Spline(BSplineBasis.clamped(np.linspace(0, 2, 3), 3), corners))
    s = np.linspace(0.1, 1.9, 24)
    for nu in (1, 2):
        ahead, behind = (along.trajectory(POINTS, s + h, nu - 1) for h in (1e-5, -1e-5))
        found = along.trajectory(POINTS, s, nu)
        np.testing.assert_allclose(found, (ahead - behind) / 2e-5, atol=1e-7 * max(1, np.abs(found).max()))
    ends = along.trajectory(POINTS[0], [0.0, 2.0])
    np.testing.assert_allclose(ends, motion.trajectory(POINTS[0], [a, a], [c, d]), atol=1e-12)


def test_normals_of_a_spherical_trajectory_are_radial():
    u, v = inside(SPHERICAL)
    x = SPHERICAL.trajectory(POINTS[2], u, v)
    along, across = (SPHERICAL.trajectory(POINTS[2], u, v, nu) for nu in ((1, 0), (0, 1)))
    normal = np.cross(along, across)
    assert np.abs(np.cross(normal, x)).max() < 1e-12 * np.abs(normal).max() * 10


@pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS)
@pytest.mark.parametrize("name", ["net.json", "net.npz"])
def test_files_bring_a_motion_back_exactly(motion, name, tmp_path):
    write_two_parameter(motion, tmp_path / name)
    back = read_two_parameter(tmp_path / name)
    np.testing.assert_array_equal(back.real, motion.real)
    assert back.spherical == motion.spherical
    if not motion.spherical:
        np.testing.assert_array_equal(back.dual, motion.dual)
    for one, two in zip(back.bases, motion.bases, strict=True):
        np.testing.assert_array_equal(one.knots, two.knots)
        assert one.degree == two.degree


@pytest.mark.parametrize("name", ["net.json", "net.npz"])
def test_a_net_of_axes_angles_and_translations_is_read(name, tmp_path):
    vectors = Rotation.from_quat(SPATIAL.real.reshape(-1, 4)[:, [1, 2, 3, 0]]).as_rotvec().reshape(9, 8, 3)
    angle = np.linalg.norm(vectors, axis=-1)
    entries = {"axis": vectors, "angle": angle, "translation": SPATIAL.control_displacements.translation}
    entries |= {"knots_u": SPATIAL.u.knots, "knots_v": SPATIAL.v.knots}
    if name.endswith("json"):
        (tmp_path / name).write_text(json.dumps({k: v.tolist() for k, v in entries.items()}))
    else:
        np.savez(tmp_path / name, **entries)
    back = read_two_parameter(tmp_path / name)
    np.testing.assert_allclose(
        back.control_displacements.matrices.linear, SPATIAL.control_displacements.matrices.linear, atol=1e-13
    )
    np.testing.assert_allclose(back.control_displacements.translation, entries["translation"], atol=1e-12)


def document(**changes):
    entries = {"symmotion": "two-parameter-motion", "version": 1, "degree": [3, 3]}
    entries |= {"knots_u": SPHERICAL.u.knots.tolist(), "knots_v": SPHERICAL.v.knots.tolist()}
    entries |= {"real": SPHERICAL.real.tolist()} | changes
    return json.dumps({k: v for k, v in entries.items() if v is not None})


def test_json_has_one_written_form_and_its_first_one_is_read(tmp_path):
    write_two_parameter(SPHERICAL, tmp_path / "written.json")
    SPHERICAL.save(tmp_path / "saved.json")
    assert (tmp_path / "written.json").read_bytes() == (tmp_path / "saved.json").read_bytes()
    (tmp_path / "first.json").write_text(document())
    for name in ("written.json", "first.json"):
        assert read_two_parameter(tmp_path / name) == sm.load(tmp_path / name) == SPHERICAL


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (document(version=9), "version 9"),
        (document(symmotion="affine-motion"), "affine-motion"),
        (document(real=None), "missing real"),
        (document(extra=[1.0]), "unknown extra"),
        (document(real=[[[1.0, 0, 0, 0]]]), r"\(1, 1, 4\): \(8, 8, 4\) is needed"),
        (document(real=np.zeros((8, 8, 4)).tolist()), r"quaternion \(0, 0\) is zero"),
        (document(degree=[3, 2.5]), "whole numbers"),
        (document(knots_u=[0.0, 2.0, 1.0] * 4), "knots decrease"),
        ('{"axis": [[[0, 0, 1.0]]], "angle": [[1.0]]}', "too few for degree 3"),
        ('{"axis": [[0, 0, 1.0]], "angle": [1.0]}', "a net"),
        ("[1]", "a JSON object"),
        ("", "is empty"),
    ],
)
def test_bad_files_are_named_with_the_entry_at_fault(text, message, tmp_path):
    path = tmp_path / "net.json"
    path.write_text(text)
    with pytest.raises(sm.InputError, match=message) as caught:
        read_two_parameter(path)
    assert "net.json" in str(caught.value)


@pytest.mark.parametrize("content", [b"no archive", b"PK\x03\x04 broken", b"\x93NUMPY"])
def test_bad_archives(content, tmp_path):
    path = tmp_path / "net.npz"
    path.write_bytes(content)
    with pytest.raises(sm.InputError, match=r"net.npz: is no NPZ file"):
        read_two_parameter(path)


def test_archives_of_other_things(tmp_path):
    np.savez(tmp_path / "a.npz", axis=np.array(["x"]))
    np.save(tmp_path / "b.npy", np.ones(3))
    (tmp_path / "b.npy").rename(tmp_path / "b.npz")
    with pytest.raises(sm.InputError, match="axis: an array of finite numbers"):
        read_two_parameter(tmp_path / "a.npz")
    with pytest.raises(sm.InputError, match="is no NPZ file"):
        read_two_parameter(tmp_path / "b.npz")
    with pytest.raises(sm.InputError, match="format 'obj' is unknown; there are json, npz"):
        write_two_parameter(SPATIAL, tmp_path / "a.obj")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: TwoParameterMotion(SPATIAL.u, SPATIAL.v, SPATIAL.real[1:]), r"\(8, 8, 4\): \(9, 8, 4\) is needed"),
        (lambda: TwoParameterMotion(SPATIAL.u, SPATIAL.v, 0 * SPATIAL.real), r"\(0, 0\) is zero"),
        (lambda: TwoParameterMotion(SPATIAL.u, SPATIAL.v, SPATIAL.real, spatial.dual[1:]), "dual parts of shape"),
        (lambda: TwoParameterMotion(BSplineBasis.closed(np.arange(9.0), 3), SPATIAL.v, SPATIAL.real), "periodic"),
        (lambda: smooth_net(3), "3 controls in u are too few"),
        (lambda: net(6, knots="free"), "'free' is unknown"),
        (lambda: smooth_net(6, 7, knots=SPATIAL.u), "has 9 functions for 6"),
        (lambda: TwoParameterMotion.from_displacements(DualQuaternions(np.ones((4, 4)))), r"a net \(n, m\)"),
        (lambda: SPATIAL(-1.0, 0.5), "u: parameter -1 is outside"),
        (lambda: SPATIAL(0.0, [0.0, 99.0]), "v: parameter 99 is outside"),
        (lambda: SPATIAL(0.0, 0.0, (-1, 0)), "derivative orders"),
        (lambda: SPATIAL.trajectory([1.0, 2.0], 0.0, 0.0), r"\(1, 2\): \(3,\) or \(P, 3\)"),
        (lambda: spatial.boundary("w0"), "side 'w0' is unknown"),
        (lambda: SPATIAL.isoparametric(), "one of u and v"),
        (lambda: SPATIAL.along(Spline(BSplineBasis.clamped([0.0, 1.0], 1), np.zeros((2, 3)))), "u and v"),
        (lambda: SPATIAL.along(Spline(BSplineBasis.clamped([0.0, 1.0], 1), np.zeros((2, 2))))(0.5, 3), "order 3"),
        (lambda: SPATIAL.along(Spline(BSplineBasis.clamped([0.0, 1.0], 1), -np.ones((2, 2))))(0.5), "outside"),
        (lambda: noisy_net(SPHERICAL, -1.0), "noise"),
        (lambda: noisy_net(SPHERICAL, 0.1, translation=1.0), "no translations"),
    ],
)
def test_bad_input_names_the_culprit(make, message):
    with pytest.raises(sm.InputError, match=message):
        make()
