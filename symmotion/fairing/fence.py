"""Tolerances of controls under local steps: what is forbidden, and for how long that is known."""

import numpy as np

from symmotion.fairing.held_steps import LocalStep
from symmotion.fairing.jumps import StepTables

WIDE = 5  # controls that the jumps at a knot read in each direction


class Fence:
    """How far the controls have gone, and whether a step keeps them within their tolerances.

    A step that is forbidden has a witness, a control that it would take too far. Steps nearby change what it
    would do to that control; while that is still too far, the step is known to be forbidden and is not tried.
    """

    def __init__(
        self,
        tables: StepTables,
        tolerance: np.ndarray,
        coordinates: int,
        padded: tuple[int, ...],
        gone: np.ndarray | None = None,
    ):
        self.limit = tolerance**2
        self.gone = np.zeros((*tolerance.shape, coordinates)) if gone is None else gone.copy()
        u, v = tables.jumps.u, tables.jumps.v
        self.u = _window(u.moved(tables.step)), _window(u.values)
        self.v = _window(v.moved(tables.step)), _window(v.values)
        self.window = self.u[0].shape[1], self.v[0].shape[1]
        self.kinds, self.coordinates = tables.jumps.kinds, coordinates
        self.reach, self.solve = tables.reach, tables.solve
        self.each = np.eye(coordinates)
        # By knot: (a b, kinds) how its step moves the controls, made where first asked for.
        self.moves: dict[tuple[int, int], np.ndarray] = {}
        # By knot, padded as the board is: whether there is a witness, which control, and its move by the jumps.
        self.shut = np.zeros(padded, dtype=bool)
        self.witness = np.zeros(padded, dtype=int)
        self.factors = np.zeros((*padded, coordinates, self.kinds * coordinates))

    def admits(self, k: int, l: int, multiplier: np.ndarray) -> bool:  # noqa: E741
        """Take the step of these multipliers (kinds, C) if no control leaves its tolerance, else shut it."""
        each = self.moves.get((k, l))
        if each is None:
            each = self.moves[k, l] = self._moves(k, l)
        move = np.dot(each, multiplier).reshape(*self.window, self.coordinates)
        place = slice(k, k + self.window[0]), slice(l, l + self.window[1])
        worst = self._worst(place, move)
        if worst is None:
            return True
        row = np.dot(each[worst[0] * self.window[1] + worst[1]], self.solve[k, l])
        self._shut(k, l, place, worst, (self.each[:, None] * row[:, None]).reshape(self.coordinates, -1))
        return False

    def takes(self, k: int, l: int, local: LocalStep, move: np.ndarray) -> bool:  # noqa: E741
        """The same of a step that conditions change, and its move (a, b, C)."""
        worst = self._worst(local.place, move)
        if worst is not None:
            self._shut(k, l, local.place, worst, local.move[worst] @ local.solve)
        return worst is None

    def _moves(self, k: int, l: int) -> np.ndarray:  # noqa: E741
        (a, n), (b, w) = self.u, self.v
        parts = [np.outer(a[k], w[l]).ravel()]
        if self.kinds == 2:
            parts.append(np.outer(n[k], b[l]).ravel())
        return -np.stack(parts, axis=1)

    def _worst(self, place: tuple[slice, slice], move: np.ndarray) -> tuple[int, int] | None:
        """Make a move if no control leaves its tolerance, else which one leaves it furthest."""
        there = self.gone[place] + move
        excess = np.einsum("abc,abc->ab", there, there) - self.limit[place]
        i, j = divmod(int(excess.argmax()), excess.shape[1])
        if excess[i, j] > 0:
            return i, j
        self.gone[place] = there
        return None

    def _shut(self, k: int, l: int, place: tuple[slice, slice], worst: tuple[int, int], factors: np.ndarray) -> None:  # noqa: E741
        knot = k + self.reach[0], l + self.reach[1]
        self.shut[knot] = True
        self.witness[knot] = (place[0].start + worst[0]) * self.limit.shape[1] + place[1].start + worst[1]
        self.factors[knot] = factors

    def keep_shut(self, k: int, l: int, jumps: np.ndarray, choice: np.ndarray) -> None:  # noqa: E741
        """Around a knot at which a step was made, leave out of the choice what its witness still forbids.

        jumps: (2r + 1, 2s + 1, kinds, C) after the step.
        """
        r, s = self.reach
        shut = self.shut[k : k + 2 * r + 1, l : l + 2 * s + 1]
        rows, columns = shut.nonzero()
        if not len(rows):
            return
        at = rows + k, columns + l
        there = jumps[rows, columns].reshape(len(rows), -1, 1)
        moved = self.gone.reshape(-1, self.coordinates)[self.witness[at]] + (self.factors[at] @ there)[..., 0]
        still = np.einsum("pc,pc->p", moved, moved) > self.limit.ravel()[self.witness[at]]
        choice[rows[still], columns[still]] = 0.0
        shut[rows[~still], columns[~still]] = False


def _window(rows: np.ndarray) -> np.ndarray:
    """(K, 5) the coefficients of the controls that each knot reads, (1, 1) for the other direction of a curve."""
    if rows.shape[1] == 1:
        return np.ones((1, 1))
    return np.stack([row[k : k + WIDE] for k, row in enumerate(rows)])
