"""Hessians of kernels as expressions that say once what is needed twice."""

import casadi as ca

# Instructions from which looking for what is said twice, at 10 µs for each, does not pay; no compiler takes these.
LONG = 20_000


def second_order(
    z: ca.SX, data: ca.SX, out: ca.SX, squares: bool, theta: ca.SX, mu: ca.SX, sigma: ca.SX | None
) -> tuple[ca.SX, ca.SX]:
    """The Hessian by z and the gradient of φ = Σ out² with `squares`, else muᵀ out.

    theta: the share of the curvature of `out`; sigma: (C,) of which Jᵀ diag(sigma) J is added, J = ∂out/∂z.
    """
    weights = 2 * ca.SX.ones(out.numel()) if squares else sigma
    gradient = ca.gradient(ca.sumsqr(out) if squares else ca.dot(mu, out), z)
    jacobian, hessian = _tangents(out, mu, z, data)
    if squares:
        hessian = ca.substitute(hessian, mu, 2 * theta * out)
    return _straight(jacobian, weights) + (hessian if sigma is None else theta * hessian), gradient


def _straight(jacobian: ca.SX, weights: ca.SX | None) -> ca.SX:
    """Jᵀ diag(weights) J, zero without any."""
    return ca.SX(jacobian.shape[1], jacobian.shape[1]) if weights is None else jacobian.T @ ca.diag(weights) @ jacobian


def _tangents(out: ca.SX, mu: ca.SX, z: ca.SX, data: ca.SX) -> tuple[ca.SX, ca.SX]:
    """∂out/∂z and ∂²(muᵀ out)/∂z²."""
    found = ca.jacobian(out, z), ca.hessian(ca.dot(mu, out), z)[0]
    if ca.Function("both", [z, data, mu], found).n_instructions() <= LONG:
        return found
    # At once: the tangents of `out` are part of those of its gradient.
    out, gradient = ca.cse([out, ca.gradient(ca.dot(mu, out), z)])
    both = ca.jacobian(ca.vertcat(out, gradient), z)
    return both[: out.numel(), :], both[out.numel() :, :]
