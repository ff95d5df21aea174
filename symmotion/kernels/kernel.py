"""Kernels: the small symbolic functions that programs are made of, and their derivatives."""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from sys import intern

import casadi as ca

from symmotion.kernels.hessians import LONG, second_order
from symmotion.kernels.packing import packed


@dataclass(frozen=True, eq=False)
class Kernel:
    """A small function of a few local unknowns z, applied at many nodes of a program.

    z: (rows · channels, 1) symbols: `rows` combinations of controls, each with `channels`
        coordinates, row by row; data: (D, 1) symbols that differ from node to node.
    out: (C, 1) expression of z and data: the residuals or the integrand of a term, or the
        components of a constraint.
    squares: whether a term is the sum of the squares of `out` (else the sum of `out`).

    >>> kernel = sm.affine_program(sm.examples.planar_keyframes()).terms[0].kernel
    >>> kernel
    Kernel(squares of 3 quadratic expressions of 8 local values)
    """

    z: ca.SX
    data: ca.SX
    out: ca.SX
    channels: int
    squares: bool = False

    def __repr__(self) -> str:
        return f"Kernel({self.nature})"

    @property
    def nature(self) -> str:
        """What it is, in words."""
        order = "linear" if self.linear else "quadratic" if self.quartic else "nonlinear"
        expressions = f"{self.out.numel()} {order} expression{'s' * (self.out.numel() != 1)}"
        return f"{'squares of ' * self.squares}{expressions} of {self.z.numel()} local values"

    @property
    def rows(self) -> int:
        """How many combinations of controls it reads at a node."""
        return self.z.numel() // self.channels

    @cached_property
    def code(self) -> str:
        """The kernel as text, the same for equal kernels: the key of the compile cache."""
        return ca.Function("kernel", [self.z, self.data], [ca.densify(self.out)]).serialize()

    @cached_property
    def linear(self) -> bool:
        """Whether `out` is an affine function of z."""
        return bool(ca.is_linear(self.out, self.z))

    @cached_property
    def constant(self) -> bool:
        """Whether the Hessian of a term is the same for all z: of the squares of what is affine."""
        return self.squares and self.linear

    @cached_property
    def bilinear(self) -> bool:
        """Whether the slopes of `out` by z depend on the data."""
        slopes = ca.vec(ca.jacobian(self.out, self.z))
        return bool(self.data.numel()) and bool(ca.depends_on(slopes, self.data))

    @cached_property
    def quartic(self) -> bool:
        """Whether the term is a polynomial of degree four or less along every line."""
        return bool(ca.is_linear(ca.vec(ca.jacobian(self.out, self.z)), self.z))

    def function(self, kind: str) -> ca.Function:
        """One of the functions of `derive`, made once for all equal kernels."""
        return derive(self.code, kind, self.channels, self.squares)

    def __reduce__(self):
        # Symbols do not pickle. Equal texts become one object, which a pickle of many programs holds once.
        return written_kernel, (intern(self.code), self.channels, self.squares)


@lru_cache(maxsize=512)
def written_kernel(code: str, channels: int, squares: bool) -> Kernel:
    """The kernel of a text that `Kernel.code` gave, the same object for equal texts."""
    z, data, out = _written(code)
    kernel = Kernel(z, data, out, channels, squares)
    # With symbols of other names the text would be another, and what is compiled under this one not found.
    kernel.__dict__["code"] = code
    return kernel


def _written(code: str) -> tuple[ca.SX, ca.SX, ca.SX]:
    """z, data and out of a kernel that `Kernel.code` is the text of."""
    base = ca.Function.deserialize(code)
    z, data = ca.SX.sym("z", base.size1_in(0)), ca.SX.sym("data", base.size1_in(1))
    return z, data, base(z, data)


@lru_cache(maxsize=512)
def derive(code: str, kind: str, channels: int, squares: bool) -> ca.Function:
    """A derivative of a kernel as a CasADi function of (z, data, mu), "hessian" of (z, data, mu, theta) too.

    The scalar in question is φ = Σ out² with `squares`, else muᵀ out. Kinds:
    "out" (C,); "value" φ; "gradient" ∂φ/∂z, row by row;
    "hessian" ∂²φ/∂z², packed (see `packing`; of a sum of squares the Gauss–Newton part plus theta times the rest), and
    the gradient beside it;
    "jacobian" ∂out/∂z, (C, rows · channels) by rows;
    "barrier" of (z, data, mu, theta, sigma): θ ∂²(muᵀ out)/∂z² + Jᵀ diag(sigma) J, packed too, J = ∂out/∂z, and
    the gradient of muᵀ out beside it;
    "mixed" ∂²φ/∂z∂data, (rows · channels, D) by rows; "shift" ∂φ/∂data, (D,); "data" ∂out/∂data, (C, D) by rows;
    "rounding" ‖|J| mu‖², mu having the shape of z: the square of what `out` sums up;
    "along" J mu, (C,), and "line" the five coefficients of φ along z + α mu, for out up to quadratic, mu having the
    shape of z in both.
    """
    z, data, out = _written(code)
    mu = ca.SX.sym("mu", out.numel())
    theta, sigma = ca.SX.sym("theta"), ca.SX.sym("sigma", out.numel())
    phi = ca.sumsqr(out) if squares else ca.dot(mu, out)
    if kind in ("along", "line", "rounding"):
        mu = ca.SX.sym("mu", z.numel())
    inputs, outputs = [z, data, mu], []
    if kind == "out":
        result = out
    elif kind == "value":
        result = phi
    elif kind == "gradient":
        result = ca.gradient(phi, z)
    elif kind in ("hessian", "barrier"):
        hessian, gradient = second_order(z, data, out, squares, theta, mu, sigma if kind == "barrier" else None)
        # One triangle is computed: CasADi does not see that the two are equal.
        result = packed(ca.triu(hessian), channels)
        inputs, outputs = [*inputs, theta, *([sigma] if kind == "barrier" else [])], [gradient]
    elif kind == "jacobian":
        result = ca.vec(ca.densify(ca.jacobian(out, z)).T)
    elif kind == "mixed":
        result = ca.vec(ca.densify(ca.jacobian(ca.gradient(phi, z), data)).T)
    elif kind == "shift":
        result = ca.gradient(phi, data)
    elif kind == "data":
        result = ca.vec(ca.densify(ca.jacobian(out, data)).T)
    elif kind == "rounding":
        result = ca.sumsqr(ca.fabs(ca.jacobian(out, z)) @ mu)
    elif kind == "along":
        result = ca.jtimes(out, z, mu)
    elif kind == "line":
        first = ca.jtimes(out, z, mu)
        second = ca.jtimes(first, z, mu) / 2
        if squares:
            dot = ca.dot
            middle = dot(first, first) + 2 * dot(out, second)
            result = ca.vertcat(dot(out, out), 2 * dot(out, first), middle, 2 * dot(first, second), dot(second, second))
        else:
            result = ca.vertcat(ca.sum1(out), ca.sum1(first), ca.sum1(second), 0, 0)
    else:
        raise ValueError(f"no derivative {kind!r}")
    outputs = [ca.densify(o) for o in (result, *outputs)]
    plain = ca.Function("kernel", inputs, outputs)
    return plain if plain.n_instructions() > LONG else ca.Function("kernel", inputs, ca.cse(outputs))
