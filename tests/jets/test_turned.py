"""Quaternion curves as polynomials on pieces: the remainder is no larger than its bound, and shrinks fast."""

from itertools import pairwise

import numpy as np
import pytest

import symmotion as sm
from symmotion.jets.turned import turned_pieces

KEYS = sm.examples.random_keyframes(6, 120, 3)


def evaluated(poly, s):
    powers = np.arange(poly.degree + 1)[:, None]
    return (poly.scaled * (1 - s) ** (poly.degree - powers) * s**powers).sum(axis=0)


@pytest.mark.parametrize("ends", ["natural", "periodic"])
def test_entries_are_within_their_errors(ends):
    keys = KEYS if ends == "natural" else KEYS.moved(-1, KEYS.linear[0], KEYS.translation[0])
    curve = sm.quaternions.interpolate_quaternions(keys.times, keys.rotations(), ends=ends)
    remainders = []
    for parts in (1, 2, 4):
        breaks = np.unique(np.concatenate([np.linspace(a, b, parts + 1) for a, b in pairwise(keys.times)]))
        left, right = breaks[:-1], breaks[1:]
        found = turned_pieces(curve, left, right, range(10))
        for s in (0.0, 0.13, 0.5, 0.77, 1 - 1e-12):
            jet = curve.jet(left + s * (right - left), 2)
            true = np.column_stack([jet.quaternion, jet.rate, jet.acceleration])
            for i in range(10):
                assert (np.abs(evaluated(found[i], s) - true[:, i]) <= found[i].error + 1e-11).all()
        remainders.append(max(float(p.error.max()) for p in found.values()))
    assert remainders[2] < 1e-3 * remainders[0] or remainders[2] < 1e-10
    assert remainders[2] < 1e-6
