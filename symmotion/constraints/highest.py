"""The largest value of a form on pieces: a bound by its Bernstein coefficients, which subdivision closes."""

from dataclasses import dataclass

import numpy as np

from symmotion import interrupts
from symmotion.jets.enclosed import Form
from symmotion.program.everywhere import beyond
from symmotion.splines.pieces import EPS, halves

# Relative to the limit: how closely a bound is attained.
SHARP = 1e-9
DEEPEST = 48
MOST_PIECES = 400_000


@dataclass(frozen=True)
class Side:
    """One bound of one component: sign 1 for value ≤ limit, −1 for value ≥ limit; power: see `JetConstraint`."""

    component: int
    sign: float
    limit: float
    power: int

    def excess(self, x: np.ndarray) -> np.ndarray:
        """By how far the values exceed it, below 0 inside; increases with sign · x."""
        return beyond(x, self.limit, self.sign, self.power)


@dataclass(frozen=True, eq=False)
class Highest:
    """Of one side on all pieces: a bound of its excess, the largest value found and when; first: (S,) bounds.

    What is no number there, a root of what is negative or what overflows, is infinite.
    """

    bound: float
    attained: float
    time: float
    first: np.ndarray


def highest(form: Form, side: Side, left: np.ndarray, right: np.ndarray) -> Highest:
    # The excess increases with `way` times what is under the root.
    way = side.sign if form.scale is None or form.scale >= 0 else -side.sign

    def judged(x: np.ndarray) -> np.ndarray:
        inner = way * x
        if form.scale is not None:
            inner = form.offset + form.scale * np.sqrt(np.maximum(inner, 0.0))
        found = side.excess(inner)
        return found + 8 * EPS * (1 + np.abs(found))

    if form.scale is not None and (none := _negative(form, left, right)) is not None:
        return Highest(np.inf, np.inf, none, np.full(len(left), np.inf))
    pieces, first = _Pieces.of(form, way, left, right), None
    bound, best, time = -np.inf, -np.inf, float(left[0])
    for depth in range(DEEPEST):
        interrupts.check()
        high, ends, stuck = pieces.hull()
        upper, lower = _number(judged(high), np.inf), _number(judged(ends), -np.inf)
        first = upper if first is None else first
        k = np.unravel_index(int(np.argmax(lower)), lower.shape)
        if lower[k] > best:
            best, time = float(lower[k]), float((pieces.left, pieces.right)[k[0]][k[1]])
        split = (upper > max(best, 0.0) + SHARP) & ~stuck
        if depth == DEEPEST - 1 or 2 * split.sum() > MOST_PIECES:
            split = np.zeros_like(split)
        bound = max(bound, float(upper[~split].max(initial=-np.inf)))
        if not split.any():
            break
        pieces = pieces.halved(split)
    assert first is not None
    return Highest(max(bound, best), best, time, first)


def _negative(form: Form, left: np.ndarray, right: np.ndarray) -> float | None:
    """A time when what is under the root is certainly negative; None where it is not, but for SHARP of its size."""
    pieces, least = _Pieces.of(form, -1.0, left, right), None
    for _ in range(DEEPEST):
        interrupts.check()
        high, ends, stuck = pieces.hull()
        k = np.unravel_index(int(np.argmax(ends)), ends.shape)
        if ends[k] > 0:
            return float((pieces.left, pieces.right)[k[0]][k[1]])
        if least is None:
            least = SHARP * float(np.abs(ends[np.isfinite(ends)]).max(initial=0.0))
        split = (high > least) & ~stuck
        if not split.any() or 2 * split.sum() > MOST_PIECES:
            return None
        pieces = pieces.halved(split)
    return None


def _number(values: np.ndarray, instead: float) -> np.ndarray:
    """The values, with another one in place of what is no number."""
    return np.where(np.isnan(values), instead, values)


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Pieces from left to right; of numerator and denominator coefficients (n + 1, S), sizes and errors (S,)."""

    left: np.ndarray
    right: np.ndarray
    parts: tuple[tuple[np.ndarray, np.ndarray, np.ndarray], ...]

    @staticmethod
    def of(form: Form, way: float, left: np.ndarray, right: np.ndarray) -> "_Pieces":
        parts = []
        for poly, sign in ((form.top, way), (form.bottom, 1.0)):
            if poly is not None:
                whole = np.broadcast_to(sign * poly.raised(form.degree), (form.degree + 1, len(left)))
                parts.append((whole, np.broadcast_to(poly.size, len(left)), np.broadcast_to(poly.error, len(left))))
        return _Pieces(left, right, tuple(parts))

    def halved(self, which: np.ndarray) -> "_Pieces":
        """The halves of some."""
        left, right = self.left[which], self.right[which]
        middle, parts = 0.5 * (left + right), []
        for coefficients, size, error in self.parts:
            both = np.concatenate(halves(coefficients[:, which]), axis=1)
            rounding = (len(coefficients) + 2) * EPS * size[which]
            parts.append((both, np.tile(size[which], 2), np.tile(error[which] + rounding, 2)))
        return _Pieces(np.concatenate([left, middle]), np.concatenate([middle, right]), tuple(parts))

    def hull(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of each piece a bound (S,), certain values at its ends (2, S), and whether parts would tell no more (S,)."""
        if len(self.parts) == 1:
            ((top, _, error),) = self.parts
            most, ends = top.max(axis=0), top[[0, -1]]
            stuck = ~(most - ends.max(axis=0) > error)
            return _number(most + error, np.inf), _number(ends - error, -np.inf), stuck
        # A quotient lies in the hull of the quotients of coefficients where the denominator has one sign.
        (top, _, error), (bottom, _, off) = self.parts
        sign = np.sign(bottom[0])
        least = (bottom * sign).min(axis=0) - off
        good = least > 0
        ratios = top / np.where(good, bottom, 1.0)
        most, ends = ratios.max(axis=0), ratios[[0, -1]]
        size = np.abs(ratios).max(axis=0)
        slack = (error + size * off) / np.where(good, least, 1.0) + 4 * EPS * size
        stuck = good & (most - ends.max(axis=0) <= slack)
        high, low = np.where(good, most + slack, np.inf), np.where(good, ends - slack, -np.inf)
        return _number(high, np.inf), _number(low, -np.inf), stuck
