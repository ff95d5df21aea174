"""What is said of a motion written to a file of keys."""

from dataclasses import dataclass
from pathlib import Path

from symmotion import checks
from symmotion.motions.motion import Moving

TOLERANCE = 1e-4


@dataclass(frozen=True)
class WrittenMotion:
    """A motion in a file of keys, and how far the file's motion is from it.

    path; route: what the keys are; keys: how many times; exact: whether the file's interpolation
    is the motion up to the rounding of its numbers; error: the largest distance found, between
    the keys too, of the body's outermost vertices from where the motion has them, in the
    motion's unit of length; size: the diagonal of the box about all their places.

    >>> motion = sm.interpolants.component_cubic(sm.examples.spatial_keyframes())
    >>> sm.files.write_gltf(motion, "motion.glb").exact
    True
    """

    path: Path
    route: str
    keys: int
    exact: bool
    error: float
    size: float

    @property
    def relative(self) -> float:
        """error / size."""
        return self.error / self.size

    def __str__(self) -> str:
        kind = "exact up to rounding" if self.exact else "sampled"
        return (
            f"{self.path}: {self.keys} {self.route}, {kind}, error {self.error:.2g} ({self.relative:.1g} of the size)"
        )

    def notes(self, start: float, rate: float) -> dict[str, object]:
        """What the file itself says: how it was made, its error, and the motion's time where its clock is at 0."""
        return {
            "generator": "symmotion",
            "route": self.route,
            "exact": self.exact,
            "keys": self.keys,
            "error": self.error,
            "size": self.size,
            "start": start,
            "secondsPerUnitOfTime": rate,
        }


def seconds_per_unit(motion: Moving, seconds: float | None, tolerance: float) -> float:
    """How many seconds of a file one unit of the motion's time is; InputError for bad seconds, tolerance or domain."""
    a, b = motion.domain
    checks.positive(tolerance, "tolerance")
    return 1.0 if seconds is None else checks.positive(seconds, "seconds") / (b - a)
