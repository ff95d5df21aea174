"""Quaternion curves as products of turns about fixed axes: the cumulative form over any basis, in both frames (KKS)."""

from dataclasses import replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from symmotion.brief import between
from symmotion.checks import numbers
from symmotion.errors import InputError
from symmotion.motions.quaternions.algebra import (
    Signs,
    aligned,
    as_quaternions,
    conjugate,
    exp,
    increments_between,
    product,
)
from symmotion.motions.quaternions.jets import Chain, evaluate
from symmotion.motions.quaternions.turning import (
    Frame,
    QuaternionJet,
    acceleration,
    asked,
    checked_frame,
    derivative,
    jerk,
    matrix,
    rate,
    rotation,
    trajectory,
)
from symmotion.pictures import as_html, plot_rates
from symmotion.saving import save
from symmotion.splines import BSplineBasis, CumulativeBasis, Spline
from symmotion.values import read_only, value

if TYPE_CHECKING:
    from symmotion.motions.rotations import Rotations


@value
class ProductMotion:
    """The unit quaternion curve q(t) = q_0 exp(ω_1 F_1(t)) … exp(ω_n F_n(t)) over any functions F_i (KKS (7)).

    functions: the F_i; start: (4,) q_0, scalar first; increments: (n, 3) half-angle vectors ω_i.
    frame: the one that the ω_i are measured in. "body" is the product above; in the "world" it is the other way
        round, exp(ω_n F_n(t)) … exp(ω_1 F_1(t)) q_0 (KKS 2.1).

    It is as smooth as the functions are, changes with an increment where its function changes and behind, and turns
    about any increment as far as that is long.

    Raises InputError for other shapes, frames and lengths, and for times outside.

    >>> times, quaternions = [0.0, 1.0, 3.0], sm.examples.random_keyframes(3, 60, seed=1).rotations()
    >>> catmull_rom = sm.quaternions.ProductMotion.over(sm.curves.catmull_rom(times, np.eye(3)), quaternions)
    >>> bool(catmull_rom.rotation(times).approx_equal(quaternions, atol=1e-12).all())
    True
    """

    functions: CumulativeBasis
    start: np.ndarray
    increments: np.ndarray
    frame: Frame = "body"

    def __post_init__(self):
        start, increments = numbers(self.start, "start"), numbers(self.increments, "increments")
        if start.shape != (4,):
            raise InputError(f"start of shape {start.shape}: one unit quaternion, (4,), is needed")
        if increments.shape != (self.functions.n, 3) or not np.isfinite(increments).all():
            raise InputError(f"increments of shape {increments.shape}: finite, ({self.functions.n}, 3) is needed")
        checked_frame(self.frame)
        object.__setattr__(self, "start", read_only(as_quaternions(start[None], "start")[0]))
        object.__setattr__(self, "increments", read_only(increments))

    @staticmethod
    def over(
        basis: Spline | BSplineBasis,
        control_quaternions: "Rotations",
        turns: ArrayLike | None = None,
        signs: Signs = "align",
        frame: Frame = "body",
        *,
        scalar_first: bool = True,
    ) -> "ProductMotion":
        """The cumulative form over any functions B_0 … B_n that sum to one, F_i = Σ_{j ≥ i} B_j.

        basis: a spline with control points (N, n + 1), which a curve through the rows of a unit matrix is:
            `curves.kochanek_bartels(times, np.eye(n + 1), tension)` gives cardinal curves, and
            `splines.cubic_interpolant(times, np.eye(n + 1))` C² curves without solving for controls; or B-splines.
            Where B_i is 1 at t_i, and the others 0, the curve interpolates.
        control_quaternions: (n + 1, 4), scalar first unless `scalar_first` says else, matrices, or a `Rotation`.
        turns: (n,) physical turns added to each increment along its own direction; signs: as in `aligned`; frame:
            that of the increments.
        """
        functions = CumulativeBasis.of(basis)
        q = as_quaternions(control_quaternions, "control quaternion", least=2, scalar_first=scalar_first)
        if len(q) != functions.n + 1:
            raise InputError(f"{len(q)} control quaternions for {functions.n + 1} functions: as many are needed")
        q = aligned(q, signs, "control quaternion")
        if checked_frame(frame) == "world":
            ways = -increments_between(conjugate(q), turns, "control quaternion")
        else:
            ways = increments_between(q, turns, "control quaternion")
        return ProductMotion(functions, q[0], ways, frame)

    @property
    def dimension(self) -> int:
        """Of the space that the body is in: 3."""
        return 3

    @property
    def basis(self) -> BSplineBasis:
        """The B-splines that the functions are made of."""
        return self.functions.basis

    @property
    def degree(self) -> int:
        """The degree of the functions F_i, which are splines."""
        return self.basis.degree

    @property
    def domain(self) -> tuple[float, float]:
        """First and last time."""
        return self.basis.domain

    @property
    def breakpoints(self) -> np.ndarray:
        """(K,) the borders of the spans, ends of the domain included."""
        return self.basis.breakpoints

    @cached_property
    def relative(self) -> "ProductMotion":
        """The same curve with its origin in time at zero: its times count from the origin on."""
        return self if self.basis.origin == 0 else replace(self, functions=self.functions.relative)

    def __repr__(self) -> str:
        a, b = self.domain
        return f"ProductMotion({self.functions.n} factors in the {self.frame} frame, times {between(a, b)})"

    @cached_property
    def _table(self) -> tuple[np.ndarray, np.ndarray]:
        """In the body's frame where the product has come to (4, n + 1), and axes with half angles (4, n + 1) behind."""
        increments = self.increments if self.frame == "body" else -self.increments
        reached = [self.start if self.frame == "body" else conjugate(self.start)]
        for step in exp(increments * self.functions.weights[:, -1:]):
            reached.append(product(reached[-1], step))
        angle = np.linalg.norm(increments, axis=1)
        axis = increments / np.where(angle > 0, angle, 1.0)[:, None]
        factors = np.concatenate([axis.T, angle[None]])
        return np.array(reached).T, np.concatenate([factors, np.zeros((4, 1))], axis=1)

    def jet(self, t: ArrayLike, order: int = 2, frame: Frame = "body") -> QuaternionJet:
        """Orientation with its angular rates up to `order` (≤ 3) at times t, in one pass; in the body's or world frame.

        InputError outside the domain.
        """
        t, world = asked(t, order, frame)
        # Increments of the world are those of the inverse turn, which has them in its body: its rates are turned round.
        mirrored = self.frame == "world"
        q, rates = evaluate(partial(_factors, self.functions, self._table), t.ravel(), order, world != mirrored)
        if mirrored:
            q, rates = conjugate(q), [-r for r in rates]
        return QuaternionJet(q.reshape(*t.shape, 4), *(r.reshape(*t.shape, 3) for r in rates))

    __call__ = derivative
    matrix = matrix
    trajectory = trajectory
    rotation = rotation
    rate = rate
    acceleration = acceleration
    jerk = jerk
    save = save
    plot = plot_rates
    _repr_html_ = as_html


def _factors(functions: CumulativeBasis, table: tuple[np.ndarray, np.ndarray], t: np.ndarray, order: int) -> Chain:
    reached, increments = table
    first, values = functions.local(t, order)
    place = np.minimum(first[:, None] + np.arange(values[0].shape[1]), functions.n)
    return [c[first] for c in reached], (
        ([row[place[:, k]] for row in increments], [v[:, k] for v in values]) for k in range(place.shape[1])
    )
