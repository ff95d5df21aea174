"""Hessians of kernels as expressions that say once what is needed twice."""

import casadi as ca

# Symbols of few numbers, their values as expressions of z, and what is made of both: see `Kernel.through`.
Inner = tuple[ca.SX, ca.SX, ca.SX]
# Instructions from which looking for what is said twice, at 10 µs for each, does not pay; no compiler takes these.
LONG = 20_000


def second_order(
    z: ca.SX, data: ca.SX, out: ca.SX, inner: Inner | None, squares: bool, theta: ca.SX, mu: ca.SX, sigma: ca.SX | None
) -> tuple[ca.SX, ca.SX]:
    """The Hessian by z and the gradient of φ = Σ out² with `squares`, else muᵀ out.

    theta: the share of the curvature of `out`; sigma: (C,) of which Jᵀ diag(sigma) J is added, J = ∂out/∂z.
    """
    weights = 2 * ca.SX.ones(out.numel()) if squares else sigma
    if inner is None:
        gradient = ca.gradient(ca.sumsqr(out) if squares else ca.dot(mu, out), z)
        jacobian, hessian = _tangents(out, mu, z, data)
        if squares:
            hessian = ca.substitute(hessian, mu, 2 * theta * out)
        return _straight(jacobian, weights) + (hessian if sigma is None else theta * hessian), gradient
    # With Y = ∂(w, z)/∂z: ∇²φ = Yᵀ ∇²φ(w, z) Y + Σ φ_w ∇²w, and ∇φ = Yᵀ ∇φ(w, z).
    symbols, values, out = inner
    both, slopes = ca.vertcat(symbols, z), ca.SX.sym("slopes", symbols.numel())
    parts = _at_once(out, ca.gradient(ca.dot(mu, out), both), both)
    out, gradient, jacobian, hessian = ca.substitute(parts, [mu], [2 * parts[0]]) if squares else parts
    chain = ca.vertcat(ca.jacobian(values, z), ca.SX.eye(z.numel()))
    share = theta if weights is not None else 1
    hessian = chain.T @ (_straight(jacobian, weights) + share * hessian) @ chain
    bent = ca.hessian(ca.dot(slopes, values), z)[0]
    hessian += share * ca.substitute(bent, slopes, gradient[: symbols.numel()])
    hessian, gradient = ca.substitute([hessian, chain.T @ gradient], [symbols], [values])
    return hessian, gradient


def _straight(jacobian: ca.SX, weights: ca.SX | None) -> ca.SX:
    """Jᵀ diag(weights) J, zero without any."""
    return ca.SX(jacobian.shape[1], jacobian.shape[1]) if weights is None else jacobian.T @ ca.diag(weights) @ jacobian


def _tangents(out: ca.SX, mu: ca.SX, z: ca.SX, data: ca.SX) -> tuple[ca.SX, ca.SX]:
    """∂out/∂z and ∂²(muᵀ out)/∂z²."""
    found = ca.jacobian(out, z), ca.hessian(ca.dot(mu, out), z)[0]
    if ca.Function("both", [z, data, mu], found).n_instructions() <= LONG:
        return found
    _, _, jacobian, hessian = _at_once(out, ca.gradient(ca.dot(mu, out), z), z)
    return jacobian, hessian


def _at_once(out: ca.SX, gradient: ca.SX, z: ca.SX) -> list[ca.SX]:
    """`out`, its gradient and the derivatives of both: the tangents of the one are part of those of the other."""
    out, gradient = ca.cse([out, gradient])
    both = ca.jacobian(ca.vertcat(out, gradient), z)
    return [out, gradient, both[: out.numel(), :], both[out.numel() :, :]]
