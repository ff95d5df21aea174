"""Motions made by the project for the study of swept volumes: a circle, a brush, a loop and two balls."""

from dataclasses import dataclass

import numpy as np

import symmotion as sm
from symmotion.motions import Affine
from symmotion.sweeps import MovingEllipsoid

BALL = 4 / 3 * np.pi  # the volume of the unit ball


@dataclass(frozen=True)
class Circle:
    """A frame carried round the z axis at distance `radius`, which no polynomial spline does exactly."""

    radius: float
    turns: float = 1.0

    @property
    def dimension(self) -> int:
        return 3

    @property
    def domain(self) -> tuple[float, float]:
        return 0.0, 1.0

    def __call__(self, t, nu: int = 0) -> Affine:
        rate = 2 * np.pi * self.turns
        angle = rate * np.asarray(t, dtype=float) + nu * np.pi / 2
        o, size = np.zeros_like(angle), rate**nu
        out = size * np.stack([np.cos(angle), np.sin(angle), o], axis=-1)
        along = size * np.stack([-np.sin(angle), np.cos(angle), o], axis=-1)
        up = np.stack([o, o, o + (nu == 0)], axis=-1)
        return Affine(np.stack([out, along, up], axis=-1), self.radius * out)

    def trajectory(self, points, t, nu: int = 0) -> np.ndarray:
        linear, translation = self(t, nu)
        return translation[..., None, :] + np.atleast_2d(points) @ np.swapaxes(linear, -1, -2)


def letter_s() -> sm.Keyframes:
    """Nine positions of a brush along an S in the plane of x and z, turned with the path and wider in its middle."""
    upper, lower = np.deg2rad(np.arange(30, 271, 60)), np.deg2rad(np.arange(30, -151, -60))
    arcs = ((0.95, upper, 1, np.pi / 2), (-0.95, lower, -1, 1.5 * np.pi))
    x = np.concatenate([np.cos(a) for _, a, _, _ in arcs])
    z = np.concatenate([z0 + 0.95 * np.sin(a) for z0, a, _, _ in arcs])
    heading = np.concatenate([a + turn for _, a, _, turn in arcs])
    c, s, o = np.cos(heading), np.sin(heading), np.zeros_like(heading)
    turns = np.stack([np.stack([c, o, -s], -1), np.stack([o, o + 1, o], -1), np.stack([s, o, c], -1)], axis=-2)
    width = np.array([0.7, 0.8, 0.95, 1.15, 1.3, 1.15, 0.95, 0.8, 0.7])
    sizes = np.column_stack([o + 1, 0.5 + 0.5 * width, width])
    return sm.Keyframes.parametrised(turns * sizes[:, None], np.column_stack([1.1 * x, o, z]))


def loop() -> sm.Keyframes:
    """Seven positions of a ball that is stretched and thinned on a path that crosses itself."""
    s = np.linspace(-0.62, 0.62, 7) * 2 * np.pi
    path = np.column_stack([1.1 * s - 2.6 * np.sin(s), 2.2 * np.cos(s), 0.12 * s])
    slope = np.column_stack([1.1 - 2.6 * np.cos(s), -2.2 * np.sin(s)])
    along = slope / np.linalg.norm(slope, axis=1, keepdims=True)
    turns = np.zeros((7, 3, 3))
    turns[:, :2, 0], turns[:, 0, 1], turns[:, 1, 1], turns[:, 2, 2] = along, -along[:, 1], along[:, 0], 1
    sizes = 1 + 0.25 * np.column_stack([np.cos(s), -np.cos(s), np.sin(s)])
    return sm.Keyframes.parametrised(turns * sizes[:, None], path)


def breathing() -> sm.AffineMotion:
    """A ball that moves on evenly while it swells, shrinks and swells: here and there faster than it moves."""
    t = np.linspace(0, 1, 9)
    sizes = 0.8 - 0.45 * np.cos(4 * np.pi * t)
    values = np.column_stack([sizes[:, None] * np.eye(3).ravel(), 4 * t, 0 * t, 0 * t])
    return sm.AffineMotion.from_spline(sm.splines.cubic_interpolant(t, values), 3)


def kneaded() -> sm.AffineMotion:
    """A ball of nearly constant volume that hardly moves while it is drawn out and pressed flat."""
    t = np.linspace(0, 1, 9)
    stretch = np.exp(0.6 * np.sin(1.5 * np.pi * t))
    sizes = np.column_stack([stretch, stretch**-0.5, stretch**-0.5])
    values = np.column_stack([(sizes[:, :, None] * np.eye(3)).reshape(9, 9), 0.6 * t, 0 * t, 0.2 * t])
    return sm.AffineMotion.from_spline(sm.splines.cubic_interpolant(t, values), 3)


def closed_forms() -> dict[str, tuple[MovingEllipsoid, float, float | None]]:
    """Moving ellipsoids with the volumes that they sweep and the areas, None where there is no simple closed form."""
    skew, goes = np.array([[1.2, 0.3, 0.0], [0.0, 0.7, 0.2], [0.1, 0.0, 0.5]]), np.array([3.0, 1.0, -0.5])
    line = sm.splines.BSplineBasis.clamped([0, 1], 1)
    length, det = float(np.linalg.norm(goes)), float(np.linalg.det(skew))
    ends = np.array([0 * goes, goes])
    return {
        "translated ellipsoid": (
            MovingEllipsoid(sm.AffineMotion(line, np.array([skew, skew]), ends)),
            BALL * det + np.pi * det * float(np.linalg.norm(np.linalg.solve(skew, goes))),
            None,
        ),
        "capsule": (
            MovingEllipsoid(sm.AffineMotion(line, np.tile(np.eye(3), (2, 1, 1)), ends), 0.5),
            BALL / 8 + np.pi * length / 4,
            np.pi + np.pi * length,
        ),
        "torus": (MovingEllipsoid(Circle(2.0), 0.5), np.pi**2, 4 * np.pi**2),
    }
