"""What fairing returns, whatever the method."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Generic

import numpy as np

from symmotion.errors import SolveError
from symmotion.fairing.coordinates import AnyMotion
from symmotion.pictures import as_html, plot_fairing
from symmotion.systems import Certificate


class FairingStatus(StrEnum):
    """How fairing ended.

    TARGET: G is at the target or below; SOLVED: the global problem is solved; MINIMUM: G went up
    again for good, or within tolerances did not fall any more, and the best net was kept; CAP: the cap on steps was
    reached; EXHAUSTED: no step is left that the tolerance allows; STALLED: a step changed G by less than was
    asked for, PCG (23); FAILED: a solver failed.

    >>> result = sm.fair(sm.motions.noisy_net(sm.motions.smooth_net(7), 0.01, seed=1), max_steps=3)
    >>> result.status is sm.fairing.FairingStatus.CAP
    True
    """

    TARGET = "target"
    SOLVED = "solved"
    MINIMUM = "minimum"
    CAP = "cap"
    EXHAUSTED = "exhausted"
    STALLED = "stalled"
    FAILED = "failed"


@dataclass(frozen=True, eq=False)
class FairingResult(Generic[AnyMotion]):
    """A faired motion and how it came about.

    G and L are in squared units of the faired coordinates (of quaternions as scaled as the
    controls are, of lengths over `length`) by the sixth power of the units of u and v.

    motion: the best one found; start: the one given; method: its name; status; message.
    history: (steps + 1,) G of the start, that with keyframes and borders met, and after every step, also those after
        the best net.
    before, after: (K, L) the local measures L_kl at the interior knots; of a curve (K,).
    displacement: (n, m) how far each control went, in units of the faired coordinates; of a curve (n,).
    multipliers: "jumps" (K, L, 2, C) the λ and μ of the steps up to the best net, summed for each
        knot; of the global methods one row per jump or control of each constraint.
    certificate: the worst of the programs solved, None where none was.
    steps: local steps taken, or iterations of the solver; best_step: that of the motion.
    discarded: steps tried that the tolerance forbade; weight: w of the least squares.
    keyframe_weights: (M,) κ of each keyframe, D(u, v) = κ D* with Q* of length 1, NaN where there is none.

    Of a keyframe multipliers["keyframes"] (M, d) are what it costs: with another D* + η, both parts over the length of
    Q* and the dual one over `length`, the objective changes by −κ λ · η (with a weight given, by −w λ · η).

    seconds: wall-clock.

    >>> result = sm.fair(sm.motions.noisy_net(sm.motions.smooth_net(7), 0.01, seed=1), max_steps=20)
    >>> result.final < result.initial
    True
    """

    motion: AnyMotion
    start: AnyMotion
    method: str
    status: FairingStatus
    history: np.ndarray
    before: np.ndarray
    after: np.ndarray
    displacement: np.ndarray
    multipliers: Mapping[str, np.ndarray]
    certificate: Certificate | None
    steps: int
    best_step: int
    seconds: float
    discarded: int = 0
    weight: float | None = None
    keyframe_weights: np.ndarray = field(default_factory=lambda: np.zeros(0))
    message: str = ""

    @property
    def initial(self) -> float:
        """G of the start."""
        return float(self.before.sum())

    @property
    def final(self) -> float:
        """G of the motion, summed afresh."""
        return float(self.after.sum())

    def require(self, target: float | None = None) -> "FairingResult[AnyMotion]":
        """This result, if no solver failed and G is at most `target`, where one is given; else SolveError."""
        if self.status == FairingStatus.FAILED:
            raise SolveError(f"fairing by {self.method} failed: {self.message}")
        if target is not None and not self.final <= target * (1 + 1e-9):
            raise SolveError(
                f"fairing by {self.method} ended with G = {self.final:.4g} above the target {target:g} "
                f"({self.status} after {self.steps} steps)"
            )
        return self

    plot = plot_fairing
    _repr_html_ = as_html

    def __repr__(self) -> str:
        return (
            f"FairingResult({self.method}: {self.status}, G {self.initial:.4g} → {self.final:.4g} at step "
            f"{self.best_step} of {self.steps}, displacement up to {self.displacement.max():.3g}, {self.seconds:.3g} s)"
        )
