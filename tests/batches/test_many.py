"""Batches: the same numbers whoever solves, failures in their place, and a file that survives a kill."""

import json
import os
import pickle
import signal
import subprocess
import sys
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from multiprocessing import current_process, get_context
from pathlib import Path
from typing import Any, cast

import batches
import casadi as ca
import numpy as np
import pytest
from scipy import sparse

import symmotion as sm
from studies.solving.hard_keyframes import problem
from symmotion.batches import many
from symmotion.batches.fingerprint import fingerprint
from symmotion.batches.kin import Kin
from symmotion.batches.many import Tally, solve_each, solve_many
from symmotion.batches.results_file import ResultsFile
from symmotion.batches.workers import Failed
from symmotion.fairing.programs import local_step_program
from symmotion.kernels import Kernel
from symmotion.motions.nets import noisy_net, smooth_net
from symmotion.program import Block, Constraint
from symmotion.report import StudyOptions

NEWTON = sm.ExactNewton()
ROOT = Path(__file__).parents[2]


def _bends(jet):
    return ca.sqrt(1 + ca.sumsqr(jet.dv))


def _programs():
    keys, paths = sm.examples.random_keyframes(4, 40, seed=1), sm.TrajectoryEnergy(np.eye(3))
    times = np.array([0.0, 1.0, 2.5, 4.0])
    quaternions = keys.rotations().as_quat()[:, [3, 0, 1, 2]]
    own = sm.Rigidity() + 0.1 * sm.JetEnergy(lambda jet: jet.ddv, squares=True) + sm.JetEnergy(_bends)
    near = sm.Tolerance(linear=0.05, translation=0.1)
    corners = np.array([[0.0, 0.0], [1.0, 2.0], [3.0, 2.0], [4.0, 0.0]])
    samples = sm.examples.recorded_tour(51)
    return {
        "affine": (sm.affine_program(keys), NEWTON),
        "of lambdas": (sm.affine_program(keys, objective=own), NEWTON),
        "strain": (sm.affine_program(keys, objective=sm.StrainRate()), NEWTON),
        "line": (sm.affine_program(keys, objective=paths, constraints=[sm.constraints.OnLine(2, [0, 0, 1])]), NEWTON),
        "near": (sm.affine_program(keys, objective=paths, constraints=[near]), sm.Ipopt()),
        "orientation": (sm.orientation_program(times, quaternions), NEWTON),
        "pose": (sm.pose_program(times, quaternions, keys.translation), NEWTON),
        "fit": (sm.fit_program(samples, controls=15, objective=1e-3 * sm.Rigidity(), huber=0.1), NEWTON),
        "free times": (sm.free_times_program(sm.examples.planar_keyframes(), objective=sm.Rigidity(2)), sm.Ipopt()),
        "curve": (sm.curve_program([sm.constraints.CurveCondition.at(times, corners)]), NEWTON),
        "fairing": (local_step_program(noisy_net(smooth_net(9), 0.01, seed=1), (1, 1)), NEWTON),
    }


@pytest.mark.parametrize(("program", "solver"), _programs().values(), ids=_programs())
def test_every_kind_of_program_and_solution_pickles(program, solver):
    solution = solver.solve(program)
    # What was derived meanwhile holds symbols and lambdas, and stays behind.
    motion, multipliers, terms = solution.motion, solution.multipliers, solution.terms
    copy = pickle.loads(pickle.dumps(program, protocol=5))
    assert fingerprint(copy, solver) == fingerprint(program, solver)
    assert batches.numbers([solver.solve(copy)]) == batches.numbers([solution])
    back = pickle.loads(pickle.dumps(solution, protocol=5))
    assert repr(back) == repr(solution) and back.terms == terms
    assert list(back.multipliers) == list(multipliers) and type(back.motion) is type(motion)


def test_what_was_derived_is_not_sent():
    program = sm.affine_program(batches.keyframes(0))
    before = len(pickle.dumps(program, protocol=5))
    NEWTON.solve(program)
    assert len(pickle.dumps(program, protocol=5)) == before


def test_programs_of_one_structure_share_it_after_the_journey_too():
    alone = len(pickle.dumps(next(batches.moved_programs(1)), protocol=5))
    pickled = pickle.dumps(list(batches.moved_programs(20)), protocol=5)
    programs = pickle.loads(pickled)
    assert all(p.structure is programs[0].structure for p in programs)
    assert all(p.terms[0] is programs[0].terms[0] for p in programs)
    # Kernels and tables once, and of each program its keyframes and start.
    assert len(pickled) < 7 * alone


def test_a_function_of_one_dimension_only_pickles_for_that():
    energy = sm.JetEnergy(lambda jet: jet.ddA[2, 2] ** 2, gauss_nodes=4)
    copy = pickle.loads(pickle.dumps(energy))
    program = sm.affine_program(batches.keyframes(1), objective=copy)
    assert sm.measure(program.design.motion(program.start), copy) == pytest.approx(
        sm.measure(program.design.motion(program.start), energy), rel=1e-14
    )

    with pytest.raises(sm.InputError, match="takes jets of the kinds affine 3D, orientation, pose, not affine 2D"):
        sm.affine_program(sm.examples.planar_keyframes(), objective=copy)

    def refuse(jet):
        raise sm.InputError("no motion is good enough")

    with pytest.raises(sm.InputError, match="no motion is good enough"):
        pickle.dumps(sm.JetEnergy(refuse))


@pytest.mark.parametrize("make", [batches.small_programs, batches.moved_programs])
def test_the_same_numbers_whoever_solves(make, executor_of_two):
    one_by_one = [NEWTON.solve(program) for program in make(24)]
    wanted = batches.numbers(one_by_one)
    assert batches.numbers(solve_many(make(24))) == wanted
    with ThreadPoolExecutor(2) as threads:
        assert batches.numbers(solve_many(make(24), executor=threads)) == wanted
    for chunk in (None, 1, 5):
        assert batches.numbers(solve_many(make(24), executor=executor_of_two, chunk=chunk)) == wanted


def test_a_solution_belongs_to_the_program_that_was_given(executor_of_two):
    programs = list(batches.moved_programs(6))
    answers: list[Any] = solve_many(programs, executor=executor_of_two)
    assert all(a.program is p for a, p in zip(answers, programs, strict=True))
    assert answers[3].require().motion(0.3).linear == pytest.approx(batches.keyframes(3).linear[1])


@pytest.fixture(scope="module")
def executor_of_two():
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as processes:
        yield processes


@pytest.mark.parametrize("where", ["here", "threads", "processes"])
def test_one_failure_does_not_lose_the_others(where, executor_of_two):
    programs = [batches.lasting(duration) for duration in (1, 2, 3, 4, 5)]
    executor = {"here": None, "threads": ThreadPoolExecutor(2), "processes": executor_of_two}[where]
    tallies: list[Tally] = []
    solver = batches.Stubborn(refused=3)
    answers: list[Any] = solve_many(programs, solver, executor, progress=tallies.append, chunk=2)
    assert answers[2] == Failed(2, "ValueError", "not this one")
    assert all(a.status is sm.solvers.Status.SOLVED for k, a in enumerate(answers) if k != 2)
    assert [t.done for t in tallies] == [1, 2, 3, 4, 5] and (tallies[-1].failed, tallies[-1].found) == (1, 0)
    assert str(tallies[-1]).startswith("5 programs, 0 found, 1 failed")


def test_a_solve_that_does_not_converge_is_a_solution():
    (answer,) = solve_many(batches.small_programs(1), sm.ExactNewton(max_iterations=1))
    assert isinstance(answer, sm.Solution)
    assert answer.status is sm.solvers.Status.ITERATION_LIMIT


def test_a_solver_that_cannot_take_a_program_is_a_failure():
    near = [sm.Tolerance(linear=0.05)]
    program = sm.affine_program(batches.keyframes(0), constraints=near)
    (answer,) = solve_many([program], sm.Elimination())
    assert isinstance(answer, Failed)
    assert answer.error == "InputError" and "ExactNewton() and Ipopt() take it" in answer.message


@pytest.mark.parametrize("where", ["given", "own"])
def test_a_program_that_kills_its_worker_loses_only_itself(where):
    programs = [batches.lasting(duration) for duration in (1, 2, 3, 4, 5, 6)]
    solver = batches.Stubborn(deadly=3)
    answers: list[Any]
    if where == "own":
        answers = solve_many(programs, solver, 2, chunk=2)
    else:
        with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as processes:
            answers = solve_many(programs, solver, processes, chunk=2)
    assert answers[2] == Failed(2, "BrokenProcessPool", "its worker process was killed, twice")
    assert all(a.status is sm.solvers.Status.SOLVED for k, a in enumerate(answers) if k != 2)


def test_starts_are_taken_along(executor_of_two):
    programs = list(batches.moved_programs(3))
    first = NEWTON.solve(programs[0])
    pairs = [(p, first) for p in programs] + [(programs[1], first.x), (programs[1], np.zeros(3))]
    wanted = batches.numbers(NEWTON.solve(p, s) for p, s in pairs[:-1])
    for executor in (None, executor_of_two):
        *answers, refused = solve_many(pairs, executor=executor, chunk=2)
        assert batches.numbers(answers) == wanted
        assert isinstance(refused, Failed)
        assert refused.error == "InputError" and "start of shape (3,)" in refused.message


class Forgetful:
    """A solver that returns nothing."""

    def solve(self, program, start=None):
        return None


def test_a_solver_that_returns_no_solution_is_a_failure():
    nothing: Any = Forgetful()
    (answer,) = solve_many(batches.small_programs(1), nothing)
    assert answer == Failed(0, "TypeError", "the solver returned None instead of a Solution")


def test_an_executor_that_takes_no_work_is_named():
    threads = ThreadPoolExecutor(1)
    threads.shutdown()
    with pytest.raises(sm.InputError, match=r"ThreadPoolExecutor.* takes no work: cannot schedule new futures"):
        solve_many(batches.small_programs(2), executor=threads)


def test_a_daemon_starts_no_processes(monkeypatch):
    monkeypatch.setitem(current_process()._config, "daemon", True)  # pyright: ignore[reportAttributeAccessIssue]
    with pytest.raises(sm.InputError, match=r"a daemonic process.* may not start others: use threads"):
        solve_many(batches.small_programs(2), executor=2)


@pytest.mark.parametrize("breaks", ["the programs", "the progress"])
@pytest.mark.parametrize("chunk", [None, 2])
def test_what_the_caller_raises_midway_comes_back_and_the_file_keeps_the_rest(tmp_path, breaks, chunk):
    def programs():
        yield from batches.small_programs(4)
        if breaks == "the programs":
            raise ZeroDivisionError("midway")

    def progress(tally):
        if breaks == "the progress" and tally.done == 3:
            raise ZeroDivisionError("midway")

    with ThreadPoolExecutor(1) as threads, pytest.raises(ZeroDivisionError, match="midway"):
        executor = None if chunk is None else threads
        solve_many(programs(), executor=executor, results=tmp_path / "f", progress=progress, chunk=chunk, ahead=1)
    with ResultsFile(tmp_path / "f") as file:
        assert len(file) >= 2


def test_what_cannot_be_sent_is_a_failure_that_says_so(executor_of_two):
    programs = list(batches.small_programs(4))
    programs[2] = replace(programs[2], design=replace(programs[2].design, constraints=(lambda: None,)))
    answers: list[Any] = solve_many(programs, executor=executor_of_two, chunk=3)
    assert [isinstance(a, Failed) for a in answers] == [False, False, True, False]
    assert answers[2].error == "InputError" and "cannot be sent to another process" in answers[2].message
    assert all(isinstance(a, sm.Solution) for a in solve_many(programs))


class Hesitant(Executor):
    """Runs at once, but the first task that holds several programs fails for reasons of its own."""

    def __init__(self):
        self.sizes: list[int] = []

    def submit(self, fn, /, *args, **kwargs):
        jobs = pickle.loads(args[0])[1]
        self.sizes.append(len(jobs))
        future: Future = Future()
        if len(jobs) > 1:
            future.set_exception(RuntimeError("lost on the way"))
        else:
            future.set_result(fn(*args, **kwargs))
        return future


def test_a_task_that_is_lost_is_tried_program_by_program():
    executor = Hesitant()
    answers = solve_many(batches.small_programs(5), executor=executor, chunk=4)
    assert batches.numbers(answers) == batches.numbers(solve_many(batches.small_programs(5)))
    assert executor.sizes == [4, 1, 1, 1, 1, 1] or executor.sizes == [4, 1, 1, 1, 1, 1, 1]


def test_programs_are_read_only_as_far_as_work_is_handed_out():
    made: list[int] = []

    def programs():
        for k in range(50):
            made.append(k)
            yield batches.lasting(1 + k)

    answers = solve_each(programs(), executor=Hesitant(), chunk=1, ahead=3)
    next(answers)
    assert len(made) <= 4
    with ThreadPoolExecutor(1) as threads:
        answers: Any = solve_each(programs(), executor=threads, chunk=2, ahead=2)
        made.clear()
        next(answers)
        answers.close()
    assert len(made) <= 6


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"programs": next(batches.moved_programs(1))}, "one program where several"),
        ({"programs": [3]}, "program 0 is 3"),
        ({"programs": 3}, "programs 3: an iterable of programs is needed"),
        ({"solver": "newton"}, "solver 'newton' has no method solve"),
        ({"solver": Forgetful(), "results": "f"}, "with a results file its repr has to tell its options"),
        ({"executor": 0}, "executor 0: a whole number of processes, 1 or more, is needed"),
        ({"executor": "two"}, "executor 'two': None, a number of processes"),
        ({"chunk": 0}, "chunk 0"),
        ({"ahead": 1.5}, "ahead 1.5"),
    ],
)
def test_bad_input(arguments, message):
    with pytest.raises(sm.InputError, match=message):
        solve_many(**{"programs": [], **arguments})


# The results file.


def test_what_is_in_the_file_is_not_solved_again(tmp_path):
    counter, path = tmp_path / "count", tmp_path / "batch.results"
    solver = batches.Counting(str(counter))
    first = solve_many(batches.small_programs(4), solver, results=path)
    tallies: list[Tally] = []
    again = solve_many(batches.small_programs(7), solver, results=path, progress=tallies.append)
    assert batches.counts(counter) == 7 and tallies[-1].found == 4
    assert batches.numbers(again[:4]) == batches.numbers(first)
    restored, solved = again[1], first[1]
    assert isinstance(restored, sm.Solution) and isinstance(solved, sm.Solution)
    assert (restored.log, restored.seconds, restored.tolerance) == (solved.log, solved.seconds, solved.tolerance)
    assert restored.solver == repr(solver) or restored.solver == solved.solver
    assert restored.motion(0.5).linear == pytest.approx(solved.motion(0.5).linear, abs=0)


def test_one_program_that_is_missing_does_not_hold_up_a_batch_that_is_found(tmp_path, monkeypatch):
    # It is gathered for a task, and the others fill up what may wait for it.
    monkeypatch.setattr(many, "WAITING", 3)
    programs = list(batches.moved_programs(8))
    solve_many(programs[1:], results=tmp_path / "f")
    with ThreadPoolExecutor(1) as threads:
        answers = solve_many(programs, executor=threads, chunk=2, results=tmp_path / "f")
    assert batches.numbers(answers) == batches.numbers(map(NEWTON.solve, programs))


def test_two_batches_do_not_write_to_one_file(tmp_path):
    pytest.importorskip("fcntl", reason="the system has no locks of this kind")
    path = tmp_path / "f"
    with ResultsFile(path) as file:
        with pytest.raises(sm.InputError, match="f: another batch is writing to it"):
            ResultsFile(path)
        forked = os.dup(file._file.fileno())  # as a forked process has it
    with ResultsFile(path) as file:
        assert len(file) == 0
    os.close(forked)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_full_disk_is_told(tmp_path):
    with ResultsFile(tmp_path / "f") as file:
        solution = NEWTON.solve(next(batches.small_programs(1)))
        written, file._file = file._file, open("/dev/full", "ab", buffering=0)  # noqa: SIM115
        with written, pytest.raises(sm.InputError, match="f: cannot write: No space left"):
            file.add("name", solution)
    with pytest.raises(sm.InputError, match=r"/dev/full: .* it is no ordinary file"):
        ResultsFile("/dev/full")


def test_another_question_or_solver_is_solved_anew(tmp_path):
    path = tmp_path / "batch.results"
    program = sm.affine_program(batches.keyframes(0))
    solve_many([program], results=path)
    moved = program.with_keyframes(batches.keyframes(0).moved(1, translation=[0, 0, 1e-9]))
    weighted = sm.affine_program(batches.keyframes(0), objective=1.5 * sm.Rigidity())
    nearer = sm.affine_program(batches.keyframes(0), refine=2)
    for others, solver in (([weighted, nearer], NEWTON), ([program], sm.ExactNewton(tolerance=1e-9))):
        tallies: list[Tally] = []
        solve_many(others, solver, results=path, progress=tallies.append)
        assert tallies[-1].found == 0
    names = {fingerprint(p, NEWTON) for p in (program, weighted, nearer)}
    assert len(names | {fingerprint(program, NEWTON, program.x0 + 1e-12)}) == 4
    # The translation is not seen by R, so that this is the same question.
    assert fingerprint(moved, NEWTON) in names


def test_a_fingerprint_is_the_same_in_another_process():
    code = "import batches; from symmotion.batches.fingerprint import fingerprint; import symmotion as sm;"
    code += "print(*(fingerprint(p, sm.ExactNewton()) for p in batches.small_programs(3)))"
    said = subprocess.run([sys.executable, "-c", code], env=_environment(), capture_output=True, text=True, check=True)
    assert said.stdout.split() == [fingerprint(p, NEWTON) for p in batches.small_programs(3)]


def _environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": os.pathsep.join((str(ROOT), str(ROOT / "tests")))}


def test_numbers_that_are_not_finite_survive_the_file(tmp_path):
    program = sm.affine_program(batches.keyframes(0))
    wild = replace(
        NEWTON.solve(program),
        x=np.full(program.unknowns, np.nan),
        certificate=replace(NEWTON.solve(program).certificate, objective=np.inf, stationarity=np.nan),
        message="a line\nand “another”",
    )
    with ResultsFile(tmp_path / "f") as file:
        file.add("name", wild)
    for line in (tmp_path / "f").read_text(encoding="utf-8").splitlines():
        json.loads(line, parse_constant=lambda constant: pytest.fail(f"{constant} is no JSON"))
    with ResultsFile(tmp_path / "f") as file:
        back = file.find("name", program)
        assert back is not None
        assert file.find("other", program) is None and len(file) == 1
    assert np.isnan(back.x).all() and back.objective == np.inf and np.isnan(back.stationarity)
    assert back.message == wild.message and back.log == wild.log


def test_a_failure_is_tried_again(tmp_path):
    path, programs = tmp_path / "f", [batches.lasting(1), batches.lasting(2)]

    class Moody:
        refuses = True

        def __repr__(self):
            return "Moody()"

        def solve(self, program, start=None):
            if self.refuses and program is programs[1]:
                raise ValueError("not now")
            return NEWTON.solve(program, start)

    moody: Any = Moody()
    assert isinstance(solve_many(programs, moody, results=path)[1], Failed)
    Moody.refuses = False
    assert isinstance(solve_many(programs, moody, results=path)[1], sm.Solution)


@pytest.mark.parametrize("torn", ["no end", "half", "garbled", "header"])
def test_a_torn_last_line_is_cut_off_and_solved_again(tmp_path, torn):
    path = tmp_path / "f"
    wanted = batches.numbers(solve_many(batches.small_programs(3), results=path))
    whole = path.read_bytes()
    last = whole.rstrip().rindex(b"\n") + 1
    damaged = {
        "no end": whole[:-1],
        "half": whole[: (last + len(whole)) // 2],
        "garbled": whole[:-20] + b"\0" * 19 + b"\n",
        "header": whole[:7],
    }
    path.write_bytes(damaged[torn])
    tallies: list[Tally] = []
    answers = solve_many(batches.small_programs(3), results=path, progress=tallies.append)
    assert batches.numbers(answers) == wanted
    assert tallies[-1].found == (0 if torn == "header" else 2)
    with ResultsFile(path) as file:
        assert len(file) == 3


def test_a_damaged_or_foreign_file_is_refused(tmp_path):
    path = tmp_path / "f"
    solve_many(batches.small_programs(3), results=path)
    lines = path.read_bytes().splitlines(keepends=True)
    damaged = b"".join([lines[0], lines[1], lines[2].replace(b'"newton"', b'"neuton"'), lines[3]])
    path.write_bytes(damaged)
    with pytest.raises(sm.InputError, match=r"f, line 3: damaged; delete this line"):
        solve_many(batches.small_programs(1), results=path)
    assert path.read_bytes() == damaged
    (tmp_path / "keys.tum").write_text("0 0 0 0 0 0 0 1\n")
    with pytest.raises(sm.InputError, match=r"keys.tum, line 1: this is no results file"):
        solve_many([], results=tmp_path / "keys.tum")
    assert (tmp_path / "keys.tum").read_text() == "0 0 0 0 0 0 0 1\n"
    with pytest.raises(sm.InputError, match=r"nowhere.*cannot write a results file there"):
        solve_many([], results=tmp_path / "nowhere" / "f")


KILLED = """
import os, signal, sys
import batches
from symmotion.batches.many import solve_many
def stop(tally):
    if tally.done == 9:
        os.kill(os.getpid(), signal.{signal})
if __name__ == "__main__":
    solver = batches.Counting(sys.argv[1])
    solve_many(batches.small_programs(30), solver, {executor}, results=sys.argv[2], progress=stop)
"""


@pytest.mark.parametrize(("executor", "sent"), [("None", "SIGKILL"), ("2", "SIGKILL"), ("2", "SIGINT")])
def test_a_batch_that_was_killed_goes_on(tmp_path, executor, sent):
    script, counter, path = tmp_path / "batch.py", tmp_path / "count", tmp_path / "f"
    script.write_text(KILLED.format(executor=executor, signal=sent))
    command = [sys.executable, str(script), str(counter), str(path)]
    # Ends only when the workers have closed their end of the pipe too, and not waited for work for ever.
    code = subprocess.run(command, env=_environment(), capture_output=True, timeout=60).returncode
    assert code == (-signal.SIGKILL if sent == "SIGKILL" else -signal.SIGINT)
    with ResultsFile(path) as file:
        kept = len(file)
    assert 9 <= kept < 30
    before = batches.counts(counter)
    answers = solve_many(batches.small_programs(30), batches.Counting(str(counter)), results=path)
    assert batches.counts(counter) - before == 30 - kept
    assert batches.numbers(answers) == batches.numbers(NEWTON.solve(p) for p in batches.small_programs(30))


def test_the_study_reports_every_way_with_the_same_numbers():
    from studies.solving import many_motions

    result = many_motions.STUDY.run(StudyOptions())
    throughput = result.tables[0]
    assert [c.name for c in throughput.columns[-2:]] == ["certified", "same bits"]
    assert {row[-1] for row in throughput.rows} == {True}
    assert {row[-2] for row in throughput.rows} == {40}
    assert {row[0] for row in throughput.rows} == {"loop", "solve_many", "2 threads", "2 processes"}
    sizes: dict[Any, Any] = {name: size for name, size in result.tables[2].rows}
    assert sizes["pickle, moved, 64 to a task"] < 4 < sizes["pickle, moved, 1 to a task"] < 30
    assert all(run.certified for run in result.runs) and "bit for bit" in result.conclusion


def test_new_programs_of_one_structure_share_it():
    first, (_, second) = sm.affine_program(batches.keyframes(0)), batches.moved_programs(2)
    fresh = sm.affine_program(batches.keyframes(1))
    kin = Kin()
    assert kin.adopt(first) is first
    NEWTON.solve(first)
    adopted = kin.adopt(fresh)
    assert adopted.structure is first.structure
    assert batches.numbers([NEWTON.solve(adopted)]) == batches.numbers([NEWTON.solve(fresh)])
    assert kin.adopt(second) is second
    # Other times, another objective, other conditions are other structures.
    paths = sm.Rigidity() + 0.1 * sm.TrajectoryEnergy(np.eye(3))
    for other in (
        batches.lasting(2),
        sm.affine_program(batches.keyframes(1), objective=2 * sm.Rigidity()),
        sm.affine_program(batches.keyframes(1), objective=paths),
        sm.affine_program(batches.keyframes(1), constraints=[sm.constraints.AngularRate(1, [0, 0, 1])]),
    ):
        assert kin.adopt(other) is other


def test_a_jacobian_that_depends_on_the_data_is_not_shared():
    def program(slope: float) -> sm.program.Program:
        z, data = ca.SX.sym("z", 1), ca.SX.sym("data", 2)
        one = sparse.csr_array(np.ones((1, 1)))
        condition = Block(
            "c",
            Kernel(z, data, data[0] * z - data[1], 1),
            "x",
            slice(0, 1),
            one,
            1,
            np.ones(1),
            np.array([[slope, 1.0]]),
        )
        term = Block(
            "t", Kernel(z, ca.SX.sym("n", 0), z, 1, True), "x", slice(0, 1), one, 1, np.ones(1), np.empty((1, 0))
        )
        return sm.program.Program({"x": np.zeros((1, 1))}, (term,), (Constraint.equality(condition),), None)  # pyright: ignore[reportArgumentType]

    first = program(1.0)
    edited = first.with_data("c", np.array([[4.0, 1.0]]))
    answers: list[Any] = solve_many([first, program(2.0), edited])
    assert edited.structure is not first.structure
    assert [a.x[0] for a in answers] == pytest.approx([1.0, 0.5, 0.25], rel=1e-12)
    assert [a.violation for a in answers] == pytest.approx([0, 0, 0], abs=1e-12)


# At the prompt.


def test_what_a_batch_shows_at_the_prompt(tmp_path):
    tallies: list[Tally] = []
    path = tmp_path / "batch.results"
    (failed,) = solve_many([batches.lasting(2.0)], batches.Stubborn(refused=2.0), results=path, progress=tallies.append)
    assert repr(failed) == "Failed(program 0: ValueError: not this one)"
    assert repr(tallies[0]) == str(tallies[0])
    assert repr(tallies[0]).startswith("1 programs, 0 found, 1 failed")
    solve_many(batches.small_programs(1), results=path)
    with ResultsFile(path) as file:
        assert repr(file) == f"ResultsFile({str(path)!r}: 1 solutions)"


def test_a_solve_that_a_callback_stopped_is_no_result(tmp_path):
    path = tmp_path / "batch.results"
    (stopped,) = solve_many(batches.small_programs(1), sm.ExactNewton(callback=lambda row: True), results=path)
    assert isinstance(stopped, sm.Solution) and stopped.status == "stopped"
    (again,) = solve_many(batches.small_programs(1), sm.ExactNewton(), results=path)
    assert isinstance(again, sm.Solution) and again.status == "solved"


def test_a_solve_that_the_clock_or_a_callback_cut_short_is_no_result_even_where_it_solved(tmp_path):
    # Two descents from one start compete here, of which the second, and better one, is cut short.
    program, seen = problem(26).program, []
    whole = sm.ExactNewton().solve(program)
    first = [row.objective for row in whole.log].index(whole.log[0].objective, 1)
    solver = sm.ExactNewton(callback=lambda row: seen.append(row) or len(seen) > first + 1)
    (cut,) = solve_many([program], solver, results=tmp_path / "batch.results")
    assert isinstance(cut, sm.Solution) and cut.interrupted and not whole.interrupted
    assert cut.status == "solved" and cut.objective > 1.2 * whole.objective
    with ResultsFile(tmp_path / "batch.results") as file:
        assert len(file) == 0
    late = sm.ExactNewton(time_limit=1e-9)
    for _ in range(2):
        tallies: list[Tally] = []
        (cut,) = solve_many(batches.small_programs(1), late, results=tmp_path / "late.results", progress=tallies.append)
        assert isinstance(cut, sm.Solution) and cut.status == "time-limit" and tallies[-1].found == 0


def test_failed_entries_are_solved_again_where_that_is_told(tmp_path):
    path, solver = tmp_path / "batch.results", sm.ExactNewton(max_iterations=1)

    def found(programs, retry: bool) -> tuple[int, list[str]]:
        tallies: list[Tally] = []
        answers = solve_many(programs, solver, results=path, retry=retry, progress=tallies.append)
        return tallies[-1].found, [str(getattr(a, "status", "failed")) for a in answers]

    hard, easy = batches.small_programs(2)
    with ResultsFile(path) as file:  # as if it had been solved to the end
        file.add(fingerprint(easy, solver), sm.ExactNewton().solve(easy))
    assert found([hard, easy], retry=False) == (1, ["iteration-limit", "solved"])
    assert found([hard, easy], retry=False) == (2, ["iteration-limit", "solved"])
    assert found([hard, easy], retry=True) == (1, ["iteration-limit", "solved"])
    with ResultsFile(path) as file:  # the newest counts
        file.add(fingerprint(hard, solver), sm.ExactNewton().solve(hard))
    assert found([hard, easy], retry=True) == (2, ["solved", "solved"])
    for wrong in ({"retry": True}, {"retry": 1, "results": path}):
        with pytest.raises(sm.InputError, match=r"retry .*: True or False is needed, and with True a results file"):
            solve_many([easy], **cast(Any, wrong))
