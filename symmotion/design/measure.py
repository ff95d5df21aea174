"""The value of an energy for a motion that is there: of splines by their spans, of others by quadrature."""

from typing import Any, Protocol, runtime_checkable

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.design.terms import MOST_NODES, QUADRATURE, density_of, kernel_of, nodes_for
from symmotion.energies import Energy
from symmotion.errors import InputError
from symmotion.jets.affine import HIGHEST_ORDER, affine_jet
from symmotion.jets.linear import LinearSpace, affine_space, curve_space
from symmotion.jets.rigid import rigid_jet
from symmotion.motions import AffineMotion, PoseMotion
from symmotion.motions.quaternions import QuaternionMotion
from symmotion.program import BlockEvaluator
from symmotion.splines import Spline, gauss

KNOWN = (AffineMotion, QuaternionMotion, PoseMotion, Spline)
PANELS, NODES = 8, 16
RIGID_NODES = 8  # Gauss nodes per span of a quaternion curve, to begin with


@runtime_checkable
class SplineLike(Protocol):
    """A curve that can be written as a spline."""

    def to_bspline(self) -> Spline: ...


# Any: a motion or curve of the user's own, which is asked for what it has.
def measure(motion: Any, energy: Energy, *, times: ArrayLike | None = None) -> float:
    """The value of an energy for a motion or curve of any kind, to about ten digits where it is no polynomial.

    motion: affine, orientation, pose or curve; or any motion with derivatives, called with (t, order), and of such
    alone times: (M,) increasing, between which it is smooth (its breakpoints when left out). What a kink itself would
    add (a jump of a derivative that the energy differentiates) does not count.
    """
    if not isinstance(energy, Energy):
        swapped = ": the motion comes first, then the energy" if isinstance(motion, Energy) else ""
        raise InputError(f"energy {energy!r} is no energy{swapped}")
    if callable(motion) and hasattr(motion, "dimension") and not isinstance(motion, KNOWN):
        marks = getattr(motion, "breakpoints", None) if times is None else times
        if marks is None:
            raise InputError(
                f"times: the {type(motion).__name__} has no breakpoints; say between which times it is smooth"
            )
        return _sampled_value(energy, motion, checks.times(marks, "times", 2))
    if times is not None:
        raise InputError(f"times: a {type(motion).__name__} knows where it is smooth: leave them out")
    if isinstance(motion, AffineMotion):
        d = motion.dimension
        return _spline_value(energy, affine_space(motion.basis, d, d * d + d), motion.spline.control_points)
    if isinstance(motion, QuaternionMotion | PoseMotion):
        return sum(w * _rigid_value(e, motion) for w, e in energy.parts if w)
    if isinstance(motion, Spline):
        shape = motion.control_points.shape[1:]
        return _spline_value(
            energy, curve_space(motion.basis, shape), motion.control_points.reshape(motion.basis.n, -1)
        )
    if isinstance(motion, SplineLike):
        return measure(motion.to_bspline(), energy)
    raise InputError(f"motion: a {type(motion).__name__} is no motion or curve; measure(motion, energy)")


def _spline_value(energy: Energy, space: LinearSpace, controls: np.ndarray) -> float:
    total = 0.0
    for weight, part in energy.parts:
        nodes = nodes_for(part, 1.0, space, controls)
        block = kernel_of(part, 1.0, space).integral(part.name, space, nodes, 1.0)
        total += weight * BlockEvaluator(block).value(block.rows(controls))
    return total


def _rigid_value(energy: Energy, motion: QuaternionMotion | PoseMotion) -> float:
    """By Gauss nodes on every span, more of them until the value stays."""
    pose = isinstance(motion, PoseMotion)
    curve = motion.orientation if isinstance(motion, PoseMotion) else motion
    symbols = ca.SX.sym("jet", 23 if pose else 11)
    integrand = ca.Function("integrand", [symbols], [density_of(energy, rigid_jet(symbols, pose))])

    def value(nodes: int) -> float:
        points, weights = gauss(curve.relative.basis, nodes)
        since, origin = points.ravel(), curve.basis.origin
        jet = curve.relative.jet(since, 2)
        columns = [jet.quaternion, jet.rate, jet.acceleration]
        if isinstance(motion, PoseMotion):
            path = motion.translation.about(origin).relative
            columns += [path(since, order) for order in range(HIGHEST_ORDER + 1)]
        return _sum(integrand, np.column_stack([*columns, origin + since]), weights.ravel())

    nodes, here = RIGID_NODES, value(RIGID_NODES)
    while nodes < MOST_NODES:
        nodes = min(MOST_NODES, 2 * nodes)
        finer = value(nodes)
        if not abs(finer - here) > QUADRATURE * abs(finer):
            return finer
        here = finer
    return here


# Any: as for `measure`.
def _sampled_value(energy: Energy, motion: Any, times: np.ndarray) -> float:
    """Composite Gauss quadrature: equal panels between neighbours of `times`, of a motion called with (t, order)."""
    points, weights = np.polynomial.legendre.leggauss(NODES)
    ends = np.append(np.linspace(times[:-1], times[1:], PANELS, endpoint=False).T, times[-1])
    centre, half = 0.5 * (ends[1:] + ends[:-1]), 0.5 * np.diff(ends)
    t, w = (centre[:, None] + half[:, None] * points).ravel(), (half[:, None] * weights).ravel()
    d = motion.dimension
    symbols = ca.SX.sym("jet", (HIGHEST_ORDER + 1) * (d * d + d) + 1)
    value = density_of(energy, affine_jet(symbols, d))
    size = d * d + d
    # Only the derivatives that the energy reads are asked for: not every motion has them all.
    linear, translation = [], []
    for order in range(HIGHEST_ORDER + 1):
        places = [*range(order * d * d, (order + 1) * d * d)]
        first = (HIGHEST_ORDER + 1) * d * d + order * d
        read = bool(ca.depends_on(value, symbols[[*places, *range(first, first + d)]]))
        if read:
            there = motion(t, order)
            linear.append(np.swapaxes(there.linear, 1, 2).reshape(len(t), -1))
            translation.append(there.translation)
        else:
            linear.append(np.zeros((len(t), d * d)))
            translation.append(np.zeros((len(t), size - d * d)))
    return _sum(ca.Function("integrand", [symbols], [value]), np.column_stack([*linear, *translation, t]), w)


def _sum(integrand: ca.Function, entries: np.ndarray, weights: np.ndarray) -> float:
    values = np.asarray(integrand.map(len(entries))(ca.DM(entries.T))).ravel()
    return float(weights @ values)
