"""Truncated Taylor series: how derivatives of any order pass through products, roots and compositions."""

from collections.abc import Callable
from math import factorial

import numpy as np

Series = list[np.ndarray]  # Taylor coefficients, lowest first, each an array over the points of expansion


def taylor(curve: Callable[[np.ndarray, int], np.ndarray], t: np.ndarray, order: int) -> Series:
    """The series of a curve about the times t, up to an order."""
    return [np.asarray(curve(t, k)) / factorial(k) for k in range(order + 1)]


def product(a: Series, b: Series, times: Callable = np.multiply) -> Series:
    """The series of the product of two; `times` multiplies coefficients."""
    return [np.sum([times(a[i], b[k - i]) for i in range(k + 1)], axis=0) for k in range(min(len(a), len(b)))]


def root(a: Series) -> Series:
    """√a of a series with a₀ ≥ 0; NaN beyond the first coefficient where a₀ is zero."""
    result = [np.sqrt(a[0])]
    for k in range(1, len(a)):
        rest = sum((result[i] * result[k - i] for i in range(1, k)), np.zeros_like(a[0]))
        result.append(_divide(a[k] - rest, 2 * result[0]))
    return result


def reciprocal(a: Series) -> Series:
    """1/a of a series; NaN where a₀ is zero."""
    inverse = [_divide(np.ones_like(a[0]), a[0])]
    for k in range(1, len(a)):
        inverse.append(-_divide(sum(a[i] * inverse[k - i] for i in range(1, k + 1)), a[0]))
    return inverse


def _divide(a: np.ndarray | float, b: np.ndarray) -> np.ndarray:
    """a / b, NaN where b is zero."""
    return np.divide(a, b, out=np.full_like(b, np.nan), where=b != 0)


def compose(outer: Series, inner: Series) -> Series:
    """The series of outer(inner), `outer` being about inner[0]: Horner's scheme."""
    tail = (1,) * (outer[0].ndim - inner[0].ndim)
    step = [np.zeros(inner[0].shape + tail), *(c.reshape(c.shape + tail) for c in inner[1:])]
    result = [np.zeros_like(outer[0]) for _ in outer]
    for c in reversed(outer):
        result = product(result, step)
        result[0] = result[0] + c
    return result
