"""Multipliers as answers: what each keyframe costs, and which way to move it."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from symmotion import checks
from symmotion.errors import InputError
from symmotion.motions import Affine, Keyframes
from symmotion.solvers import Solution


@runtime_checkable
class Keyed(Protocol):
    """A design with affine keyframes."""

    @property
    def keyframes(self) -> Keyframes: ...


@dataclass(frozen=True, eq=False)
class KeyframePrices:
    """How the optimum f* changes with the keyframes: ∂f*/∂A*ᵢ = −λᵢ, ∂f*/∂v*ᵢ alike.

    gradient: linear (M, d, d) and translation (M, d), in units of the objective per unit of
        entry; turning: (M, 3) in space, (M,) in the plane, the change per radian of turning keyframe
        i about the fixed axes through its own origin.

    Raises InputError for a keyframe that does not exist, and other keyframes than these.

    >>> solution = sm.ExactNewton().solve(sm.affine_program(sm.examples.planar_keyframes())).require()
    >>> prices = sm.answers.keyframe_prices(solution)
    >>> cheaper = prices.downhill(prices.ranking[0], 0.01)
    >>> bool(prices.predict(cheaper) < 0)
    True
    """

    keyframes: Keyframes
    gradient: Affine

    def __repr__(self) -> str:
        dearest = ", ".join(f"{i} (‖λ‖ = {self.size[i]:.3g})" for i in self.ranking[:3])
        return f"KeyframePrices({len(self.keyframes)} keyframes in {self.keyframes.dimension}D, the dearest {dearest})"

    @property
    def size(self) -> np.ndarray:
        """(M,) ‖λᵢ‖ over all entries of a keyframe."""
        squares = (self.gradient.linear**2).sum(axis=(1, 2)) + (self.gradient.translation**2).sum(axis=1)
        return np.sqrt(squares)

    @property
    def ranking(self) -> np.ndarray:
        """(M,) the keyframes, the most expensive first."""
        return np.argsort(-self.size, kind="stable")

    @property
    def turning(self) -> np.ndarray:
        """(M, 3), in the plane (M,), change of the optimum per radian: ⟨∂f*/∂A*, [eₖ] A*⟩."""
        product = self.gradient.linear @ np.swapaxes(self.keyframes.linear, 1, 2)
        if self.keyframes.dimension == 2:
            return product[:, 1, 0] - product[:, 0, 1]
        pairs = ((2, 1), (0, 2), (1, 0))
        return np.stack([product[:, i, j] - product[:, j, i] for i, j in pairs], axis=1)

    def predict(self, keyframes: Keyframes) -> float:
        """First-order change of the optimum when the keyframes become these."""
        if len(keyframes) != len(self.keyframes) or keyframes.dimension != self.keyframes.dimension:
            raise InputError("the keyframes to compare with must be as many, in the same dimension")
        linear = np.sum(self.gradient.linear * (keyframes.linear - self.keyframes.linear))
        return float(linear + np.sum(self.gradient.translation * (keyframes.translation - self.keyframes.translation)))

    def downhill(self, i: int, length: float) -> Keyframes:
        """The keyframes with number i moved by `length` (Frobenius) the way that lowers the optimum fastest."""
        i = checks.index(i, len(self.keyframes), "keyframe")
        if not self.size[i] > 1e-12 * max(1.0, self.size.max()):
            raise InputError(f"keyframe {i} costs nothing: no direction lowers the optimum")
        share = -length / self.size[i]
        return self.keyframes.moved(
            i,
            self.keyframes.linear[i] + share * self.gradient.linear[i],
            self.keyframes.translation[i] + share * self.gradient.translation[i],
        )


def keyframe_prices(solution: Solution) -> KeyframePrices:
    """The prices of the keyframes at a solution; the multipliers with their sign turned.

    Raises InputError for solutions of programs that have no affine keyframes.

    >>> solution = sm.ExactNewton().solve(sm.affine_program(sm.examples.planar_keyframes())).require()
    >>> prices = sm.answers.keyframe_prices(solution)
    >>> bool(np.allclose(prices.gradient.linear, -solution.multipliers["keyframes"].linear))
    True
    """
    if not isinstance(solution, Solution):
        raise InputError(f"solution of type {type(solution).__name__}: a Solution is needed")
    design, multipliers = solution.program.design, solution.multipliers.get("keyframes")
    if not isinstance(design, Keyed) or not isinstance(multipliers, Affine):
        raise InputError("prices are of affine keyframes, and this program has none")
    return KeyframePrices(design.keyframes, Affine(-multipliers.linear, -multipliers.translation))
