"""The automatic fairing of PCG table 1: local steps at the unfairest knot, the measures kept up to date."""

from dataclasses import dataclass

import numpy as np

from symmotion.fairing.jumps import StepTables

BLOCK = 2048  # steps between two looks at which net was best
WIDE = 5  # controls that the jumps at a knot read in each direction


@dataclass(frozen=True, eq=False)
class Limits:
    """When the greedy iteration stops, and what it may touch.

    target: of G, None for as low as it gets; max_steps; divergence: stop where G exceeds this
    multiple of the best G seen.
    knots: (K, L) the knots to step at, None for all; tolerance: (n, m) how far each control
    may go from its start, None for any distance.
    """

    target: float | None
    max_steps: int
    divergence: float
    knots: np.ndarray | None = None
    tolerance: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class GreedyRun:
    """What the iteration found.

    multipliers: (K, L, kinds, C) sum over the steps up to the best net, so that the net is the
    start minus `Jumps.spread` of them; history: (steps + 1,) G; best: the step with the least G;
    discarded: steps that the tolerance forbade; status: "target", "cap", "diverged", "exhausted".
    """

    multipliers: np.ndarray
    history: np.ndarray
    best: int
    discarded: int
    status: str


class _Board:
    """The jumps of a net and its measures L, padded so that a step writes one box of knots, border or not."""

    def __init__(self, tables: StepTables, jumps: np.ndarray, knots: np.ndarray | None, separate: bool):
        r, s = tables.reach
        rows, columns, kinds, coordinates = jumps.shape
        self.box, self.columns = (2 * r + 1, 2 * s + 1), columns + 2 * s
        self.reach = (r, s)
        padded = np.zeros((rows + 2 * r, columns + 2 * s, kinds, coordinates))
        padded[r : r + rows, s : s + columns] = jumps
        self.jumps = padded
        self.measure = np.sum(padded**2, axis=(2, 3))
        self.allowed = None
        if knots is not None:
            self.allowed = np.zeros(self.measure.shape)
            self.allowed[r : r + rows, s : s + columns] = knots
        # What the next knot is chosen by: the measures, unless some knots are not to be chosen.
        self.choice = self.measure.copy() if separate or knots is not None else self.measure
        if self.allowed is not None:
            self.choice *= self.allowed


def iterate(tables: StepTables, jumps: np.ndarray, limits: Limits) -> GreedyRun:
    """Repeat the step at the largest L_kl until a limit is met, and return the best net seen.

    jumps: (K, L, kinds, C) of the start. One step changes at most 45 measures (69 where it moves
    all 21 controls); G is never summed from scratch. The controls themselves are not needed:
    the jumps follow from the jumps, and the net from the sum of the multipliers.
    """
    board = _Board(tables, jumps, limits.knots, limits.tolerance is not None)
    kinds, coordinates = jumps.shape[2:]
    (r, s), (high, wide), columns = board.reach, board.box, board.columns
    box_shape = (high, wide, kinds, coordinates)
    all_jumps, measure, choice, allowed = board.jumps, board.measure, board.choice, board.allowed
    change, solve, dot, einsum, add = tables.change, tables.solve, np.dot, np.einsum, np.add.reduce
    fence = _Fence(tables, limits.tolerance, coordinates) if limits.tolerance is not None else None
    target = -1.0 if limits.target is None else limits.target
    log = _Log(jumps.shape, float(measure.sum()))
    value, steps, discarded, status = log.best_value, 0, 0, ""
    flat_choice = choice.ravel()
    while not status:
        if value <= target:
            status = "target"
            break
        if steps == limits.max_steps:
            status = "cap"
            break
        i = int(flat_choice.argmax())
        if not flat_choice[i] > 0.0:
            status = "exhausted"
            break
        row, column = divmod(i, columns)
        k, l = row - r, column - s  # noqa: E741 - PCG's letters
        jump = all_jumps[row, column]
        multiplier = dot(solve[k, l], jump)
        if fence is not None and not fence.admits(k, l, multiplier):
            # Not before a step nearby has changed what is asked of this one.
            flat_choice[i] = 0.0
            discarded += 1
            continue
        box = all_jumps[k : k + high, l : l + wide]
        box += dot(change[k, l], jump).reshape(box_shape)
        before = measure[k : k + high, l : l + wide]
        after = einsum("abij,abij->ab", box, box)
        # The jumps at the knot itself are zero now but for rounding, which must not be chosen again.
        after[r, s] = 0.0
        value += float(add((after - before).ravel()))
        before[...] = after
        if choice is not measure:
            choice[k : k + high, l : l + wide] = (
                after if allowed is None else after * allowed[k : k + high, l : l + wide]
            )
        steps += 1
        log.append(k, l, multiplier, value)
        if log.full:
            log.settle()
        if value > limits.divergence * log.best_value:
            status = "diverged"
    log.settle()
    return GreedyRun(log.kept, log.history(), log.best, discarded, status)


class _Log:
    """The steps since the last look, and what they sum up to; the best net's sum is kept."""

    def __init__(self, shape: tuple[int, ...], value: float):
        self.total, self.kept = np.zeros(shape), np.zeros(shape)
        self.best, self.best_value = 0, value
        self._places = np.empty((2, BLOCK), dtype=int)
        self._multipliers = np.empty((BLOCK, *shape[2:]))
        self._values: list[float] = [value]
        self._filled, self._settled = 0, 0

    @property
    def full(self) -> bool:
        return self._filled == BLOCK

    def append(self, k: int, l: int, multiplier: np.ndarray, value: float) -> None:  # noqa: E741
        i = self._filled
        self._places[0, i] = k
        self._places[1, i] = l
        self._multipliers[i] = multiplier
        self._values.append(value)
        self._filled = i + 1
        if value < self.best_value:
            self.best_value, self.best = value, self._settled + i + 1

    def settle(self) -> None:
        """Add the logged steps to the sums and empty the log."""
        until = self.best - self._settled
        if until > 0:
            self._add(0, until)
            self.kept = self.total.copy()
        self._add(max(until, 0), self._filled)
        self._settled += self._filled
        self._filled = 0

    def _add(self, start: int, stop: int) -> None:
        np.add.at(self.total, tuple(self._places[:, start:stop]), self._multipliers[start:stop])

    def history(self) -> np.ndarray:
        return np.array(self._values)


class _Fence:
    """How far the controls have gone, and whether a step keeps them within their tolerances."""

    def __init__(self, tables: StepTables, tolerance: np.ndarray, coordinates: int):
        self.limit = tolerance**2
        self.gone = np.zeros((*tolerance.shape, coordinates))
        u, v = tables.jumps.u, tables.jumps.v
        self.u = _window(u.moved(tables.step)), _window(u.values)
        self.v = _window(v.moved(tables.step)), _window(v.values)
        self.kinds = tables.jumps.kinds

    def admits(self, k: int, l: int, multiplier: np.ndarray) -> bool:  # noqa: E741
        """Take the step if no control leaves its tolerance."""
        (a, n), (b, w) = self.u, self.v
        move = np.multiply.outer(np.outer(a[k], w[l]), multiplier[0])
        if self.kinds == 2:
            move += np.multiply.outer(np.outer(n[k], b[l]), multiplier[1])
        place = slice(k, k + move.shape[0]), slice(l, l + move.shape[1])
        there = self.gone[place] - move
        if (np.einsum("abc,abc->ab", there, there) > self.limit[place]).any():
            return False
        self.gone[place] = there
        return True


def _window(rows: np.ndarray) -> np.ndarray:
    """(K, 5) the coefficients of the controls that each knot reads, (1, 1) for the other direction of a curve."""
    if rows.shape[1] == 1:
        return np.ones((1, 1))
    return np.stack([row[k : k + WIDE] for k, row in enumerate(rows)])
