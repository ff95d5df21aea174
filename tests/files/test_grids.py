import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import symmotion as sm
from symmotion.files import read_orientation_grid, read_tool_path, write_tool_path
from symmotion.motions import DualQuaternions, TwoParameterMotion, noisy_net, smooth_net, symmetry_group
from symmotion.motions.quaternions import product

NET = noisy_net(smooth_net(7, 6), 0.01, seed=1, ring=True)
UNIT = NET.real / np.linalg.norm(NET.real, axis=-1, keepdims=True)
TURNS = Rotation.from_quat(UNIT.reshape(-1, 4)[:, [1, 2, 3, 0]])
ROWS, COLUMNS = (x.ravel() for x in np.indices((7, 6)))


def write(path, header, table):
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.17g")
    return path


def test_quaternions_in_any_order_of_lines(tmp_path):
    order = np.random.default_rng(0).permutation(42)
    table = np.column_stack([10 + 5 * ROWS, COLUMNS, UNIT.reshape(-1, 4), ROWS * 0])[order]
    net = read_orientation_grid(write(tmp_path / "map.csv", "row,column,qw,qx,qy,qz,phase", table))
    np.testing.assert_allclose(net.real, UNIT, atol=1e-15)
    assert net.spherical


@pytest.mark.parametrize(("convention", "letters"), [("bunge", "ZXZ"), ("Roe", "ZYZ"), ("xyz", "xyz"), ("ZYX", "ZYX")])
def test_euler_angles_by_name(tmp_path, convention, letters):
    table = np.column_stack([ROWS, COLUMNS, TURNS.as_euler(letters, degrees=True)])
    path = write(tmp_path / "map.csv", "y,x,phi1,Phi,phi2", table)
    net = read_orientation_grid(path, convention=convention)
    np.testing.assert_allclose(np.abs(np.sum(net.real * UNIT, axis=-1)), 1, atol=1e-12)


def test_bunge_angles_turn_crystal_coordinates_into_those_of_the_sample(tmp_path):
    """g = R_z(φ₂) R_x(Φ) R_z(φ₁), of turned frames, takes the sample's to the crystal's: the rotation is gᵀ."""
    p1, p, p2 = np.deg2rad([20.0, 35.0, 50.0])

    def frame(angle, axis):
        return Rotation.from_rotvec(-angle * np.eye(3)[axis]).as_matrix()

    g = frame(p2, 2) @ frame(p, 0) @ frame(p1, 2)
    table = np.column_stack([ROWS, COLUMNS, np.tile([20.0, 35.0, 50.0], (42, 1))])
    net = read_orientation_grid(write(tmp_path / "map.csv", "row,column,e1,e2,e3", table))
    np.testing.assert_allclose(net.control_displacements.matrices.linear[2, 2], g.T, atol=1e-14)


@pytest.mark.parametrize("group", ["432", "622", "O", "D2", Rotation.create_group("C4")])
def test_orientations_that_jump_by_symmetry_are_joined(tmp_path, group):
    elements = symmetry_group(group)
    jumping = product(UNIT.reshape(-1, 4), elements[np.random.default_rng(3).integers(0, len(elements), 42)])
    path = write(tmp_path / "map.csv", "i,j,qw,qx,qy,qz", np.column_stack([ROWS, COLUMNS, jumping]))
    net = read_orientation_grid(path, symmetry=group)
    # One element of the group for all: the same motion of a body seen in another of its frames.
    ratio = product(UNIT * [1, -1, -1, -1], net.real).reshape(-1, 4)
    np.testing.assert_allclose(np.abs(ratio @ ratio[0]), 1, atol=1e-12)
    assert np.abs(ratio[0] @ elements.T).max() == pytest.approx(1, abs=1e-12)


def test_without_it_symmetry_is_named(tmp_path):
    elements = symmetry_group("432")
    jumping = product(UNIT.reshape(-1, 4), elements[np.random.default_rng(3).integers(0, 24, 42)])
    path = write(tmp_path / "map.csv", "i,j,qw,qx,qy,qz", np.column_stack([ROWS, COLUMNS, jumping]))
    with pytest.raises(sm.InputError, match=r"map.csv: .* their symmetry is the likely cause: give it"):
        read_orientation_grid(path)


def test_tool_paths_there_and_back(tmp_path):
    net = noisy_net(smooth_net(7, 6, spatial=True), 0.01, seed=1)
    (a, b), (c, d) = net.domain
    u, v = np.linspace(a, b, 5)[:, None], np.linspace(c, d, 6)
    write_tool_path(net, tmp_path / "path.csv", u, v)
    path = read_tool_path(tmp_path / "path.csv")
    there = net(path.u, path.v)
    np.testing.assert_allclose(path.displacements.matrices.linear, there.linear, atol=1e-14)
    np.testing.assert_allclose(path.displacements.translation, there.translation, atol=1e-13)
    assert isinstance(path.net("centripetal"), TwoParameterMotion)
    keys = path.keyframes()[7:9]
    faired = sm.fair(net, "least-squares", keyframes=keys)
    for at, displacement in keys:
        np.testing.assert_allclose(faired.motion(*at).translation, displacement.translation, atol=1e-12)


def test_knots_follow_the_displacements():
    even = smooth_net(9).control_displacements
    angles = np.concatenate([np.linspace(0, 0.5, 6), [0.9, 1.3, 1.7]])
    turning = DualQuaternions.from_axis_angle(np.tile([0.0, 0, 1], (9, 5, 1)), np.tile(angles[:, None], (1, 5)))
    tilted = DualQuaternions.from_axis_angle(np.tile([1.0, 0, 0], (9, 5, 1)), np.tile(0.1 * np.arange(5.0), (9, 1)))
    net = TwoParameterMotion.from_displacements(turning @ tilted, "chordal", "centripetal")
    steps = np.diff(net.u.knots)
    assert steps[8] / steps[4] == pytest.approx(4.0, rel=0.05)
    root = np.diff(TwoParameterMotion.from_displacements(turning @ tilted, "centripetal").u.knots)
    assert root[8] / root[4] == pytest.approx(2.0, rel=0.03)
    np.testing.assert_allclose(np.diff(net.v.knots), 1.0, atol=1e-9)
    assert np.isclose(np.diff(TwoParameterMotion.from_displacements(even, "chordal").u.knots).mean(), 1.0, atol=0.05)
    assert sm.fair(net, "least-squares").final < sm.fair(net, max_steps=0).initial


@pytest.mark.parametrize(
    ("header", "table", "message"),
    [
        ("row,column,qw,qx,qy", np.ones((3, 5)), "of the columns"),
        ("row,column,qw,qx,qy,qz", [[0, 0, 1, 0, 0, 0], [0, 0, 1, 0, 0, 0]], "lines 2 and 3 are at one place"),
        (
            "row,column,qw,qx,qy,qz",
            [[0, 0, 1, 0, 0, 0], [0, 1, 1, 0, 0, 0], [1, 0, 1, 0, 0, 0]],
            "the grid of 2 × 2 lacks 1 place, first row 1, column 1",
        ),
        ("row,column,qw,qx,qy,qz", [[0, 0, 0, 0, 0, 0]], "line 2: the quaternion is zero"),
    ],
)
def test_bad_grids_are_named(tmp_path, header, table, message):
    with pytest.raises(sm.InputError, match=message):
        read_orientation_grid(write(tmp_path / "map.csv", header, table))


def test_bad_words_are_named(tmp_path):
    path = write(tmp_path / "map.csv", "row,column,e1,e2,e3", np.column_stack([ROWS, COLUMNS, np.zeros((42, 3))]))
    with pytest.raises(sm.InputError, match="convention 'kocks-roe'"):
        read_orientation_grid(path, convention="kocks-roe")
    with pytest.raises(sm.InputError, match="symmetry '5' is unknown; there are 1, 2, 222"):
        read_orientation_grid(path, symmetry="5")
    with pytest.raises(sm.InputError, match="2 rotations that are no group"):
        symmetry_group(np.array([[1.0, 0, 0, 0], [1, 0.1, 0, 0]]))
    same = DualQuaternions(np.tile([1.0, 0, 0, 0], (6, 6, 1)))
    with pytest.raises(sm.InputError, match="controls 0 and 1 in u are the same everywhere"):
        TwoParameterMotion.from_displacements(same, "chordal")
