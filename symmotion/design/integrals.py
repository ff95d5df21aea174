"""Integrands of energies as functions of time, for motions that are there, and their integrals to ten digits."""

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np

from symmotion.design.terms import MOST_NODES, density_of, kernel_of
from symmotion.energies import Energy
from symmotion.jets.affine import HIGHEST_ORDER
from symmotion.jets.linear import LinearSpace, space_of
from symmotion.jets.rigid import rigid_jet
from symmotion.jets.seen import Called, SeenSampled
from symmotion.kernels.mapped import Mapped
from symmotion.motions import AffineMotion, PoseMotion
from symmotion.motions.interpolants.blends import Interpolant
from symmotion.motions.quaternions import ProductMotion, QuaternionMotion
from symmotion.program import QUADRATURE, BlockEvaluator
from symmotion.splines import Integral, Spline, integrate

KNOWN = (AffineMotion, QuaternionMotion, ProductMotion, PoseMotion, Spline)
Density = Callable[[np.ndarray], np.ndarray]
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True, eq=False)
class Integrand:
    """The integrand of an energy along a motion. density: φ at times (N,); marks: between which it is smooth.

    degree: of the motion, 0 of one that is no spline. origin: the time from which times and marks count.
    """

    energy: Energy
    density: Density
    marks: np.ndarray
    degree: int = 0
    origin: float = 0.0

    def integral(self) -> Integral:
        """∫ φ dt to ten digits, where it has them, span by span."""
        return integrate(self.density, self.marks[:-1], self.marks[1:], QUADRATURE)

    def by_nodes(self, nodes: int) -> float:
        """∫ φ dt by Gauss nodes on every span."""
        points, weights = np.polynomial.legendre.leggauss(nodes)
        half = 0.5 * np.diff(self.marks)[:, None]
        times = self.marks[:-1, None] + half * (1 + points)
        with np.errstate(all="ignore"):
            return float(np.sum(half * weights * self.density(times.ravel()).reshape(times.shape)))

    def nodes(self, first: int, integral: Integral | None = None) -> int:
        """Gauss nodes per span that ten digits need: `first` of them, or more by steps."""
        integral, nodes = integral or self.integral(), first
        wanted = max(QUADRATURE * integral.size, integral.rounding)
        # Where there is no integral nothing is gained by more of them.
        while nodes < MOST_NODES and np.isfinite(integral.size) and abs(self.by_nodes(nodes) - integral.value) > wanted:
            nodes = min(MOST_NODES, nodes + self.degree + 1)
        return nodes


def integrand(motion: Called, energy: Energy, marks: np.ndarray | None = None) -> Integrand:
    """The integrand of an energy, or of a sum of energies, along a motion; marks: of a motion that is not known."""
    if isinstance(motion, QuaternionMotion | ProductMotion | PoseMotion):
        curve = motion.orientation if isinstance(motion, PoseMotion) else motion
        return Integrand(energy, _rigid(motion, energy), curve.relative.breakpoints, curve.degree, curve.basis.origin)
    if isinstance(motion, AffineMotion | Spline):
        space, controls = space_of(motion)
        basis = space.basis
        density = linear_density(energy, space, controls)
        return Integrand(energy, density, basis.relative.breakpoints, basis.degree, basis.origin)
    assert marks is not None
    if isinstance(motion, Interpolant):
        begin = motion.domain[0]
        return Integrand(energy, _sampled(motion.relative, energy, begin), marks - begin, origin=begin)
    return Integrand(energy, _sampled(motion, energy), marks)


def exact_integral(energy: Energy, space: LinearSpace, controls: np.ndarray) -> tuple[np.ndarray, float]:
    """(S,) the integral over each span of an energy whose nodes are exact, and what rounding makes of the sum."""
    nodes = energy.nodes(space.basis.degree)
    block = kernel_of(energy, 1.0, space).integral(energy.name, space, nodes, 1.0)
    shares = BlockEvaluator(block).density(controls) * block.weights.reshape(-1, nodes)
    return shares.sum(axis=1), 32 * EPS * float(np.abs(shares).sum())


def linear_density(energy: Energy, space: LinearSpace, controls: np.ndarray) -> Density:
    """The integrand along a spline of controls (n, width), at times from the origin of its basis on."""
    kernels, origin = [(weight, kernel_of(part, 1.0, space)) for weight, part in energy.parts], space.basis.origin

    def density(times: np.ndarray) -> np.ndarray:
        total = np.zeros(len(times))
        for weight, kernel in kernels:
            rows = (kernel.rows(space, times) @ controls[:, : kernel.channels]).reshape(len(times), -1)
            ones = None if kernel.kernel.squares else np.ones((len(times), kernel.kernel.out.numel()))
            total += weight * _at(kernel.kernel.function("value"), rows, (origin + times)[:, None], ones)
        return total

    return density


def _rigid(motion: QuaternionMotion | ProductMotion | PoseMotion, energy: Energy) -> Density:
    """The integrand along a quaternion curve or a pose, at times from the origin of the curve on."""
    pose = isinstance(motion, PoseMotion)
    curve = motion.orientation if isinstance(motion, PoseMotion) else motion
    symbols = ca.SX.sym("jet", 23 if pose else 11)
    function = ca.Function("integrand", [symbols], [ca.densify(density_of(energy, rigid_jet(symbols, pose)))])
    origin, curve = curve.basis.origin, curve.relative
    path = motion.translation.about(origin).relative if isinstance(motion, PoseMotion) else None

    def density(times: np.ndarray) -> np.ndarray:
        jet = curve.jet(times, 2)
        columns = [jet.quaternion, jet.rate, jet.acceleration]
        if path is not None:
            columns += [path(times, order) for order in range(HIGHEST_ORDER + 1)]
        return _at(function, np.column_stack([*columns, origin + times]))

    return density


def _sampled(motion: Called, energy: Energy, origin: float = 0.0) -> Density:
    """The integrand along a motion that is called; origin: from which its times count."""
    there = SeenSampled(motion)
    jet = there.symbols()
    function = ca.Function("integrand", [jet.entries], [ca.densify(density_of(energy, jet))])
    needed = function.jac_sparsity(0, 0).get_col()

    def density(times: np.ndarray) -> np.ndarray:
        numbers = there.numbers(times, needed)
        numbers[:, -1] += origin
        return _at(function, numbers)

    return density


def _at(function: ca.Function, *inputs: np.ndarray | None) -> np.ndarray:
    """(N,) a scalar function at N nodes. Of sizes that repeat: CasADi makes a function for each."""
    count = next(len(a) for a in inputs if a is not None)
    size = 1 << max(0, count - 1).bit_length()
    # What is added repeats the last node, where the function has a value as well as it has one there.
    padded = [None if a is None else np.concatenate([a, np.repeat(a[-1:], size - count, axis=0)]) for a in inputs]
    return Mapped(function, size)(*padded)[:count, 0]
