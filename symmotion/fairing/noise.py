"""What is known of the noise, as a metric and as the displacement to be expected."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.errors import InputError
from symmotion.fairing.borders import Freedom
from symmotion.fairing.coordinates import Coordinates


def noise_metric(
    coordinates: Coordinates, freedom: Freedom, noise: float | Sequence[float], metric: ArrayLike | None
) -> tuple[ArrayLike | None, float]:
    """The metric in which noise of these deviations is alike in all channels, and its Σ|δ|² over what may move.

    noise: σ of every coordinate, or one of each part, real first, each in units of the faired coordinates.
    """
    names = coordinates.parts.split("+")
    sigma = np.atleast_1d(checks.numbers(noise, "noise"))
    if sigma.shape not in ((1,), (len(names),)) or not (np.isfinite(sigma) & (sigma > 0)).all():
        needed = "a positive number" + (f", or {len(names)}, of {' and '.join(names)}," if len(names) > 1 else "")
        raise InputError(f"noise {checks.told(noise)}: {needed} is needed")
    count = freedom.u.shape[1] * freedom.v.shape[1]
    if len(sigma) == 1:
        if metric is not None:
            raise InputError("noise and metric: both say how to measure displacements; give one")
        return None, float(count * coordinates.channels * sigma[0] ** 2)
    if metric is not None:
        raise InputError("noise and metric: both say how to measure displacements; give one")
    each = np.repeat(sigma, [3 if name == "translation" else 4 for name in names])
    return np.diag((sigma[0] / each) ** 2), float(count * coordinates.channels * sigma[0] ** 2)
