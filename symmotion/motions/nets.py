"""Example nets of control displacements made by the project: smooth ones, and the same with noise."""

import numpy as np

from symmotion.errors import InputError
from symmotion.motions.dual import DualQuaternions, as_quaternion
from symmotion.motions.quaternions.algebra import product
from symmotion.motions.two_parameter import Knots, TwoParameterMotion


def smooth_net(
    n: int = 15, m: int | None = None, *, spatial: bool = False, knots: Knots = "uniform"
) -> TwoParameterMotion:
    """A smooth n × m net of unit control quaternions, m = n when left out, and translations over an arched patch.

    The same functions of (i/(n − 1), j/(m − 1)) for all sizes, so that a finer net is a fairer
    one; the unit of length is the distance between neighbouring controls.

    knots: "uniform", "clamped", "chordal" or "centripetal".

    spatial: whether there are translations, else it turns about the origin.

    Raises InputError for fewer controls than a cubic has, and knots that are none of these.

    >>> sm.motions.smooth_net(6)
    TwoParameterMotion(spherical, 6 × 6 controls of degrees 3 and 3, u 3 to 6, v 3 to 6)
    """
    m = n if m is None else m
    x, y = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, m), indexing="ij")
    turn = np.stack([0.75 * y + 0.15 * x * x, -0.65 * x + 0.1 * y * y, 0.5 * x + 0.35 * x * y], axis=-1)
    angle = np.linalg.norm(turn, axis=-1)
    half = 0.5 * angle[..., None]
    real = np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * turn], axis=-1)
    if not spatial:
        return TwoParameterMotion.from_displacements(DualQuaternions(real), knots, knots)
    place = np.stack([0.5 * (n - 1) * x, 0.5 * (m - 1) * y, 1.5 - x * x - 0.5 * y * y + 0.3 * x * y], axis=-1)
    return TwoParameterMotion.from_displacements(DualQuaternions.from_parts(real, place), knots, knots)


def noisy_net(
    motion: TwoParameterMotion,
    sigma: float,
    *,
    translation: float = 0.0,
    ring: bool = False,
    seed: int = 0,
) -> TwoParameterMotion:
    """The motion with normally distributed noise in its control quaternions, and in the controls' translations.

    sigma: standard deviation in every entry of a quaternion; translation: the same in every
    coordinate, in units of length; ring: whether the outermost controls get it too.

    seed: of the noise. Raises InputError for a σ that is negative.

    >>> net = sm.motions.noisy_net(sm.motions.smooth_net(6), 0.01, seed=1)
    >>> net.real.shape
    (6, 6, 4)
    """
    if not (sigma >= 0 and translation >= 0):
        raise InputError(f"noise of {sigma!r} and {translation!r}: numbers that are not negative are needed")
    rng = np.random.default_rng(seed)
    inside = np.zeros(motion.real.shape[:2])
    inside[(slice(None), slice(None)) if ring else (slice(1, -1), slice(1, -1))] = 1.0
    real = motion.real + sigma * inside[..., None] * rng.normal(size=motion.real.shape)
    if motion.dual is None:
        if translation:
            raise InputError("a spherical motion has no translations: translation = 0 is needed")
        return motion.with_controls(real, None)
    place = motion.control_displacements.translation
    place = place + translation * inside[..., None] * rng.normal(size=place.shape)
    return motion.with_controls(real, 0.5 * product(as_quaternion(place), real))
