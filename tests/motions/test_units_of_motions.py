"""Interpolation and the classical interpolants in other units of time and length, from other origins."""

import numpy as np
import pytest

import symmotion as sm
from studies.affine.invariance_of_units import UNITS, Units, keyframes

CLASSICAL = {
    "component cubic": sm.interpolants.component_cubic,
    "polar, spline": sm.interpolants.polar_blend,
    "polar, slerp": lambda keys: sm.interpolants.polar_blend(keys, "slerp"),
    "logarithm, linear": sm.interpolants.log_blend,
    "logarithm, cubic": lambda keys: sm.interpolants.log_blend(keys, 3),
    "steady": sm.interpolants.steady_morph,
}
TURNS = {
    "quaternion spline": lambda keys: sm.quaternions.interpolate_quaternions(keys.times, keys.rotations()),
    "squad": lambda keys: sm.interpolants.squad(keys.times, keys.rotations()),
    "Shoemake": lambda keys: sm.interpolants.shoemake_interpolant(keys.times, keys.rotations()),
    "slerp": lambda keys: sm.interpolants.slerp_curve(keys.times, keys.rotations()),
}
units = pytest.mark.parametrize("units", UNITS, ids=lambda u: u.name)
seeds = pytest.mark.parametrize("seed", [1, 2])


def _times(units: Units, seen: sm.Keyframes, plain: sm.Keyframes) -> tuple[np.ndarray, np.ndarray]:
    """Times in both units, the same up to the rounding of what brings them to the old ones."""
    inside = np.linspace(0.0, plain.times[-1], 33)[1:-1]
    there = seen.times[0] + units.a * inside
    return there, (there - seen.times[0]) / units.a


@units
@seeds
@pytest.mark.parametrize("name", CLASSICAL)
def test_classical_interpolants(name, units, seed):
    if name.startswith("logarithm") and units.w:
        pytest.skip("logarithms are of matrices, which depend on where the origin is: the method is not invariant")
    seen, plain, far = units.of(keyframes(seed, rigid=False))
    new, old = CLASSICAL[name](seen), CLASSICAL[name](plain)
    t, s = _times(units, seen, plain)
    (linear, places), (wanted, there) = new(t), old(s)
    assert linear == pytest.approx(wanted, abs=1e-9)
    assert np.abs((places - far) / units.k - there).max() <= units.resolved * np.ptp(there, axis=0).max()
    (rates, _), (wanted, _) = new(t, 1), old(s, 1)
    assert units.a * rates == pytest.approx(wanted, abs=1e-9 * np.abs(wanted).max())


@units
@seeds
@pytest.mark.parametrize("name", TURNS)
def test_turns(name, units, seed):
    seen, plain, _ = units.of(keyframes(seed, rigid=True))
    new, old = TURNS[name](seen), TURNS[name](plain)
    t, s = _times(units, seen, plain)
    assert new(t) == pytest.approx(old(s), abs=1e-9)
    assert units.a * new(t, 1) == pytest.approx(old(s, 1), abs=1e-9)
