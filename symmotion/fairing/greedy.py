"""The automatic fairing of PCG table 1: local steps at the unfairest knot, the measures kept up to date."""

from dataclasses import dataclass

import numpy as np

from symmotion.fairing.fence import Fence
from symmotion.fairing.held_steps import HeldSteps
from symmotion.fairing.jumps import StepTables

BLOCK = 2048  # steps between two looks at which net was best


@dataclass(frozen=True, eq=False)
class Limits:
    """When the greedy iteration stops, and what it may touch.

    target: of G, None for as low as it gets; max_steps; divergence: stop where G exceeds this
    multiple of the best G seen.
    change: stop where a step changes G by less, PCG (23), 0 for never.
    patience: stop where so many steps have not led to a better net, None for never.
    knots: (K, L) the knots to step at, None for all; tolerance: (n, m) how far each control
    may go from its start, None for any distance.
    """

    target: float | None
    max_steps: int
    divergence: float
    knots: np.ndarray | None = None
    tolerance: np.ndarray | None = None
    change: float = 0.0
    patience: int | None = None


@dataclass(frozen=True, eq=False)
class GreedyRun:
    """What the iteration found.

    multipliers: (K, L, kinds, C) sum over the steps up to the best net, so that the net is the
    start minus `Jumps.spread` of them; history: (steps + 1,) G; best: the step with the least G;
    discarded: steps that the tolerance forbade; status: "target", "cap", "diverged", "exhausted", "stalled".
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


def iterate(
    tables: StepTables, jumps: np.ndarray, limits: Limits, held: HeldSteps | None = None, gone: np.ndarray | None = None
) -> GreedyRun:
    """Repeat the step at the largest L_kl until a limit is met, and return the best net seen.

    jumps: (K, L, kinds, C) of the start; held: the steps that conditions change; gone: (n, m, C) how far the start
    is from where tolerances are measured. One step changes at most 45 measures (69 where it moves all 21 controls);
    G is never summed from scratch. The controls themselves are not needed: the jumps follow from the jumps, and the
    net from the sum of the multipliers.
    """
    board = _Board(tables, jumps, limits.knots, limits.tolerance is not None or held is not None)
    kinds, coordinates = jumps.shape[2:]
    (r, s), (high, wide), columns = board.reach, board.box, board.columns
    box_shape = (high, wide, kinds, coordinates)
    all_jumps, measure, choice, allowed = board.jumps, board.measure, board.choice, board.allowed
    change, solve, dot, einsum, add = tables.change, tables.solve, np.dot, np.einsum, np.add.reduce
    touched = None if held is None else held.touched
    fence = None
    if limits.tolerance is not None:
        fence = Fence(tables, limits.tolerance, coordinates, board.measure.shape, gone)
    target = -1.0 if limits.target is None else limits.target
    patience = limits.max_steps if limits.patience is None else limits.patience
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
        local = held.at(k, l) if held is not None and touched is not None and touched[k, l] else None
        move = None
        if local is None:
            multiplier = dot(solve[k, l], jump)
        else:
            multiplier = dot(local.solve, jump.ravel()).reshape(jump.shape)
            move = local.move @ multiplier.ravel()
        if fence is not None and not (
            fence.admits(k, l, multiplier) if local is None or move is None else fence.takes(k, l, local, move)
        ):
            # Not before a step nearby has changed what is asked of this one.
            flat_choice[i] = 0.0
            discarded += 1
            continue
        box = all_jumps[k : k + high, l : l + wide]
        if local is None or move is None or held is None:
            box += dot(change[k, l], jump).reshape(box_shape)
        else:
            box += held.effect(k, l, local, move)
        before = measure[k : k + high, l : l + wide]
        after = einsum("abij,abij->ab", box, box)
        # The jumps at the knot itself are zero now but for rounding, which must not be chosen again.
        rest = after[r, s] if local is not None and not local.clears else 0.0
        after[r, s] = rest
        gain = float(add((after - before).ravel()))
        value += gain
        before[...] = after
        if choice is not measure:
            # Nor what conditions do not let vanish.
            after[r, s] = 0.0
            open_box = choice[k : k + high, l : l + wide]
            open_box[...] = after if allowed is None else after * allowed[k : k + high, l : l + wide]
            if fence is not None:
                fence.keep_shut(k, l, box, open_box)
        steps += 1
        log.append(k, l, multiplier, value)
        if log.full:
            log.settle()
        if value > limits.divergence * log.best_value or steps - log.best > patience:
            status = "diverged"
        elif abs(gain) < limits.change:
            status = "stalled"
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
