"""Energies of motions that are no splines, by numerical integration."""

import casadi as ca
import numpy as np

from symmotion.design.jets import JetKernel
from symmotion.energies import Energy
from symmotion.motions.motion import Motion


def measure_sampled(motion: Motion, energy: Energy, times, panels: int = 8, nodes: int = 16) -> float:
    """The value of an energy for any motion that has the derivatives that it reads.

    Composite Gauss quadrature: `panels` equal ones with `nodes` nodes each between neighbours of
    `times`, (M,) increasing: where the motion may have kinks. What a kink itself would add (a
    jump of a derivative that the energy differentiates) does not count. For splines `measure` is exact.
    """
    points, weights = np.polynomial.legendre.leggauss(nodes)
    ends = np.append(np.linspace(times[:-1], times[1:], panels, endpoint=False).T, times[-1])
    centre, half = 0.5 * (ends[1:] + ends[:-1]), 0.5 * np.diff(ends)
    t, w = (centre[:, None] + half[:, None] * points).ravel(), (half[:, None] * weights).ravel()
    total, jets = 0.0, {}
    for weight, part in energy.parts:
        jet = JetKernel.of(part, motion.dimension)
        for order in jet.orders:
            if order not in jets:
                linear, translation = motion(t, order)
                jets[order] = np.concatenate([linear.reshape(len(t), -1), translation], axis=1)
        z = np.concatenate([jets[order][:, : jet.kernel.channels] for order in jet.orders], axis=1)
        mu = ca.DM.ones(jet.kernel.out.numel(), len(t))
        values = jet.kernel.function("value").map(len(t))(ca.DM(z.T), ca.DM(t[None]), mu)
        total += weight * float(w @ np.asarray(values).ravel())
    return total
