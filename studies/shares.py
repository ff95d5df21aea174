"""Shares and ratios as answers tell them: never without how far chance, or the choice of cases, may move them."""

from collections.abc import Iterable
from statistics import median

from scipy.stats import binomtest


def interval(found: int, of: int) -> tuple[float, float]:
    """The 95 % interval, in percent, of a share that was found so many times of so many; Wilson's."""
    bounds = binomtest(found, of).proportion_ci(method="wilson")
    return 100 * bounds.low, 100 * bounds.high


def share(found: int, of: int) -> str:
    """A share with its interval: "36 of 40 (77–96 %)"; of none, just so."""
    return f"{found} of {of} ({'–'.join(f'{end:.0f}' for end in interval(found, of))} %)" if of else "0 of 0"


def spread(values: Iterable[float], digits: int = 3) -> str:
    """The median with the least and the largest: "2.1 (1.3–3.4)"."""
    values = sorted(values)
    low, middle, high = (f"{v:.{digits}g}" for v in (values[0], median(values), values[-1]))
    return f"{middle} ({low}–{high})" if low != high else middle
