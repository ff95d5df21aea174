"""Interpolation and the classical interpolants in other units of time and length, from other origins."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import symmotion as sm
from studies.affine.invariance_of_units import UNITS, Units, keyframes

CLASSICAL: dict[str, Callable[[sm.Keyframes], Any]] = {
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


@pytest.mark.parametrize("name", CLASSICAL)
def test_measures_of_classical_interpolants(name):
    """At nodes that count from the beginning, so that times far from zero cost no digits."""
    for units in (UNITS[2], Units("far, for translations", a=1e-9, b=-1e9), Units("nm", a=1e9, k=1e9)):
        seen, plain, _ = units.of(keyframes(1, rigid=False))
        new, old = CLASSICAL[name](seen), CLASSICAL[name](plain)
        for energy, power, length in (
            (sm.Rigidity(), -1, 0),
            (sm.StrainAcceleration(), -3, 0),
            (sm.TrajectoryEnergy(units.k * np.eye(3)), -3, 2),
        ):
            wanted = sm.measure(old, energy if not length else sm.TrajectoryEnergy(np.eye(3)))
            found = sm.measure(new, energy)
            scale = units.a**power * units.k**length
            assert found == pytest.approx(scale * wanted, rel=1e-9), units
            assert found.error <= 1e-9 * found


@pytest.mark.parametrize("name", [name for name in CLASSICAL if name != "component cubic"])
def test_a_blend_counted_from_its_beginning_is_the_same(name):
    keys = keyframes(2, rigid=False)
    steps = np.round(2.0**20 * (keys.times - keys.times[0])) / 2.0**20
    motion = CLASSICAL[name](keys.with_times(2.0**20 + steps)).relative
    assert motion.domain == (0.0, steps[-1])
    assert motion.relative is motion
    t = np.linspace(0.0, steps[-1], 17)
    wanted, found = CLASSICAL[name](keys.with_times(steps))(t, 1), motion(t, 1)
    assert found.linear == pytest.approx(wanted.linear, abs=1e-12)
    assert found.translation == pytest.approx(wanted.translation, abs=1e-12)
