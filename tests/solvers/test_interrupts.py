"""What handlers of signals raise while a solver runs: kept until its next step, and never lost."""

import os
import signal

import numpy as np
import pytest

import symmotion as sm
from symmotion import interrupts
from symmotion.program import Evaluator

pytestmark = pytest.mark.skipif(os.name == "nt", reason="signals as POSIX has them")


def test_what_was_raised_before_a_callback_is_not_lost_to_a_solve_in_it():
    handler = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt), interrupts.kept():
        signal.raise_signal(signal.SIGINT)
        with interrupts.raised(), interrupts.kept():
            pass
    assert signal.getsignal(signal.SIGINT) is handler
    with interrupts.kept():  # and that is the end of it
        interrupts.check()


def test_a_handler_that_a_callback_sets_stays():
    def mine(number, frame):
        """Of the user's."""

    before = signal.getsignal(signal.SIGALRM)
    try:
        solver = sm.ExactNewton(callback=lambda row: signal.signal(signal.SIGALRM, mine) is None)
        solver.solve(sm.affine_program(sm.examples.planar_keyframes()))
        assert signal.getsignal(signal.SIGALRM) is mine
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize(
    "work",
    [
        lambda program: Evaluator(program).values(program.x0),
        lambda program: sm.certify(program, program.x0, np.zeros(program.conditions)),
        lambda program: sm.systems.conflicting(program, program.x0),
        lambda program: sm.excess(program.design.motion(program.unpack(program.x0)), sm.SpeedBound(np.zeros(3), 1.0)),
    ],
    ids=["values", "certificate", "conflict", "excess"],
)
def test_what_takes_its_time_is_a_step_too(work):
    """An ill-fated solve of 60 keyframes once went on for seconds, to find out what conflicts."""
    keys = sm.examples.random_keyframes(20, 50, 1)
    objective = sm.Rigidity(2) + 0.1 * sm.TrajectoryEnergy(np.zeros((1, 3)))
    bound = sm.SpeedBound(np.zeros(3), 1.0)
    program = sm.affine_program(keys, objective=objective, constraints=[bound])
    passed = []
    with pytest.raises(KeyboardInterrupt), interrupts.kept():
        signal.raise_signal(signal.SIGINT)
        work(program)
        passed.append(work)
    assert not passed
