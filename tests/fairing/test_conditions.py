"""Fairing under conditions of the user's own: Newton's method against the null space, on dense matrices."""

import casadi as ca
import numpy as np
import pytest
import scipy.linalg as la

import symmotion as sm
from symmotion.motions import noisy_net, smooth_net
from symmotion.systems import Saddle

C = sm.JetConstraint
NETS = {
    "uniform": noisy_net(smooth_net(7), 0.018, seed=1),
    "clamped": noisy_net(smooth_net(8, 7, knots="clamped"), 0.02, seed=2),
    "spatial": noisy_net(smooth_net(7, spatial=True), 0.02, translation=0.05, seed=3),
}
LINEAR = [
    C(lambda jet: jet.du[0] - 0.1, at=[(0.4, 0.3)], name="slope"),
    C(lambda jet: jet.d[:2], lower=0.2, upper=0.2, at=[(0.6, 0.6)], name="place"),
]


def inside(net, *shares: float) -> tuple[float, ...]:
    """Parameters at shares of the domain."""
    return tuple(float(a + x * (b - a)) for x, (a, b) in zip(shares, net.domain, strict=True))


def moved(constraint, net):
    return C(
        constraint.function,
        lower=constraint.lower,
        upper=constraint.upper,
        at=[inside(net, *constraint.at[0])],
        name=constraint.name,
    )


def least(program) -> float:
    """The least value of a quadratic under linear conditions."""
    evaluator, x = sm.program.Evaluator(program), program.x0
    jacobian = evaluator.jacobian(x).toarray()
    x = x - np.linalg.pinv(jacobian) @ evaluator.violation(x)
    along = la.null_space(jacobian)
    gradient = along.T @ evaluator.gradient(x)
    # Columns of the Hessian along the conditions are differences of gradients, exactly.
    hessian = along.T @ np.column_stack([evaluator.gradient(x + z) - evaluator.gradient(x) for z in along.T])
    return evaluator.objective(x - along @ (np.linalg.pinv(hessian, rcond=1e-10) @ gradient))


@pytest.mark.parametrize("weight", [0.0, 0.1])
@pytest.mark.parametrize("net", NETS.values(), ids=NETS)
def test_newton_fairs_a_net_under_linear_conditions(net, weight):
    program = sm.fairing.fairing_program(net, weight=weight, constraints=[moved(c, net) for c in LINEAR])
    solution = sm.ExactNewton().solve(program).require()
    assert solution.objective == pytest.approx(least(program), rel=1e-9, abs=1e-20)
    np.testing.assert_allclose(sm.program.Evaluator(program).violation(solution.x), 0, atol=1e-12)


def test_newton_fairs_a_net_under_a_curved_condition():
    net = NETS["uniform"]
    size = C(lambda jet: ca.sumsqr(jet.d) - 1, at=[inside(net, 0.4, 0.3)], name="size")
    program = sm.fairing.fairing_program(net, weight=0.1, constraints=[size])
    found = [solver.solve(program).require().objective for solver in (sm.ExactNewton(), sm.Ipopt())]
    assert found[0] == pytest.approx(found[1], rel=1e-9)


def test_a_condition_on_what_no_term_reads_leaves_a_system_that_can_be_shifted():
    net = NETS["uniform"]
    program = sm.fairing.fairing_program(net)
    system = Saddle.of(program, lambda: sm.program.Evaluator(program).jacobian(program.x0))
    # The corners of the net are in no jump.
    assert len(system.diagonal) == program.unknowns
