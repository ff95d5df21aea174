"""How far a control has gone: positive definite forms on displacements, one for all controls or one for each."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from symmotion import checks
from symmotion.brief import in_a_line
from symmotion.errors import InputError


@dataclass(frozen=True, eq=False)
class Metric:
    """|δ|² = Σ_ij δ_ijᵀ W_ij δ_ij with W_ij = scale_ij form, or scale_ij forms_ij.

    Without keyframes a local step does the same to every coordinate, and is the least move in all forms that
    controls share; so are the least squares in the identity. Any linear change of the coordinates, of frames, lengths
    and factors, then changes what comes out as it changes the net; only which knot is next, and the weight that leads
    to a target, depend on it. A form counts beside G in the least squares, at keyframes, and where it differs from
    control to control. Turning a frame changes nothing anywhere.

    scale: (n, m), None for ones; form: (C, C), None for the identity; forms: (n, m, C, C), None where one is for all.

    Raises InputError for weights and forms of other shapes, or not positive definite.

    >>> net = sm.motions.noisy_net(sm.motions.smooth_net(7), 0.01, seed=1)
    >>> sm.fair(net, "least-squares", weights=np.ones((7, 7))).status.value
    'solved'
    """

    scale: np.ndarray | None = None
    form: np.ndarray | None = None
    forms: np.ndarray | None = None

    __repr__ = in_a_line

    @staticmethod
    def of(shape: tuple[int, int, int], weights: ArrayLike | None = None, metric: ArrayLike | None = None) -> "Metric":
        """The metric on a net (n, m, C); InputError that names what is not positive definite.

        weights: (n, m), of a curve (n,), > 0. metric: (C, C), or one for each control, (n, m, C, C) or (n, C, C).
        """
        n, m, c = shape
        scale = form = forms = None
        if weights is not None:
            given = checks.numbers(weights, "weights")
            scale = given[:, None] if m == 1 and given.ndim == 1 else given
            if scale.shape != (n, m) or not (np.isfinite(scale) & (scale > 0)).all():
                needed = checks.shown((n,) if m == 1 else (n, m))
                raise InputError(
                    f"weights of shape {given.shape}: positive numbers {needed}, one a control, are needed"
                )
        if metric is not None:
            given = checks.numbers(metric, "metric")
            each = given[:, None] if m == 1 and given.ndim == 3 else given
            if each.shape not in ((c, c), (n, m, c, c)):
                raise InputError(f"metric of shape {given.shape}: ({c}, {c}), or one such for each control, is needed")
            _require_definite(each)
            form, forms = (each, None) if each.ndim == 2 else (None, each)
        return Metric(scale, form, forms)

    @property
    def uniform(self) -> bool:
        """Whether it is the same at every control."""
        return self.forms is None and (self.scale is None or bool((self.scale == self.scale.flat[0]).all()))

    def blocks(self, shape: tuple[int, int, int]) -> np.ndarray:
        """(n, m, C, C) W_ij."""
        n, m, c = shape
        forms = self.forms if self.forms is not None else np.eye(c) if self.form is None else self.form
        scale = np.ones((n, m)) if self.scale is None else self.scale
        return scale[..., None, None] * forms

    def times(self, net: np.ndarray) -> np.ndarray:
        """(n, m, C) W_ij δ_ij."""
        moved = net if self.form is None else net @ self.form
        if self.forms is not None:
            moved = np.einsum("ijab,ijb->ija", self.forms, net)
        return moved if self.scale is None else self.scale[..., None] * moved

    def shared(self, multipliers: np.ndarray) -> np.ndarray:
        """Multipliers (…, C) of steps in the identity, as those of the steps in this `uniform` metric."""
        scaled = multipliers if self.scale is None else self.scale.flat[0] * multipliers
        return scaled if self.form is None else scaled @ self.form

    @cached_property
    def principal(self) -> tuple[np.ndarray, np.ndarray] | None:
        """The eigenvalues (C,) and axes (C, C) of the form that all controls share, None where it is the identity."""
        if self.form is None:
            return None
        values, axes = np.linalg.eigh(self.form)
        return values, axes


def _require_definite(forms: np.ndarray) -> None:
    """InputError that names the first form that is not symmetric and positive definite."""
    if not np.isfinite(forms).all():
        raise InputError("metric: finite numbers are needed")
    size = np.abs(forms).max(axis=(-1, -2))
    crooked = np.abs(forms - np.swapaxes(forms, -1, -2)).max(axis=(-1, -2)) > 1e-12 * size
    least = np.linalg.eigvalsh(forms)[..., 0]
    for bad, word in ((crooked, "is not symmetric"), (least <= 1e-14 * size, "is not positive definite")):
        if np.any(bad):
            where = "" if forms.ndim == 2 else f" of control {tuple(np.argwhere(bad)[0].tolist())}"
            raise InputError(f"metric{where} {word}")
