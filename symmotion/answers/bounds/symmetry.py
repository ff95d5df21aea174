"""A symmetry of planar programs, by which the matrices of a relaxation fall into halves."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from symmotion.design.affine import AffineDesign
from symmotion.program import Program

# What unknowns of a centre, relative to the largest, may differ by from their images to be rounding.
NEAR = 1e-6


@dataclass(frozen=True, eq=False)
class Symmetry:
    """Numbers u go to sign · u[image]; done twice that is nothing. image, sign: (free,).

    Linear maps of the plane are z → a z + b z̄ with complex numbers a, b, and b = 0 is a turn that scales. Rigidity is
    the same for −b, and so are conditions that turn and scale.
    """

    image: np.ndarray
    sign: np.ndarray

    @staticmethod
    def of(program: Program, size: int) -> "Symmetry | None":
        """That of planar affine programs in `size` numbers, coordinates of one control after those of the other."""
        design = program.design
        if not isinstance(design, AffineDesign) or design.keyframes.dimension != 2 or size % design.channels:
            return None
        # [[A₁₁, A₁₂], [A₂₁, A₂₂]] → [[A₂₂, −A₂₁], [−A₁₂, A₁₁]]
        image, sign = np.arange(design.channels), np.ones(design.channels)
        image[:4], sign[1:3] = [3, 2, 1, 0], -1.0
        controls = size // design.channels
        first = np.repeat(np.arange(controls) * design.channels, design.channels)
        return Symmetry(first + np.tile(image, controls), np.tile(sign, controls))

    def centred(self, x: np.ndarray) -> np.ndarray:
        """x, or the middle between it and its image where these are one up to rounding."""
        other = self.sign * x[self.image]
        return (x + other) / 2 if np.abs(x - other).max() <= NEAR * np.abs(x).max() else x

    @cached_property
    def _numbered(self) -> tuple[np.ndarray, np.ndarray]:
        return np.r_[0, self.image + 1], np.r_[1.0, self.sign]

    def product(self, factors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The image and the sign of products of factors (…, k), numbered from one, 0 for none."""
        image, sign = self._numbered
        return image[factors], sign[factors].prod(axis=-1)


def halves(image: np.ndarray, sign: np.ndarray) -> list[sparse.csr_array]:
    """Orthonormal rows (…, N) of what stays as it is, and of what changes its sign, under v → sign · v[image]."""
    here = np.arange(len(image))
    found = []
    for parity in (1.0, -1.0):
        first = np.flatnonzero((here < image) | ((here == image) & (sign == parity)))
        pair = image[first] != first
        weight = np.where(pair, np.sqrt(0.5), 1.0)
        rows, second = np.arange(len(first)), np.flatnonzero(pair)
        values = np.r_[weight, parity * (sign[first] * weight)[second]]
        columns = np.r_[first, image[first][second]]
        found.append(sparse.csr_array((values, (np.r_[rows, second], columns)), shape=(len(first), len(image))))
    return [half for half in found if half.shape[0]]
