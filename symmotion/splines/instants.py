"""Which times are the same: those that agree up to the rounding of sums and of numbers of their size."""

import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.brief import instants
from symmotion.errors import InputError

# Of the largest time: a number and its neighbours. Of the interval: what sums of steps are off by.
NEIGHBOURS = 4 * float(np.finfo(float).eps)
SUMS = 1e-12
# Between them the powers of steps that derivatives and integrals are made of stay numbers.
SHORTEST, LONGEST = 1e-30, 1e30


def rounding_in(a: float, b: float) -> float:
    """By how much two times in [a, b] may differ and be the same: max(4 ε max(|a|, |b|), 1e-12 (b − a))."""
    return max(NEIGHBOURS * max(abs(a), abs(b)), SUMS * (b - a))


def rounding(times: ArrayLike) -> float:
    """By how much two times may differ and be the same, in the interval that these span."""
    return rounding_in(float(np.min(times)), float(np.max(times)))


def same_times(one: ArrayLike, other: ArrayLike, domain: ArrayLike | None = None) -> bool:
    """Whether times of one shape are the same, number by number, in a domain; their own where it is left out.

    one, other: the times, of one shape.

    >>> sm.splines.same_times([0.1 + 0.2], [0.3])
    True
    """
    a, b = np.asarray(one, dtype=float), np.asarray(other, dtype=float)
    if a.shape != b.shape or not a.size:
        return a.shape == b.shape
    within = rounding([a.min(), b.min(), a.max(), b.max()] if domain is None else domain)
    return bool((np.abs(a - b) <= within).all())


def unified(times: ArrayLike, marks: ArrayLike = (), origin: float = 0.0) -> np.ndarray:
    """The times (…), of each that are the same all made the first that is given, marks (K,) before times.

    Afterwards == says which are the same. origin: from which they all count; what is the same is said of the sums.

        unified([0.1 + 0.2, 0.3, 1.0], marks=[0.3])  # 0.3, 0.3, 1.0

    >>> bool(sm.splines.unified([0.3, 0.1 + 0.2, 1.0])[0] == sm.splines.unified([0.3, 0.1 + 0.2, 1.0])[1])
    True
    """
    given, first = np.array(times, dtype=float), np.ravel(np.asarray(marks, dtype=float))
    every = np.concatenate([first, given.ravel()])
    order = np.argsort(every, kind="stable")
    along = every[order]
    steps = np.diff(along)
    within = rounding(origin + along[[0, -1]]) if along.size else 0.0
    if not np.isfinite(within) or not ((steps > 0) & (steps <= within)).any():
        return given
    group = np.concatenate([[0], np.cumsum(steps > within)])
    earliest = np.full(group[-1] + 1, every.size)
    np.minimum.at(earliest, group, order)
    every[order] = every[earliest[group]]
    return every[first.size :].reshape(given.shape)


def distinct(times: ArrayLike, marks: ArrayLike = (), origin: float = 0.0) -> np.ndarray:
    """(N,) the times in order, each once, as `unified` has them."""
    return np.unique(unified(times, marks, origin))


def inside(times: np.ndarray, domain: tuple[float, float]) -> np.ndarray:
    """(…) which times lie in a domain, its ends met up to rounding."""
    slack = rounding_in(*domain)
    return (times >= domain[0] - slack) & (times <= domain[1] + slack)


def require_inside(times: np.ndarray, domain: tuple[float, float], what: str = "parameter", of: str = "") -> None:
    """InputError that names the first of times (…) outside a domain, whose ends are met up to rounding."""
    there = inside(times, domain)
    if not there.all():
        t, a, b = instants(times[~there].flat[0], *domain)
        raise InputError(f"{what} {t} is outside the domain [{a}, {b}]{of}")


def put_inside(times: ArrayLike, domain: tuple[float, float], what: str = "parameter", of: str = "") -> np.ndarray:
    """Times (…) as floats, in the domain where only rounding leads out of it; else InputError."""
    given = checks.numbers(times, "times")
    require_inside(given, domain, what, of)
    return np.clip(given, *domain)


def no_part(what: str, start: float, end: float, domain: tuple[float, float]) -> str:
    """What is wrong with times that are no part of a domain."""
    first, last, a, b = instants(start, end, *domain)
    return f"{what} from {first} to {last}: both in [{a}, {b}], in this order, are needed"


def require_steps(times: np.ndarray, what: str) -> None:
    """InputError where steps between increasing times (M,) are so short or long that their powers are no numbers."""
    steps = np.diff(times)
    wrong = ~((steps >= SHORTEST) & (steps <= LONGEST))
    if wrong.any():
        i = int(np.argmax(wrong))
        raise InputError(
            f"{what} {i} and {i + 1} are {steps[i]:.3g} apart: between {SHORTEST:g} and {LONGEST:g} is needed; "
            "tell time in another unit"
        )
