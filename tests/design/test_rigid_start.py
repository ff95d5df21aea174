import numpy as np
import pytest

import symmotion as sm
from symmotion.design.rigid_start import rigid_spline, turns_between


def planar(*degrees: float) -> sm.Keyframes:
    linear = np.stack([sm.examples.rotation_2d(a) for a in degrees])
    return sm.Keyframes(np.arange(len(degrees), dtype=float), linear, np.zeros((len(degrees), 2)))


def linear_at(spline: sm.splines.Spline, t: np.ndarray, d: int) -> np.ndarray:
    return spline(t)[:, : d * d].reshape(-1, d, d)


@pytest.mark.parametrize("turns", [None, [0, -1], [1, 0]])
def test_the_path_turns_at_constant_rates(turns):
    keys = planar(0, 70, 150)
    angles = np.cumsum([0.0, *(np.radians([70, 80]) + 2 * np.pi * np.array(turns or [0, 0]))])
    spline, t = rigid_spline(keys, None if turns is None else np.array(turns)), np.linspace(0, 2, 9)
    matrices = np.stack([sm.examples.rotation_2d(np.degrees(a)) for a in np.interp(t, keys.times, angles)])
    np.testing.assert_allclose(linear_at(spline, t, 2), matrices, atol=1e-12)
    np.testing.assert_allclose(linear_at(spline, keys.times, 2), keys.linear, atol=1e-12)


def test_stretches_are_kept_apart_from_turns():
    keys = sm.examples.random_keyframes(4, 120, seed=3)
    stretched = keys.moved(1, linear=keys.linear[1] @ np.diag([1.0, 2.0, 0.5]))
    spline = rigid_spline(stretched)
    np.testing.assert_allclose(linear_at(spline, keys.times, 3), stretched.linear, atol=1e-12)
    between = linear_at(rigid_spline(keys), np.linspace(0, keys.times[-1], 50), 3)
    gram = np.swapaxes(between, 1, 2) @ between
    assert np.abs(gram - np.eye(3)).max() < 0.05


def test_half_a_turn_goes_either_way():
    keys = planar(0, 180)
    np.testing.assert_allclose(turns_between(keys), [np.pi])
    one, other = (linear_at(rigid_spline(keys, np.array([k])), np.array([0.5]), 2)[0] for k in (0, -1))
    np.testing.assert_allclose(one, -other, atol=1e-3)


def test_keyframes_that_all_reflect_turn_too_and_mixed_ones_do_not():
    mirror = np.diag([1.0, -1.0])
    keys = planar(0, 100, 180)
    mirrored = sm.Keyframes(keys.times, keys.linear @ mirror, keys.translation)
    np.testing.assert_allclose(turns_between(mirrored), turns_between(keys))
    t = np.linspace(0, 2, 7)
    np.testing.assert_allclose(
        linear_at(rigid_spline(mirrored), t, 2), linear_at(rigid_spline(keys), t, 2) @ mirror, atol=1e-9
    )
    mixed = keys.moved(1, linear=keys.linear[1] @ mirror)
    assert not turns_between(mixed).size
    with pytest.raises(sm.InputError, match="reflect"):
        rigid_spline(mixed)


def test_a_program_tells_its_turns_and_takes_them_as_start():
    keys = planar(0, 150, 300)
    program = sm.affine_program(keys)
    np.testing.assert_allclose(program.design.turns, np.radians([150, 150]))
    x = program.pack(program.design.rigid())
    np.testing.assert_allclose(sm.program.Evaluator(program).violation(x), 0, atol=1e-12)
    assert sm.program.Evaluator(program).objective(x) < sm.program.Evaluator(program).objective(program.x0)
