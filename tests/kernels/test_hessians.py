"""Hessians of kernels against CasADi's own: of long ones, and of those that go through few numbers."""

import pickle

import casadi as ca
import numpy as np
import pytest

import symmotion as sm
from symmotion.kernels import Kernel
from symmotion.kernels.hessians import LONG

KEYS = sm.examples.random_keyframes(4, 40, 0)
POSE = sm.pose_program(KEYS, objective=sm.Torque([1.0, 2.0, 2.5]) + sm.TrajectoryEnergy([[0.3, 0.1, 0.0]]))
RNG = np.random.default_rng(0)


def blocks(matrix, channels):
    """A Hessian in the order of the kernel's, see `derive`."""
    rows = len(matrix) // channels
    return matrix.reshape(rows, channels, rows, channels).transpose(0, 2, 1, 3).ravel()


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
    return blocks(np.asarray(both[0]), kernel.channels), np.asarray(both[1]).ravel()


def through(squares):
    """sin and products of ‖z‖² and z₀ z₁, and z itself beside them."""
    z, data, w = ca.SX.sym("z", 4), ca.SX.sym("data", 1), ca.SX.sym("w", 2)
    out = ca.vertcat(data * ca.sin(w[0] * w[1]), w[1] ** 2 * z[2], z[3] + w[0])
    return Kernel.through(z, data, out, w, ca.vertcat(ca.sumsqr(z), z[0] * z[1]), 2, squares)


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
    found = [np.asarray(part).ravel() for part in function(*given[: function.n_in()])]
    for part, right in zip(found, written(kernel, kind, *given), strict=True):
        np.testing.assert_allclose(part, right, atol=1e-13 * np.abs(right).max())


@pytest.mark.parametrize(("kind", "squares"), [("hessian", True), ("hessian", False), ("barrier", False)])
def test_hessians_through_few_numbers_are_those_of_casadi(kind, squares):
    kernel = through(squares)
    given = numbers(kernel, RNG.normal(size=4))
    function = kernel.function(kind)
    found = [np.asarray(part).ravel() for part in function(*given[: function.n_in()])]
    for part, right in zip(found, written(kernel, kind, *given), strict=True):
        np.testing.assert_allclose(part, right, atol=1e-13 * np.abs(right).max())


def test_a_kernel_through_few_numbers_pickles_as_itself():
    kernel = through(True)
    again = pickle.loads(pickle.dumps(kernel))
    assert again.code == kernel.code
    assert again.function("hessian") is kernel.function("hessian")
    given = RNG.normal(size=4), [0.7]
    first, second = (np.asarray(ca.Function("f", [k.z, k.data], [k.out])(*given)) for k in (kernel, again))
    np.testing.assert_array_equal(first, second)
