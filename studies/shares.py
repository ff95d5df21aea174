"""Shares and ratios as answers tell them: never without how far chance, or the choice of cases, may move them."""

from collections.abc import Iterable, Sequence
from statistics import median

import numpy as np
from scipy.stats import binomtest

from symmotion.report import Column

DRAWS = 2000  # of a bootstrap


def interval(found: int, of: int) -> tuple[float, float]:
    """The 95 % interval, in percent, of a share that was found so many times of so many; Wilson's."""
    bounds = binomtest(found, of).proportion_ci(method="wilson")
    return 100 * bounds.low, 100 * bounds.high


def with_interval(found: int, of: int) -> tuple[float | None, float | None, float | None]:
    """A share in percent, and the ends of its interval."""
    return (100 * found / of, *interval(found, of)) if of else (None, None, None)


def share(found: int, of: int) -> str:
    """A share with its interval: "36 of 40 (77–96 %)"; of none, just so."""
    return f"{found} of {of} ({'–'.join(f'{end:.0f}' for end in interval(found, of))} %)" if of else "0 of 0"


def ends(what: str) -> tuple[Column, Column]:
    """The columns of the ends of a share's interval."""
    return Column(f"{what}, from", "%", end=True), Column(f"{what}, to", "%", end=True)


def spread(values: Iterable[float], digits: int = 3) -> str:
    """The median with the least and the largest: "2.1 (1.3–3.4)"."""
    values = sorted(values)
    low, middle, high = (f"{v:.{digits}g}" for v in (values[0], median(values), values[-1]))
    return f"{middle} ({low}–{high})" if low != high else middle


def paired(first: Sequence[bool], second: Sequence[bool]) -> tuple[int, int, float]:
    """Of pairs, how many only the first has, how many only the second, and how likely so uneven a split is by chance.

    The exact test of McNemar: of the pairs that differ each half is as likely; two-sided, 1 where none differs.
    """
    only = [sum(a and not b for a, b in zip(*both, strict=True)) for both in ((first, second), (second, first))]
    return only[0], only[1], float(binomtest(only[0], sum(only)).pvalue) if sum(only) else 1.0


def versus(first: Sequence[bool], second: Sequence[bool]) -> str:
    """The same in words: "9 : 5, p = 0.42"."""
    a, b, p = paired(first, second)
    return f"{a} : {b}, p = {p:.2g}"


def shifted_mean(values: Iterable[float], shift: float) -> float:
    """exp(mean log(v + shift)) − shift, the geometric mean in which what is far below the shift counts little."""
    values = np.fromiter(values, dtype=float)
    return float(np.exp(np.log(values + shift).mean()) - shift) if len(values) else np.nan


def ratio(first: Iterable[float], second: Iterable[float]) -> tuple[float, float, float]:
    """The geometric mean of first/second, pair by pair, with its 95 % interval by the bootstrap over pairs, seeded."""
    logs = np.log(np.fromiter(first, dtype=float) / np.fromiter(second, dtype=float))
    if not len(logs):
        return np.nan, np.nan, np.nan
    means = np.random.default_rng(0).choice(logs, size=(DRAWS, len(logs))).mean(axis=1)
    low, middle, high = np.exp([np.quantile(means, 0.025), logs.mean(), np.quantile(means, 0.975)]).tolist()
    return middle, low, high
