"""How well the nodes of a program's terms integrate what they stand for."""

from dataclasses import dataclass

# What a quadrature error is small enough against: ten digits of the objective.
QUADRATURE = 1e-10
# From which share of its value on the error of a term leaves no digit of it.
NO_DIGIT = 0.1


@dataclass(frozen=True)
class Quadrature:
    """A term's value by its nodes, and by how much the integral itself may differ; zero where that is rounding.

    where: the keyframes or times between which the integrand is known least, and why, as messages go on.

    >>> solution = sm.ExactNewton().solve(sm.affine_program(sm.examples.planar_keyframes()))
    >>> solution.quadratures["R"].error
    0.0
    """

    value: float
    error: float
    where: str = ""

    @property
    def useless(self) -> bool:
        """Whether the error is as large as the value, up to its first digit."""
        return self.error > 0 and not self.error < NO_DIGIT * abs(self.value)
