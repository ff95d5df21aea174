"""Conditions that cannot hold together are named, by all solvers alike."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

import symmotion as sm
from symmotion.systems import conflicting

J = sm.JetConstraint
KEYS = sm.examples.random_keyframes(4, 60, seed=1)
OBJECTIVE = sm.Rigidity() + 0.01 * sm.TrajectoryEnergy(np.eye(3))
FREE = J(lambda jet: jet.dv[1] - 0.3, at=1.7, name="free")
SLOW = J(lambda jet: ca.sumsqr(jet.dv) - 0.01, at=1.3, name="slow")
FAST = J(lambda jet: jet.dv[0] - 1, at=1.3, name="fast")
LOW = J(lambda jet: jet.v[0], lower=-np.inf, upper=-4, at=1.3, name="low")
HIGH = J(lambda jet: jet.v[0], lower=5, upper=np.inf, at=1.3, name="high")
FAR = J(lambda jet: jet.v[2], lower=KEYS.translation[1, 2] + 1, upper=np.inf, at=KEYS.times[1], name="far")
NEVER = J(lambda jet: ca.sumsqr(jet.v) + 1, at=1.3, name="never")


def program(*constraints):
    return sm.affine_program(KEYS, objective=OBJECTIVE, constraints=[FREE, *constraints])


def twice(p, name: str, other: str, change: float):
    """A program with one of its conditions once more, changed."""
    c = next(c for c in p.constraints if c.name == name)
    again = replace(c, block=replace(c.block, name=other), lower=c.lower + change, upper=c.upper + change)
    return sm.program.Program(p.start, p.terms, (*p.constraints, again), p.design)


CASES = {
    "bounds": (program(LOW, HIGH), ("low", "high")),
    "a bound and a keyframe": (program(FAR, HIGH), ("keyframes", "far")),
    "one alone": (program(NEVER), ("never",)),
    "a curved and a straight one": (program(SLOW, FAST), ("slow", "fast")),
    "equalities": (twice(program(FAST), "fast", "faster", 1.0), ("fast", "faster")),
    "keyframes": (twice(sm.affine_program(KEYS), "keyframes", "others", 0.5), ("keyframes", "others")),
    "none": (program(SLOW, HIGH), ()),
    "a repetition": (twice(program(FAST), "fast", "again", 0.0), ()),
}


@pytest.mark.parametrize(("program", "names"), CASES.values(), ids=CASES)
def test_those_are_named_of_which_none_can_be_left_out(program, names):
    assert conflicting(program, program.x0) == names
    # From far away, and from where numbers are none.
    assert conflicting(program, program.x0 + 3.0) == names
    assert conflicting(program, np.full(program.unknowns, np.nan)) == names


@pytest.mark.parametrize(
    ("case", "solver", "message"),
    [
        ("bounds", sm.Ipopt(), "'low' and 'high' cannot hold together$"),
        ("a bound and a keyframe", sm.Ipopt(), "'keyframes' and 'far' cannot hold together$"),
        ("one alone", sm.Ipopt(), "'never' cannot hold near this motion$"),
        ("one alone", sm.ExactNewton(max_iterations=20), "any more: 'never' cannot hold near this motion$"),
        ("a curved and a straight one", sm.ExactNewton(max_iterations=20), "'slow' and 'fast' cannot hold together"),
        ("equalities", sm.ExactNewton(), "'fast' and 'faster' cannot hold together$"),
        ("equalities", sm.Ipopt(), "'fast' and 'faster' cannot hold together$"),
        ("keyframes", sm.ExactNewton(), "'keyframes' and 'others' cannot hold together$"),
        ("keyframes", sm.Ipopt(), "'keyframes' and 'others' cannot hold together$"),
    ],
)
def test_a_solution_says_which_conditions_conflict(case, solver, message):
    solution = solver.solve(CASES[case][0])
    assert solution.status != "solved"
    assert solution.certificate.degenerate or case not in ("equalities", "keyframes")
    with pytest.raises(sm.SolveError, match=message):
        solution.require()


def test_elimination_says_so_before_it_starts():
    with pytest.raises(sm.InputError, match="'keyframes' and 'others' cannot hold together"):
        sm.Elimination().solve(CASES["keyframes"][0])


@pytest.mark.parametrize(
    ("constraints", "message"),
    [
        (
            [J(lambda jet: jet.v - 9, at=KEYS.times[1], name="here")],
            "'here' .* contradicts .* keyframes, here:",
        ),
        ([FAST, J(lambda jet: jet.dv[0] - 2, at=1.3, name="b")], "'b' .* contradicts conditions among fast, b:"),
        ([FAST, J(lambda jet: 2 * jet.dv[0] - 2, at=1.3, name="b")], "'b' .* repeats conditions among fast, b:"),
    ],
)
def test_what_contradicts_to_begin_with_is_refused_with_those_it_is_made_of(constraints, message):
    with pytest.raises(sm.InputError, match=message):
        program(*constraints)


def test_a_matrix_that_lapack_gives_up_on_is_no_fault(monkeypatch):
    def gives_up(*arguments, **options):
        raise np.linalg.LinAlgError("SVD did not converge")

    monkeypatch.setattr("scipy.optimize._lsq.trf.svd", gives_up)
    case, names = CASES["bounds"]
    assert conflicting(case, case.x0) == names
