"""Nets in other units of parameters and places, from other origins: the same fairing, after as many steps."""

from typing import Any

import numpy as np
import pytest

import symmotion as sm
from studies.affine.invariance_of_units import UNITS, Units
from symmotion.fairing import Method, fairing_program
from symmotion.motions import DualQuaternions, TwoParameterMotion
from symmotion.splines import BSplineBasis

SIZE, EXTENT = 7, 6.0
MOVES = np.array([1.0, -0.7, 0.4])
# How places are asked for: the method, its options, those of them that are powers of parameter and place.
METHODS: dict[str, tuple[Method, dict[str, Any], dict[str, tuple[float, float]]]] = {
    "greedy": ("greedy", {"max_steps": 40}, {}),
    "orthogonal": ("orthogonal", {"max_steps": 20}, {}),
    "least squares": ("least-squares", {"weight": 0.05}, {"weight": (-6, 0)}),
    "a target": ("least-squares", {"target": 1.0}, {"target": (-6, 2)}),
    "noise": ("least-squares", {"noise": 0.05}, {"noise": (0, 1)}),
    "bounded": ("bounded", {"tolerance": 0.05}, {"tolerance": (0, 1)}),
    "a program": ("least-squares", {"weight": 0.05, "form": "program"}, {"weight": (-6, 0)}),
}
# Of dual parts and of turns beside translations, the sum depends on where the origin is.
FAR = [u for u in UNITS if u.w]


def displacements(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Noisy quaternions and translations of a net."""
    rng, shape = np.random.default_rng(seed), (SIZE, SIZE)
    axes = np.array([0.0, 0.0, 1.0]) + 0.3 * rng.normal(size=(*shape, 3))
    turns = DualQuaternions.from_axis_angle(axes, 0.5 + 0.2 * rng.normal(size=shape)).real
    grid = np.stack([*np.meshgrid(np.arange(SIZE), np.arange(SIZE), indexing="ij"), np.zeros(shape)], axis=-1)
    return turns, grid + 0.1 * rng.normal(size=(*shape, 3))


def nets(units: Units, seed: int) -> tuple[TwoParameterMotion, TwoParameterMotion, np.ndarray]:
    """A net in other units, that which its rounded numbers mean in the old ones, and what was added to places."""
    turns, places = displacements(seed)
    far = units.w * units.k * EXTENT * MOVES
    knots = units.a * np.arange(-3.0, SIZE + 1.0) + units.a * units.b
    seen = DualQuaternions.from_parts(turns, units.k * places + far)
    meant = DualQuaternions.from_parts(turns, (seen.translation - far) / units.k)
    bases = [BSplineBasis(k, 3) for k in (knots, (knots - knots[0]) / units.a)]
    new, old = (TwoParameterMotion.from_displacements(d, b, b) for d, b in zip((seen, meant), bases, strict=True))
    return new, old, far


def compared(new: Any, old: Any, units: Units, far: np.ndarray) -> None:
    """What fairings end with, against each other."""
    resolved = units.resolved
    one, other = (f.control_displacements for f in (new, old))
    turns = [d.real / np.linalg.norm(d.real, axis=-1, keepdims=True) for d in (one, other)]
    assert np.abs(turns[0] - turns[1]).max() <= resolved
    assert np.abs((one.translation - far) / units.k - other.translation).max() <= resolved * EXTENT


@pytest.mark.parametrize("name", METHODS)
def test_fairing_is_the_same_in_other_units(name):
    method, options, powers = METHODS[name]
    number = list(METHODS).index(name)
    # Places alone, in their own units: all; with the unit of length that goes with them, beside turns: those near by.
    for parts in ("translation", "real+dual"):
        asked = UNITS if parts == "translation" else [u for u in UNITS if not u.w]
        for units in (asked[number % len(asked)], asked[(number + 3) % len(asked)]):
            new, old, far = nets(units, number)
            length = units.k if parts == "real+dual" else 1.0
            there = {
                n: v * units.a ** powers[n][0] * (units.k / length) ** powers[n][1] if n in powers else v
                for n, v in options.items()
            }
            fresh = sm.fair(new, method, parts=parts, length=length, **there)
            plain = sm.fair(old, method, parts=parts, **options)
            assert fresh.status == plain.status != "failed", units
            assert abs(fresh.steps - plain.steps) <= 1, units
            compared(fresh.motion, plain.motion, units, far)


@pytest.mark.parametrize("units", FAR, ids=lambda u: u.name)
def test_conditions_on_places_far_away(units):
    """The jet of a net knows where the origin is; the program subtracts it all the same."""
    answers = []
    for net, k, far, a in zip(
        nets(units, 1)[:2], (units.k, 1.0), (nets(units, 1)[2], 0.0), (units.a, 1.0), strict=True
    ):
        (u0, u1), (v0, v1) = net.domain
        at = (0.4 * u0 + 0.6 * u1, 0.3 * v0 + 0.7 * v1)
        rows = [basis.matrix(np.array([t])).toarray()[0] for basis, t in zip(net.bases, at, strict=True)]
        middle = np.einsum("i,ijc,j->c", rows[0], net.control_displacements.translation, rows[1])
        place = middle + k * np.array([0.0, 0.0, 0.3])
        there = sm.JetConstraint(lambda jet, p=place: (jet.d - p) / k, at=[at], name="there")  # noqa: B023
        program = fairing_program(net, parts="translation", weight=a**-6.0, constraints=[there])
        solution = sm.ExactNewton().solve(program).require()
        assert np.abs(program.x0).max() < 100 * k
        answers.append((program.design.net(program.unpack(solution.x))[..., -3:] - far) / k)
    assert np.abs(answers[0] - answers[1]).max() <= 10 * units.resolved * EXTENT


def test_keyframes_of_places_far_away_are_kept():
    new, old, far = nets(Units("far", w=1e6), 2)
    faired = []
    for net, shift in ((new, far), (old, 0.0)):
        at = (net.domain[0][0] + 2.2, net.domain[1][0] + 2.2)
        near = net(at[0], at[1])
        key = sm.motions.Affine(near.linear, near.translation + np.array([0.0, 0.0, 0.2]))
        result = sm.fair(net, "least-squares", weight=0.1, form="program", parts="translation", keyframes=[(at, key)])
        assert np.abs(result.motion(at[0], at[1]).translation - key.translation).max() < 1e-7
        faired.append(result.motion.control_displacements.translation - shift)
    assert np.abs(faired[0] - faired[1]).max() < 1e-7
