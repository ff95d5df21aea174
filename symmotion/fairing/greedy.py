"""The automatic fairing of PCG table 1: local steps at the unfairest knot, the measures kept up to date."""

from dataclasses import dataclass
from typing import NamedTuple

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

    def around(self, k: int, l: int) -> tuple[slice, slice]:  # noqa: E741 - PCG's letters
        """The box of knots that a step at (k, l) writes."""
        return slice(k, k + self.box[0]), slice(l, l + self.box[1])

    def place(self, i: int, tables: StepTables) -> "_Place":
        """The knot that is number i of the padded board."""
        row, column = divmod(i, self.columns)
        k, l = row - self.reach[0], column - self.reach[1]  # noqa: E741
        # Reshaped before it is cut out, which copies nothing.
        box = self.jumps.reshape(*self.measure.shape, -1)[self.around(k, l)]
        knot = k * tables.jumps.shape[1] + l
        before = self.measure[self.around(k, l)]
        return _Place(k, l, knot, self.jumps[row, column], box, before, tables.solve[k, l], tables.change[k, l])


class _Place(NamedTuple):
    """What a step at a knot reads and writes, as views: cutting them out anew takes as long as the numbers.

    knot: its number; jump: (kinds, C) there; box: (2r + 1, 2s + 1, kinds C) the jumps around; before: (2r + 1, 2s + 1)
    their measures; solve, change: the tables'.
    """

    k: int
    l: int  # noqa: E741
    knot: int
    jump: np.ndarray
    box: np.ndarray
    before: np.ndarray
    solve: np.ndarray
    change: np.ndarray


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
    r, s = board.reach
    measure, choice, allowed = board.measure, board.choice, board.allowed
    dot, square, ones = np.dot, np.vecdot, np.ones(np.prod(board.box))
    touched = None if held is None else held.touched
    fence = None
    if limits.tolerance is not None:
        fence = Fence(tables, limits.tolerance, jumps.shape[3], measure.shape, gone)
    target = -1.0 if limits.target is None else limits.target
    patience = limits.max_steps if limits.patience is None else limits.patience
    log = _Log(jumps.shape, float(measure.sum()))
    value, steps, discarded, status = log.best_value, 0, 0, ""
    flat_choice = choice.ravel()
    places: dict[int, _Place] = {}
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
        place = places.get(i)
        if place is None:
            place = places[i] = board.place(i, tables)
        k, l, knot, jump, box, before, solve, change = place  # noqa: E741 - PCG's letters
        local = held.at(k, l) if held is not None and touched is not None and touched[k, l] else None
        move = None
        if local is None:
            multiplier = dot(solve, jump)
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
        if local is None or move is None or held is None:
            box += dot(change, jump).reshape(box.shape)
        else:
            box += held.effect(k, l, local, move).reshape(box.shape)
        after = square(box, box)
        # The jumps at the knot itself are zero now but for rounding, which must not be chosen again.
        rest = after[r, s] if local is not None and not local.clears else 0.0
        after[r, s] = rest
        gain = float(dot(ones, (after - before).ravel()))
        value += gain
        before[...] = after
        if choice is not measure:
            # Nor what conditions do not let vanish.
            after[r, s] = 0.0
            around = board.around(k, l)
            open_box = choice[around]
            open_box[...] = after if allowed is None else after * allowed[around]
            if fence is not None:
                fence.keep_shut(k, l, board.jumps[around], open_box)
        steps += 1
        log.append(knot, multiplier, value)
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
        self._knots: list[int] = []
        self._multipliers = np.empty((BLOCK, *shape[2:]))
        self._values: list[float] = [value]
        self._filled, self._settled = 0, 0

    @property
    def full(self) -> bool:
        return self._filled == BLOCK

    def append(self, knot: int, multiplier: np.ndarray, value: float) -> None:
        i = self._filled
        self._knots.append(knot)
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
        self._knots.clear()

    def _add(self, start: int, stop: int) -> None:
        knots = np.array(self._knots[start:stop], dtype=int)
        np.add.at(self.total.reshape(-1, *self.total.shape[2:]), knots, self._multipliers[start:stop])

    def history(self) -> np.ndarray:
        return np.array(self._values)
