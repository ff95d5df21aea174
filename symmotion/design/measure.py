"""The value of an energy for a motion that is there, to ten digits or with the reason why not."""

import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.brief import instants
from symmotion.design.integrals import KNOWN, Integrand, exact_integral, integrand
from symmotion.energies import Energy
from symmotion.errors import InputError, SolveError
from symmotion.jets.linear import space_of
from symmotion.jets.seen import Called
from symmotion.motions import AffineMotion
from symmotion.splines import Integral, Spline, SplineLike


class Measured(float):
    """A number that knows how well it is known. error: by how much it may be off, rounding included."""

    error: float

    def __new__(cls, value: float, error: float = 0.0) -> "Measured":
        number = super().__new__(cls, value)
        number.error = error
        return number

    def __reduce__(self):
        return Measured, (float(self), self.error)


def measure(motion: Called | SplineLike, energy: Energy, *, times: ArrayLike | None = None) -> Measured:
    """The value of an energy for a motion or curve of any kind: a float, whose `error` says how well it is known.

    ∫ φ dt, exact where φ is a polynomial, else to ten digits of ∫ |φ| dt, or as many as the rounding of the motion's
    derivatives and of its times leaves: spans are halved where halves and whole do not agree.

    motion: affine, orientation, pose or curve; or any motion with derivatives, called with (t, order), and of such
    alone times: (M,) increasing, between which it is smooth (its breakpoints when left out). What a kink itself would
    add (a jump of a derivative that the energy differentiates) does not count.

    Raises InputError that names the times between which the integral is infinite or has no value, as that of S where
    A is singular, and SolveError that says how many digits there are where an integrand is too rough for ten.

        value = sm.measure(motion, sm.StrainRate())
        print(value, value.error)

    >>> motion = sm.interpolants.component_cubic(sm.examples.quarter_turn())
    >>> value = sm.measure(motion, sm.Rigidity(2))
    >>> round(value, 6), value.error < 1e-9
    (32.0, True)
    """
    if not isinstance(energy, Energy):
        swapped = ": the motion comes first, then the energy" if isinstance(motion, Energy) else ""
        raise InputError(f"energy {energy!r} is no energy{swapped}")
    marks = None
    if callable(motion) and hasattr(motion, "dimension") and not isinstance(motion, KNOWN):
        marks = getattr(motion, "breakpoints", None) if times is None else times
        if marks is None:
            raise InputError(
                f"times: the {type(motion).__name__} has no breakpoints; say between which times it is smooth"
            )
        marks = checks.times(marks, "times", 2)
    elif times is not None:
        raise InputError(f"times: a {type(motion).__name__} knows where it is smooth: leave them out")
    elif not isinstance(motion, KNOWN):
        if not isinstance(motion, SplineLike):
            raise InputError(f"motion: a {type(motion).__name__} is no motion or curve; measure(motion, energy)")
        motion = motion.to_bspline()
    value = error = 0.0
    for weight, part in energy.parts:
        if weight:
            parts, off = _measured(motion, part, marks)
            value, error = value + weight * float(parts.sum()), error + abs(weight) * off
    return Measured(value, error)


def span_values(motion: AffineMotion | Spline, energy: Energy) -> np.ndarray:
    """(S,) what each span of a motion adds to the value of an energy; raises as `measure`."""
    return np.sum([weight * _measured(motion, part, None)[0] for weight, part in energy.parts if weight], axis=0)


def _measured(motion: Called, energy: Energy, marks: np.ndarray | None) -> tuple[np.ndarray, float]:
    """(S,) the value of an energy by spans, and the error of the sum."""
    if energy.exact and isinstance(motion, AffineMotion | Spline):
        return exact_integral(energy, *space_of(motion))
    where = integrand(motion, energy, marks)
    found = where.integral()
    if not found.reached:
        raise amiss(where, found)
    return found.parts, found.error


def amiss(where: Integrand, found: Integral) -> InputError | SolveError:
    """What is wrong with an integral that has not the digits asked for."""
    energy, (a, b) = where.energy, found.worst
    k = int(np.clip(np.searchsorted(where.marks, a, side="right") - 1, 0, len(where.marks) - 2))
    marks, middle = where.origin + where.marks, where.origin + 0.5 * (a + b)
    first, last, at = instants(marks[k], marks[k + 1], middle)
    span = f"between times {first} and {last}"
    if not found.digits:
        reason = "A is singular" if energy.divides_by_volume else "the integrand is infinite, no number or too rough"
        return InputError(f"{energy.name} has no value {span}: at time {at} {reason}")
    return SolveError(
        f"{energy.name} is {found.value:.10g} to {found.digits} digits only (error {found.error:.2g}): the integrand "
        f"is too rough {span}, about {at}"
    )
