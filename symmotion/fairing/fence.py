"""Tolerances of controls under local steps: what is forbidden, and for how long that is known."""

import numpy as np

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
        self.kinds = tables.jumps.kinds
        self.reach, self.solve = tables.reach, tables.solve
        # By knot, padded as the board is: whether there is a witness, which control, and its move per multiplier.
        self.shut = np.zeros(padded, dtype=bool)
        self.witness = np.zeros(padded, dtype=int)
        self.factors = np.zeros((*padded, self.kinds))

    def admits(self, k: int, l: int, multiplier: np.ndarray) -> bool:  # noqa: E741
        """Take the step if no control leaves its tolerance, else shut it, with its witness."""
        (a, n), (b, w) = self.u, self.v
        first = np.outer(a[k], w[l])
        move = np.multiply.outer(first, multiplier[0])
        second = None
        if self.kinds == 2:
            second = np.outer(n[k], b[l])
            move += np.multiply.outer(second, multiplier[1])
        place = slice(k, k + move.shape[0]), slice(l, l + move.shape[1])
        there = self.gone[place] - move
        excess = np.einsum("abc,abc->ab", there, there) - self.limit[place]
        worst = int(excess.argmax())
        i, j = divmod(worst, excess.shape[1])
        if not excess[i, j] > 0:
            self.gone[place] = there
            return True
        knot = k + self.reach[0], l + self.reach[1]
        self.shut[knot] = True
        self.witness[knot] = (k + i) * self.limit.shape[1] + l + j
        self.factors[knot] = first[i, j] if second is None else (first[i, j], second[i, j])
        return False

    def takes(self, place: tuple[slice, slice], move: np.ndarray) -> bool:
        """Make a move (a, b, C) if no control leaves its tolerance."""
        there = self.gone[place] + move
        if (np.einsum("abc,abc->ab", there, there) > self.limit[place]).any():
            return False
        self.gone[place] = there
        return True

    def keep_shut(self, k: int, l: int, jumps: np.ndarray, choice: np.ndarray) -> None:  # noqa: E741
        """Around a knot at which a step was made, leave out of the choice what its witness still forbids.

        jumps: (2r + 1, 2s + 1, kinds, C) after the step.
        """
        r, s = self.reach
        near = slice(k, k + 2 * r + 1), slice(l, l + 2 * s + 1)
        shut = self.shut[near]
        if not shut.any():
            return
        rows, columns = np.nonzero(shut)
        at = rows + k, columns + l
        multipliers = np.einsum("pij,pjc->pic", self.solve[at[0] - r, at[1] - s], jumps[rows, columns])
        moves = np.einsum("pi,pic->pc", self.factors[at], multipliers)
        witness = self.witness[at]
        there = self.gone.reshape(-1, self.gone.shape[-1])[witness] - moves
        still = np.einsum("pc,pc->p", there, there) > self.limit.ravel()[witness]
        choice[rows[still], columns[still]] = 0.0
        self.shut[at[0][~still], at[1][~still]] = False


def _window(rows: np.ndarray) -> np.ndarray:
    """(K, 5) the coefficients of the controls that each knot reads, (1, 1) for the other direction of a curve."""
    if rows.shape[1] == 1:
        return np.ones((1, 1))
    return np.stack([row[k : k + WIDE] for k, row in enumerate(rows)])
