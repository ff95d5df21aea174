"""How far an expression of jets exceeds its bounds anywhere: certified by Bernstein coefficients, or sampled."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from symmotion import interrupts
from symmotion.constraints.highest import SHARP, Side, highest
from symmotion.jets.enclosed import NotPolynomialError, Tape, values
from symmotion.jets.jet import AnyJet
from symmotion.jets.seen import Seen
from symmotion.program.everywhere import Excess
from symmotion.splines.pieces import Poly

# Parts of a span that are looked at one by one: more where a quaternion curve turns too far for few.
PARTS = (1, 2, 4, 8, 16, 32)
SAMPLES = 8
# Samples in each span where they are all that is known.
DENSE = 64
# Where the end of a span is looked at from its inside, as a share of it.
INSIDE = 1e-9
# Beside the ends of a span, as a share of it: a maximum nearer to an end counts as there. What is no jump at a break.
ASIDE, JUMP = 1e-5, 1e-7
# How often an interval is searched: to 1e-6 of a span, where a maximum differs by 1e-12, or as far as numbers go.
COARSE, FINE = 8, 12


def sides_of(lower: np.ndarray, upper: np.ndarray, power: int) -> list[Side]:
    """The finite bounds (C,) of each component."""
    found = []
    for k, (low, high) in enumerate(zip(lower.tolist(), upper.tolist(), strict=True)):
        found += [Side(k, -1.0, low, power)] if np.isfinite(low) else []
        found += [Side(k, 1.0, high, power)] if np.isfinite(high) else []
    return found


@dataclass(frozen=True, eq=False)
class Looked:
    """An expression of jets at one time, with its bounds.

    jets: of symbols; out: (C, 1) of their entries; lower, upper: (C,).
    """

    jets: Sequence[AnyJet]
    out: ca.SX
    lower: np.ndarray
    upper: np.ndarray
    power: int = 1

    @cached_property
    def sides(self) -> list[Side]:
        return sides_of(self.lower, self.upper, self.power)

    @cached_property
    def _entries(self) -> ca.SX:
        return ca.vertcat(*(jet.entries for jet in self.jets))

    @cached_property
    def tape(self) -> Tape:
        return Tape.of(self._entries, self.out)

    @cached_property
    def values(self) -> Callable[[np.ndarray], np.ndarray]:
        return values(self._entries, self.out)


@dataclass(frozen=True, eq=False)
class Watched:
    """An expression of jets along motions, from which they are."""

    seen: Sequence[Seen]
    looked: Looked

    @property
    def sides(self) -> list[Side]:
        return self.looked.sides

    @property
    def _tape(self) -> Tape:
        return self.looked.tape

    @cached_property
    def breaks(self) -> np.ndarray:
        a, b = max(s.domain[0] for s in self.seen), min(s.domain[1] for s in self.seen)
        marks = np.unique(np.concatenate([s.breakpoints for s in self.seen]))
        return np.concatenate([[a], marks[(marks > a) & (marks < b)], [b]])

    @cached_property
    def _shares(self) -> list[tuple[Seen, list[int], int]]:
        """Of each motion the entries that are read, and where the first of its entries is."""
        found, first = [], 0
        for seen, jet in zip(self.seen, self.looked.jets, strict=True):
            size = jet.entries.numel()
            found.append((seen, [i - first for i in self._tape.needed if first <= i < first + size], first))
            first += size
        return found

    def at(self, times: np.ndarray) -> np.ndarray:
        """(N, C) the expression at times (N,), or (N, s) of each jet."""
        times = times if times.ndim > 1 else np.repeat(times[:, None], len(self.seen), axis=1)
        parts = [seen.numbers(times[:, k], needed) for k, (seen, needed, _) in enumerate(self._shares)]
        return self.looked.values(np.concatenate(parts, axis=1))

    def excesses(self, times: np.ndarray) -> np.ndarray:
        """(N,) the largest excess of all bounds at times, below 0 inside; infinite where a value is no number."""
        return self._every(times).max(axis=0)

    @np.errstate(all="ignore")  # what is not finite is exceeded
    def excess(self) -> Excess:
        """The excess anywhere."""
        if self._tape.algebraic:
            try:
                return self._certified()
            except NotPolynomialError:
                pass
        return self._sampled()

    def _certified(self) -> Excess:
        left, right = self.breaks[:-1], self.breaks[1:]
        bound, attained, time = -np.inf, -np.inf, float(left[0])
        for parts in PARTS:
            share = np.arange(parts + 1) / parts
            ends = left[:, None] + (right - left)[:, None] * share
            ends[:, -1] = right
            forms = self._tape.on(self._pieces(ends[:, :-1].ravel(), ends[:, 1:].ravel()))
            found = [highest(forms[s.component], s, ends[:, :-1].ravel(), ends[:, 1:].ravel()) for s in self.sides]
            attained, time = max((attained, time), *((f.attained, f.time) for f in found))
            here, enough = max(f.bound for f in found), max(attained, 0.0) + SHARP
            if here <= enough or parts == PARTS[-1]:
                return Excess(max(0.0, bound, here), time)
            # Where the remainder of a quaternion curve is too large for a bound, its spans are parted.
            first = np.max([f.first for f in found], axis=0).reshape(-1, parts).max(axis=1)
            bound = max(bound, float(first[first <= enough].max(initial=-np.inf)))
            left, right = left[first > enough], right[first > enough]
        raise AssertionError("the last number of parts returns")

    def _pieces(self, left: np.ndarray, right: np.ndarray) -> dict[int, Poly]:
        """The entries that are read, by their number, on pieces from left to right."""
        entries = {}
        for seen, needed, first in self._shares:
            pieces = seen.pieces(left, right, needed) if needed else {}
            if pieces is None:
                raise NotPolynomialError
            entries |= {first + i: poly for i, poly in pieces.items()}
        return entries

    def _sampled(self) -> Excess:
        times = _inner(self.breaks, DENSE)
        found = self.excesses(times)
        local = _local(found)
        low, high = times[np.maximum(local - 1, 0)], times[np.minimum(local + 1, len(times) - 1)]
        peaks, heights = self._refined(low, times[local], high, found[local], FINE)
        k = int(np.argmax(heights))
        return Excess(max(0.0, float(heights[k])), float(peaks[k]), "sampled")

    def peaks(self) -> tuple[np.ndarray, np.ndarray]:
        """Times (K,) of the local maxima of the excess of every bound, in order, and the excess there.

        Those that cannot reach the limit are samples.
        Every span is looked at by itself: at a break one maximum may hide another behind it.
        """
        share = np.concatenate([[0.0, ASIDE], np.arange(1, SAMPLES) / SAMPLES, [1 - ASIDE, 1 - INSIDE]])
        times = self.breaks[:-1, None] + np.diff(self.breaks)[:, None] * share
        times[-1, -1] = self.breaks[-1]
        excess = self._every(times.ravel()).reshape(-1, *times.shape)
        edge = np.full((*excess.shape[:2], 1), -np.inf)
        before, after = np.concatenate([edge, excess[..., :-1]], 2), np.concatenate([excess[..., 1:], edge], 2)
        local = (excess > before) & (excess >= after)
        side, span, inner = np.nonzero(local[..., 1:-1])
        low, best, high = (times[span, inner + k] for k in range(3))
        left, height, right = (excess[side, span, inner + k] for k in range(3))
        # Far below the limit a sample will do: what a maximum rises above it is a part of what its neighbours fall.
        worth = ~(height + np.maximum(height - left, height - right) <= 0)
        best[worth], height[worth] = self._refined(
            low[worth], best[worth], high[worth], height[worth], COARSE, side[worth]
        )
        found, heights = [best], [height]
        begins, ends = _met(excess[..., 0], excess[..., -1], local[..., 0], local[..., -1])
        for which, column in ((begins, 0), (ends, -1)):
            found.append(np.broadcast_to(times[:, column], which.shape)[which])
            heights.append(excess[..., column][which])
        whole, tops = np.concatenate(found), np.concatenate(heights)
        order = np.argsort(whole, kind="stable")
        return whole[order], tops[order]

    def _refined(
        self,
        low: np.ndarray,
        best: np.ndarray,
        high: np.ndarray,
        height: np.ndarray,
        times: int,
        side: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Maxima near the best of samples: the intervals about them searched, all at once, by ever finer samples.

        times: how often, each of which leaves a quarter. side: which bound each is about, all of them when left out.
        """
        share, small = np.linspace(0.0, 1.0, 9)[:, None], 1e-10 * (self.breaks[-1] - self.breaks[0])
        columns = np.arange(len(best))
        for _ in range(times):
            if not (high - low > small).any():
                break
            grid = low + share * (high - low)
            every = self._every(grid.ravel()).reshape(-1, *grid.shape)
            found = every.max(axis=0) if side is None else every[side, :, columns].T
            k = np.argmax(found, axis=0)
            better = found[k, columns] > height
            best = np.where(better, grid[k, columns], best)
            height = np.where(better, found[k, columns], height)
            step = (high - low) / 8
            low, high = np.maximum(best - step, low), np.minimum(best + step, high)
        return best, height

    def _every(self, times: np.ndarray) -> np.ndarray:
        """(sides, N) the excess of every bound at times, below 0 inside; infinite where a value is no number."""
        interrupts.check()
        found = self.at(times)
        every = np.stack([side.excess(found[:, side.component]) for side in self.sides])
        return np.where(np.isnan(every), np.inf, every)


def _inner(breaks: np.ndarray, samples: int) -> np.ndarray:
    """Times in every span, its begin and its end among them, the latter from the inside."""
    share = np.append(np.arange(samples) / samples, 1 - INSIDE)
    times = (breaks[:-1, None] + np.diff(breaks)[:, None] * share).ravel()
    return np.append(times, breaks[-1])


def _local(excess: np.ndarray) -> np.ndarray:
    """The samples that are not below their neighbours, one of each plateau."""
    before, after = np.append(-np.inf, excess[:-1]), np.append(excess[1:], -np.inf)
    return np.flatnonzero((excess > before) & (excess >= after))


def _met(first: np.ndarray, last: np.ndarray, falls: np.ndarray, rises: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(sides, S) whether the begin, and whether the end, of a span is a maximum; of the two at a break one at most.

    first, last: (sides, S) the excess there; falls, rises: whether it falls from the begin, and rises to the end.
    """
    left, right, behind, ahead = last[:, :-1], first[:, 1:], rises[:, :-1], falls[:, 1:]
    jump = JUMP * (1 + np.minimum(np.abs(left), np.abs(right)))
    ends = behind & (left > right + jump)
    begins = ahead & ~ends & (behind | (right > left + jump))
    return np.hstack([falls[:, :1], begins]), np.hstack([ends, rises[:, -1:]])
