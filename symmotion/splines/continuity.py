"""Where splines jump."""

import numpy as np

from symmotion.splines.spline import Spline

# Of the spline's extent: two sides that differ by less are one point, rounded.
SAME = 1e-9


def first_jump(spline: Spline) -> float | None:
    """The first inner knot at which a spline is not continuous, None where it is.

    At a knot t_k = … = t_{k+p} of multiplicity p + 1 the controls c_{k−1} and c_k are the values
    on its two sides; at others a spline is continuous.
    """
    basis, p = spline.basis.relative, spline.degree
    a, b = basis.domain
    first = np.arange(len(basis.knots) - p)
    k = first[(basis.knots[first] == basis.knots[first + p]) & (basis.knots[first] > a) & (basis.knots[first] < b)]
    controls = spline.control_points.reshape(basis.n, -1)
    gaps = np.abs(controls[k % basis.n] - controls[(k - 1) % basis.n]).max(axis=1, initial=0.0)
    rounding = 16 * np.finfo(float).eps * np.abs(controls).max()
    jumping = gaps > max(SAME * np.ptp(controls, axis=0).max(), rounding)
    return spline.basis.origin + float(basis.knots[k[np.argmax(jumping)]]) if jumping.any() else None
