"""A child forked while other threads solve works, or says that it does not, and never waits for ever."""

import os
import sys
import threading
import time
from collections.abc import Callable

import pytest

import symmotion as sm
from symmotion.forking import ForkedLock, Section

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
PROGRAM = sm.affine_program(sm.examples.random_keyframes(4, 40, seed=1))
WORKED, REFUSED = 10, 11


def child(work: Callable[[], object]) -> int:
    """How a forked child ends that does this: with WORKED, REFUSED or, where it hangs, by a signal."""
    pid = os.fork()
    if not pid:
        try:
            work()
            os._exit(WORKED)
        except sm.InputError as error:
            os._exit(REFUSED if "forked while other threads were in" in str(error) else 12)
        except BaseException:
            os._exit(13)
    for _ in range(600):
        done, status = os.waitpid(pid, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.05)
    os.kill(pid, 9)
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])


def held(lock) -> Callable[[], None]:
    """A thread that has entered and stays there until what is returned is called."""
    inside, leave = threading.Event(), threading.Event()

    def hold():
        with lock:
            inside.set()
            leave.wait()

    thread = threading.Thread(target=hold)
    thread.start()
    inside.wait()

    def done():
        leave.set()
        thread.join()

    return done


def enter(lock) -> None:
    with lock:
        pass


def test_a_lock_that_another_thread_holds_is_open_in_the_child():
    lock = ForkedLock()
    done = held(lock)
    assert child(lambda: enter(lock)) == WORKED
    done()
    enter(lock)
    with lock:
        assert child(lambda: enter(lock)) == WORKED


def test_a_section_that_a_fork_cuts_refuses_in_the_child_alone():
    section = Section("a library")
    done = held(section)
    assert child(lambda: enter(section)) == REFUSED
    enter(section)
    done()
    with section:
        assert child(lambda: enter(section)) == WORKED


def test_a_fork_waits_for_a_patient_section_and_nobody_enters_meanwhile():
    section, entered = Section("a library", patience=30.0), threading.Event()
    leave = held(section)

    def late():
        time.sleep(0.1)
        another = threading.Thread(target=lambda: (section.__enter__(), entered.set(), section.__exit__()))
        another.start()
        seen.append(entered.wait(0.2))
        leave()
        another.join()

    seen: list[bool] = []
    thread = threading.Thread(target=late)
    thread.start()
    assert child(lambda: enter(section)) == WORKED
    thread.join()
    assert seen == [False] and entered.is_set()


def test_a_fork_comes_in_where_a_thread_pauses_or_has_left():
    section, stop, inside = Section("a library", patience=30.0), threading.Event(), threading.Event()

    def steps():
        with section, section:
            while not stop.is_set():
                inside.set()
                section.pause()
            entered.append(section._depth[threading.get_ident()])

    def callback():
        with section, section.left():
            inside.set()
            stop.wait()

    entered: list[int] = []
    for work in (steps, callback):
        stop.clear()
        inside.clear()
        thread = threading.Thread(target=work)
        thread.start()
        inside.wait()
        assert [child(lambda: enter(section)) for _ in range(3)] == [WORKED] * 3
        stop.set()
        thread.join()
    assert entered == [2]
    assert not section._depth


def test_a_fork_that_waits_in_vain_is_refused():
    section = Section("a library", patience=0.05)
    leave = held(section)
    assert child(lambda: enter(section)) == REFUSED
    leave()


@pytest.mark.parametrize(
    ("solver", "ends"),
    [
        (sm.ExactNewton(kernels="interpreted"), {WORKED}),
        (sm.ExactNewton(system="sparse", kernels="interpreted"), {WORKED}),
        (sm.Ipopt(kernels="interpreted"), {WORKED, REFUSED}),
    ],
    ids=["newton", "sparse", "ipopt"],
)
def test_forks_amid_busy_threads(solver, ends, capfd):
    stop = threading.Event()
    wanted = solver.solve(PROGRAM).x.tobytes()

    def busy():
        while not stop.is_set():
            solver.solve(PROGRAM)

    def work():
        if solver.solve(PROGRAM).x.tobytes() != wanted:
            sys.exit(1)

    threads = [threading.Thread(target=busy) for _ in range(2)]
    for thread in threads:
        thread.start()
    try:
        found = []
        for k in range(5):
            time.sleep(0.013 * k)
            found.append(child(work))
    finally:
        stop.set()
        for thread in threads:
            thread.join()
    assert set(found) <= ends
