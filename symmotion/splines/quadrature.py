"""Gauss–Legendre quadrature, span by span."""

import numpy as np

from symmotion.checks import whole
from symmotion.splines.basis import BSplineBasis


def gauss(basis: BSplineBasis, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss points and weights, (S, nodes) each, on the S spans of the basis.

    They are times; of `basis.relative` times from its origin on, which far from zero lose no digits.
    Exact for integrands that are polynomials of degree 2 nodes − 1 on every span.
    """
    points, weights = np.polynomial.legendre.leggauss(whole(nodes, 1, "nodes", " of Gauss nodes"))
    ends = basis.breakpoints
    centre, half = 0.5 * (ends[1:] + ends[:-1]), 0.5 * np.diff(ends)
    return centre[:, None] + half[:, None] * points, half[:, None] * weights
