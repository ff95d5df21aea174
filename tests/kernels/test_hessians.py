"""Hessians of kernels against CasADi's own: of long ones."""

import casadi as ca
import numpy as np
import pytest

import symmotion as sm
from symmotion.kernels.hessians import LONG
from symmotion.kernels.packing import packed, unpacked

KEYS = sm.examples.random_keyframes(4, 40, 0)
POSE = sm.pose_program(KEYS, objective=sm.Torque([1.0, 2.0, 2.5]) + sm.TrajectoryEnergy([[0.3, 0.1, 0.0]]))
RNG = np.random.default_rng(0)


def whole(kernel, values):
    """A packed Hessian as a matrix, read as the docstring of `packing` puts it."""
    rows, channels = kernel.rows, kernel.channels
    found, values = np.full((rows, channels, rows, channels), np.nan), iter(np.asarray(values).ravel())
    pairs = [(a, b) for a in range(rows) for b in range(a, rows)]
    symmetric = {}
    for a, b in pairs:
        part = symmetric[a, b] = np.empty((channels, channels))
        for i in range(channels):
            for j in range(i, channels):
                part[i, j] = part[j, i] = next(values)
    for a, b in pairs:
        skew = np.zeros((channels, channels))
        for i in range(channels) if a != b else ():
            for j in range(i + 1, channels):
                skew[i, j] = next(values)
                skew[j, i] = -skew[i, j]
        block = symmetric[a, b] if a == b else (symmetric[a, b] + skew) / 2
        found[a, :, b], found[b, :, a] = block, block.T
    assert next(values, None) is None
    return found.reshape(rows * channels, -1)


def numbers(kernel, z):
    """z, data, and numbers for multipliers, the share of the curvature, and stiffness."""
    size = kernel.out.numel()
    return z, RNG.normal(size=kernel.data.numel()), RNG.normal(size=size), 0.3, RNG.uniform(size=size)


def written(kernel, kind, z, data, mu, theta, sigma):
    """The Hessian and the gradient as the docstring of `derive` puts them, all by CasADi."""
    slopes = ca.jacobian(kernel.out, kernel.z)
    weights = 2 * kernel.out if kernel.squares else ca.DM(mu)
    symbols = ca.SX.sym("mu", kernel.out.numel())
    bent = ca.substitute(ca.hessian(ca.dot(symbols, kernel.out), kernel.z)[0], symbols, weights)
    straight = 2 * slopes.T @ slopes if kernel.squares else ca.SX(*bent.shape)
    if kind == "barrier":
        straight = slopes.T @ ca.diag(ca.DM(sigma)) @ slopes
    hessian = straight + (theta if kernel.squares or kind == "barrier" else 1.0) * bent
    both = ca.Function("f", [kernel.z, kernel.data], [ca.densify(hessian), slopes.T @ weights])(z, data)
    return np.asarray(both[0]), np.asarray(both[1]).ravel()


TERMS = {t.name: t.kernel for t in POSE.terms}
LONGER = sm.pose_program(KEYS, degree=5)
KEYFRAMES = LONGER.constraint("keyframes").block.kernel


@pytest.mark.parametrize(
    ("kernel", "kind"),
    [*((kernel, "hessian") for kernel in (*TERMS.values(), KEYFRAMES)), (KEYFRAMES, "barrier")],
    ids=[*TERMS, "keyframes", "keyframes, stiff"],
)
def test_long_hessians_are_those_of_casadi(kernel, kind):
    function = kernel.function(kind)
    assert function.n_instructions() > LONG
    start = LONGER.x0 if kernel is KEYFRAMES else POSE.x0
    given = numbers(kernel, start[: kernel.z.numel()] + 0.01 * RNG.normal(size=kernel.z.numel()))
    packed, gradient = function(*given[: function.n_in()])
    found = whole(kernel, packed), np.asarray(gradient).ravel()
    for part, right in zip(found, written(kernel, kind, *given), strict=True):
        np.testing.assert_allclose(part, right, atol=1e-13 * np.abs(right).max())


@pytest.mark.parametrize(("rows", "channels"), [(1, 3), (3, 1), (3, 4)])
def test_what_was_packed_is_unpacked(rows, channels):
    size = rows * channels
    matrix = RNG.normal(size=(size, size))
    matrix += matrix.T
    found = unpacked(np.asarray(ca.DM(packed(ca.SX(ca.DM(matrix)), channels))).T, rows, channels)[0]
    np.testing.assert_allclose(found.swapaxes(1, 2).reshape(size, size), matrix, atol=1e-15)
