"""Compiled kernels: the same bits as the interpreter's, a cache that processes share, and what happens without it."""

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
import warnings
from typing import Any

import casadi as ca
import numpy as np
import pytest

import symmotion as sm
from studies.solving import kernels
from symmotion.kernels import Kernel, compiled, mapped
from symmotion.kernels.mapped import COMPILE_AFTER, Mapped, kernel_function
from symmotion.kernels.source import ARITHMETIC, BY_LANE, c_source
from symmotion.program import Evaluator
from symmotion.report import StudyOptions
from symmotion.systems import Condensed

REMEMBERED = (
    compiled._opened,
    compiled._built,
    compiled._path,
    compiled._machine,
    compiled._machine_path,
    compiled._compiler,
    compiled._toolchain,
    mapped._use,
)

needs_compiler = pytest.mark.skipif(not compiled._compiler(), reason="no C compiler on this machine")


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty cache, and a process that remembers nothing."""
    compiled.BESIDE.wait()
    monkeypatch.setenv("SYMMOTION_CACHE", str(tmp_path / "cache"))
    for function in (*REMEMBERED, compiled._say_once):
        function.cache_clear()
    yield tmp_path / "cache"
    compiled.BESIDE.wait()
    for function in (*REMEMBERED, compiled._say_once):
        function.cache_clear()


def every_operation() -> Kernel:
    """One component for each operation that has a C form, on numbers where it is defined."""
    z, data = ca.SX.sym("z", 2), ca.SX.sym("data", 1)
    x, y, u = z[0], z[1], data[0]
    unary = (ca.sqrt, ca.sin, ca.cos, ca.tan, ca.asin, ca.acos, ca.atan, ca.sinh, ca.cosh, ca.tanh, ca.asinh, ca.atanh)
    unary += (ca.exp, ca.expm1, ca.log, ca.log1p, ca.fabs, ca.floor, ca.ceil, ca.sign, ca.erf, ca.logic_not)
    out = [f(x) for f in unary] + [f(-y) for f in (ca.fabs, ca.floor, ca.ceil, ca.sign)] + [ca.acosh(1 + x)]
    out += [x + y, x - y, x * y, x / y, -x, x * x, 2 * x, 1 / y, x**y, x**2.5, ca.atan2(x, y), ca.hypot(x, y)]
    out += [ca.fmin(x, y), ca.fmax(x, y), ca.fmod(y, x), ca.copysign(x, u), x < y, x <= y, x == y, x != y]
    out += [ca.logic_and(x < y, u), ca.logic_or(x < y, u), ca.if_else(x < y, x, u), u + 0.1, ca.SX(1e300) * x]
    return Kernel(z, data, ca.vertcat(*out), channels=1)


def square() -> Kernel:
    """What a compiler takes no time for."""
    z, data = ca.SX.sym("z", 2), ca.SX.sym("data", 1)
    return Kernel(z, data, ca.sumsqr(z) + data, channels=1)


@needs_compiler
@pytest.mark.parametrize("kind", [compiled.MachineFunction, compiled.ListedFunction])
def test_every_operation_has_the_interpreters_bits(cache, monkeypatch, kind):
    if kind is compiled.ListedFunction:
        monkeypatch.setattr(compiled, "LARGEST", 0)
    kernel, count = every_operation(), 1013  # no multiple of any number of lanes
    function = kernel.function("out")
    used = {function.instruction_id(k) for k in range(function.n_instructions())}
    assert used >= {*ARITHMETIC, *BY_LANE} - {ca.OP_ASSIGN}
    rng = np.random.default_rng(0)
    z, data = rng.uniform(0.01, 0.99, (count, 2)), rng.normal(size=(count, 1))
    machine = kernel_function(kernel, "out", count, "compiled")
    assert isinstance(machine, kind)
    found = Mapped(machine, count)(z, data, None)
    wanted = Mapped(kernel.function("out"), count)(z, data, None)
    assert found.tobytes() == wanted.tobytes()


@needs_compiler
@pytest.mark.parametrize(
    "objective",
    [sm.Rigidity() + 0.1 * sm.TrajectoryEnergy(np.eye(3)), sm.StrainRate()],
    ids=["R + E", "S"],
)
def test_solutions_have_the_same_bits(cache, objective):
    program = sm.affine_program(sm.examples.random_keyframes(7, 50, seed=3), objective=objective)
    interpreted, machine = (sm.ExactNewton(kernels=k).solve(program) for k in ("interpreted", "compiled"))
    assert list(cache.glob("*.so"))
    assert machine.require().x.tobytes() == interpreted.x.tobytes()
    assert machine.multiplier_vector.tobytes() == interpreted.multiplier_vector.tobytes()
    assert (
        sm.Ipopt(kernels="compiled").solve(program).x.tobytes()
        == sm.Ipopt(kernels="interpreted").solve(program).x.tobytes()
    )


@pytest.mark.parametrize("kernels", ["interpreted", pytest.param("compiled", marks=needs_compiler)])
def test_threads_do_not_change_a_bit(cache, kernels):
    program = sm.affine_program(sm.examples.random_keyframes(1500, 40, seed=3))
    x = program.x0 + 0.01 * np.random.default_rng(1).normal(size=program.unknowns)
    alone, together = (Evaluator(program, kernels, threads) for threads in (1, 2))
    workers = [len(e.terms[0].prepare("hessian")._workers) for e in (alone, together)]
    assert workers == [1, 2]
    for one, two in zip(_everything(alone, x), _everything(together, x), strict=True):
        assert one.tobytes() == two.tobytes()


def _everything(evaluator: Evaluator, x: np.ndarray) -> list[Any]:
    system = Condensed.of(evaluator.program)
    assert system is not None
    line = evaluator.line(x, x)
    return [*evaluator.second_order(x, system.pattern), evaluator.gradient(x), line, np.array(evaluator.objective(x))]


@needs_compiler
def test_the_cache_serves_processes_without_a_compiler_run(cache, monkeypatch):
    kernel = square()
    assert kernel_function(kernel, "out", 1, "auto") is kernel.function("out")  # not worth it, not there
    assert isinstance(kernel_function(kernel, "out", 1, "compiled"), compiled.MachineFunction)
    for function in REMEMBERED:
        function.cache_clear()
    monkeypatch.setattr(subprocess, "Popen", None)
    assert isinstance(kernel_function(kernel, "out", 1, "auto"), compiled.MachineFunction)
    assert kernel_function(kernel, "out", 1, "interpreted") is kernel.function("out")


@needs_compiler
def test_what_small_programs_have_used_often_is_compiled(cache):
    kernel = square()
    z, data = np.linspace(-1, 1, COMPILE_AFTER // 2 * 2).reshape(-1, 2), np.ones((COMPILE_AFTER // 2, 1))
    used = Mapped(kernel_function(kernel, "out", len(z), "interpreted"), len(z))
    first = used(z, data, None)
    assert kernel_function(kernel, "out", 1, "auto") is kernel.function("out")
    assert not used.compiled and not cache.exists()
    used(z, data, None)
    assert kernel_function(kernel, "out", 1, "auto") is kernel.function("out")  # nobody waits for a compiler
    compiled.BESIDE.wait()
    machine = kernel_function(kernel, "out", 1, "auto")
    assert isinstance(machine, compiled.MachineFunction)
    assert Mapped(machine, len(z))(z, data, None).tobytes() == first.tobytes()


def test_without_a_compiler_what_is_used_often_stays_interpreted_without_a_word(cache, monkeypatch):
    monkeypatch.setenv("CC", "")
    monkeypatch.setenv("PATH", "")
    kernel, count = square(), COMPILE_AFTER
    Mapped(kernel.function("out"), count)(np.ones((count, kernel.z.numel())), np.ones((count, 1)), None)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert kernel_function(kernel, "out", 1, "auto") is kernel.function("out")


@needs_compiler
def test_a_solve_goes_on_with_what_was_compiled_beside_it(cache, monkeypatch):
    monkeypatch.setattr(mapped, "COMPILE_FROM", 1)
    program = sm.affine_program(sm.examples.planar_keyframes())
    ways = []

    def look(row):
        ways.append([f.compiled for f, _ in evaluators[0].terms[0]._functions.values()])
        if len(ways) == 2:
            compiled.BESIDE.wait()

    evaluators, own = [], Evaluator.__init__

    def made(self, *arguments):
        own(self, *arguments)
        evaluators.append(self)

    monkeypatch.setattr(Evaluator, "__init__", made)
    solution = sm.ExactNewton(callback=look).solve(program).require()
    assert not any(ways[0]) and sum(ways[-1]) >= 4 and len(ways) > 3
    assert solution.x.tobytes() == sm.ExactNewton(kernels="interpreted").solve(program).x.tobytes()


@needs_compiler
def test_a_process_ends_with_its_compilers_and_leaves_nothing_half_made(cache, tmp_path):
    slow = tmp_path / "slow-cc"
    slow.write_text(f'#!/bin/sh\nsleep 60\nexec {compiled._compiler()[0]} "$@"\n')
    slow.chmod(0o755)
    code = """
        import symmotion as sm
        from symmotion.kernels import compiled, mapped
        mapped.COMPILE_FROM = 1
        sm.ExactNewton().solve(sm.affine_program(sm.examples.planar_keyframes())).require()
    """
    process = _python(code, CC=str(slow))
    _, errors = process.communicate(timeout=40)
    assert not errors and process.returncode == 0
    assert cache.is_dir() and not list(cache.iterdir())


def test_a_compiler_beside_that_fails_is_told_of_once(cache, monkeypatch):
    monkeypatch.setenv("CC", "false")
    monkeypatch.setattr(mapped, "COMPILE_FROM", 1)
    kernel = square()
    assert kernel_function(kernel, "out", 1, "auto") is kernel.function("out")
    compiled.BESIDE.wait()
    with pytest.warns(RuntimeWarning, match="failed: exit status 1") as said:
        for _ in range(2):
            assert kernel_function(kernel, "out", 1, "auto") is kernel.function("out")
    assert len(said) == 1


@needs_compiler
@pytest.mark.parametrize("change", ["source", "flags", "compiler"])
def test_the_key_holds_source_flags_and_compiler(cache, monkeypatch, tmp_path, change):
    kernel = square()
    kernel_function(kernel, "out", 1, "compiled")
    if change == "source":
        kernel = Kernel(kernel.z, kernel.data, kernel.out + 1, channels=1)
    elif change == "flags":
        monkeypatch.setattr(compiled, "FLAGS", ("-O1", *compiled.FLAGS[1:]))
    else:
        other = tmp_path / "other-cc"
        other.write_text(f'#!/bin/sh\nexec {compiled._compiler()[0]} "$@"\n')
        other.chmod(0o755)
        monkeypatch.setenv("CC", str(other))
    for function in REMEMBERED:
        function.cache_clear()
    assert not isinstance(kernel_function(kernel, "out", 1, "auto"), compiled.MachineFunction)
    assert isinstance(kernel_function(kernel, "out", 1, "compiled"), compiled.MachineFunction)
    assert len(list(cache.glob("*.so"))) == 2


SOLVE = """
import symmotion as sm
program = sm.affine_program(sm.examples.planar_keyframes())
print(sm.ExactNewton(kernels="compiled").solve(program).require().x.tobytes().hex())
"""


def _python(code: str, **environment: str) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(code)],
        env=os.environ | environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@needs_compiler
def test_processes_that_build_at_once_agree(cache):
    answers = [p.communicate() for p in [_python(SOLVE) for _ in range(2)]]
    assert {out for out, _ in answers} == {
        sm.ExactNewton(kernels="interpreted").solve(sm.affine_program(sm.examples.planar_keyframes())).x.tobytes().hex()
        + "\n"
    }
    assert all(not errors for _, errors in answers)
    assert all(path.suffix == ".so" for path in cache.iterdir())  # nothing half made is left


def flipped(whole: bytes) -> bytes:
    """One bit of the code is another."""
    half = len(whole) // 2
    return whole[:half] + bytes([whole[half] ^ 1]) + whole[half + 1 :]


@needs_compiler
@pytest.mark.parametrize(
    "damage",
    [
        lambda whole: b"\x7fELF but not really",
        lambda whole: b"",
        lambda whole: whole[: len(whole) // 2],  # which the linker would map, and the processor run beyond
        lambda whole: whole[:-32],  # without its checksum
        flipped,
    ],
    ids=["no library", "empty", "cut off", "unsigned", "flipped"],
)
def test_a_damaged_file_is_built_again(cache, damage):
    kernel = square()
    cache.mkdir(mode=0o700)
    path = compiled._path(kernel.code, "out", kernel.channels, kernel.squares)
    assert isinstance(kernel_function(kernel, "out", 1, "compiled"), compiled.MachineFunction)
    whole = path.read_bytes()
    path.unlink()  # the code that is linked stays as it is
    path.write_bytes(damage(whole))
    for function in REMEMBERED:
        function.cache_clear()
    assert isinstance(kernel_function(kernel, "out", 1, "auto"), compiled.MachineFunction)
    assert len(path.read_bytes()) == len(whole)


@needs_compiler
@pytest.mark.skipif(not hasattr(os, "getuid"), reason="needs file permissions")
@pytest.mark.parametrize("fault", ["link", "mode", "owner", "directory"])
def test_a_file_that_others_could_have_written_is_not_run(cache, monkeypatch, tmp_path, fault):
    kernel = square()
    assert isinstance(kernel_function(kernel, "out", 1, "compiled"), compiled.MachineFunction)
    (path,) = cache.iterdir()
    assert path.stat().st_mode & 0o077 == 0
    if fault == "link":
        path.rename(tmp_path / "elsewhere.so")
        path.symlink_to(tmp_path / "elsewhere.so")
    elif fault == "mode":
        path.chmod(0o666)
    elif fault == "directory":
        path.unlink()
        path.mkdir()
    else:
        status, other = os.fstat, list(os.stat(path))
        other[4] += 1
        monkeypatch.setattr(
            os, "fstat", lambda fd: os.stat_result(other) if status(fd).st_ino == other[1] else status(fd)
        )
    for function in REMEMBERED:
        function.cache_clear()
    with pytest.raises(compiled.Unusable):
        compiled._opened(kernel.code, "out", kernel.channels, kernel.squares)
    if fault == "directory":
        with pytest.warns(RuntimeWarning, match="the cache cannot be used"):
            assert kernel_function(kernel, "out", 1, "compiled") is kernel.function("out")
        return
    assert isinstance(kernel_function(kernel, "out", 1, "auto"), compiled.MachineFunction)
    assert path.is_file() and not path.is_symlink() and path.stat().st_mode & 0o077 == 0


def test_without_a_compiler_it_is_said_once(cache, monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler")
    program = sm.affine_program(sm.examples.planar_keyframes())
    solver = sm.ExactNewton(kernels="compiled")
    with pytest.warns(RuntimeWarning, match="no C compiler was found") as said:
        solver.solve(program).require()
        solver.solve(sm.affine_program(sm.examples.spatial_keyframes())).require()
    assert len(said) == 1


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="needs file permissions")
@pytest.mark.parametrize("fault", ["failing compiler", "shared directory", "a file in its place"])
def test_what_cannot_be_built_is_interpreted(cache, monkeypatch, fault):
    if fault == "failing compiler":
        monkeypatch.setenv("CC", "false")
        reason = "failed: exit status 1"
    elif fault == "shared directory":
        cache.mkdir()
        cache.chmod(0o777)
        reason = "others may write there"
    else:
        cache.write_text("")
        reason = "cannot be used"
    if fault != "failing compiler" and not compiled._compiler():
        pytest.skip("no C compiler on this machine")
    with pytest.warns(RuntimeWarning, match=reason):
        sm.ExactNewton(kernels="compiled").solve(sm.affine_program(sm.examples.planar_keyframes())).require()


@needs_compiler
def test_what_takes_a_compiler_minutes_is_listed(cache, monkeypatch):
    quaternions = sm.examples.random_keyframes(4, 60, seed=2).rotations().as_quat()[:, [3, 0, 1, 2]]
    program = sm.orientation_program(np.arange(4.0), quaternions, refine=0)
    kernel, nodes, rng = program.terms[0].kernel, 37, np.random.default_rng(4)
    function = kernel.function("hessian")
    assert function.n_instructions() > compiled.LARGEST
    given = [rng.normal(size=(nodes, function.size1_in(i))) for i in range(function.n_in())]
    expected = Mapped(function, nodes)(*given)
    for build in ("compiled", "auto"):  # made, and found in the cache
        machine = kernel_function(kernel, "hessian", nodes, build)
        assert isinstance(machine, compiled.ListedFunction)
        assert Mapped(machine, nodes)(*given).tobytes() == expected.tobytes()
        for remembered in REMEMBERED:
            remembered.cache_clear()
        monkeypatch.setattr(subprocess, "Popen", None)
    # A few nodes do not repay a list of their own accord, in a series of solves neither.
    monkeypatch.setenv("SYMMOTION_CACHE", str(cache.parent / "empty"))
    for remembered in REMEMBERED:
        remembered.cache_clear()
    first = sm.ExactNewton().solve(program).require()
    assert sm.ExactNewton().solve(program, start=first).require().iterations == 0


@needs_compiler
def test_a_damaged_list_is_made_again(cache, monkeypatch):
    monkeypatch.setattr(compiled, "LARGEST", 0)
    kernel = square()
    assert isinstance(kernel_function(kernel, "out", 1, "compiled"), compiled.ListedFunction)
    (path,) = cache.glob("*.list")
    whole = path.read_bytes()
    path.write_bytes(flipped(whole))
    for function in REMEMBERED:
        function.cache_clear()
    assert isinstance(kernel_function(kernel, "out", 1, "auto"), compiled.ListedFunction)
    assert path.read_bytes() == whole


@needs_compiler
def test_a_compiler_that_hangs_is_given_up(cache, monkeypatch, tmp_path):
    sleeper = tmp_path / "sleepy-cc"
    sleeper.write_text("#!/bin/sh\nexec sleep 60\n")
    sleeper.chmod(0o755)
    monkeypatch.setenv("CC", str(sleeper))
    monkeypatch.setattr(compiled, "PATIENCE", 0.1)
    kernel = square()
    with pytest.warns(RuntimeWarning, match="sleepy-cc failed: it has not ended after 0.1 s"):
        assert kernel_function(kernel, "out", 1, "compiled") is kernel.function("out")
    assert not list(cache.iterdir())


@needs_compiler
@pytest.mark.parametrize("builder", ["this thread", "another"])
def test_a_signal_ends_the_wait_for_a_compiler(cache, monkeypatch, tmp_path, builder):
    # Of this process alone, from a handler whose error the cache's own faults are kinds of.
    begun, ended = tmp_path / "begun", tmp_path / "ended"
    sleeper = tmp_path / "sleepy-cc"
    sleeper.write_text(f"#!/bin/sh\ntouch {begun}\nsleep 1.5\ntouch {ended}\n")
    sleeper.chmod(0o755)
    monkeypatch.setenv("CC", str(sleeper))
    monkeypatch.setattr(compiled, "PATIENCE", 1)
    monkeypatch.setattr(compiled, "_stay_interpreted", lambda reason: None)

    def late(number, frame):
        raise TimeoutError("late")

    def build():
        kernel_function(square(), "out", 1, "compiled")

    def tell():
        while not begun.exists():
            time.sleep(0.01)
        time.sleep(0.2)
        os.kill(os.getpid(), signal.SIGUSR1)

    teller, other = threading.Thread(target=tell), threading.Thread(target=build)
    before = signal.signal(signal.SIGUSR1, late)
    try:
        teller.start()
        if builder == "another":
            other.start()
            while not begun.exists():
                time.sleep(0.01)
        with pytest.raises(TimeoutError, match="late"):
            build()
        assert other.is_alive() == (builder == "another")
    finally:
        teller.join()
        signal.signal(signal.SIGUSR1, before)
    time.sleep(1.5)
    assert not other.is_alive()
    assert not ended.exists()  # nor does what the compiler has started go on
    assert not list(cache.iterdir())


def test_a_compiler_that_is_named_wrongly_is_missing(cache, monkeypatch):
    monkeypatch.setenv("CC", "'gcc")
    kernel = square()
    with pytest.warns(RuntimeWarning, match="no C compiler was found"):
        assert kernel_function(kernel, "out", 1, "compiled") is kernel.function("out")


@needs_compiler
def test_a_user_without_a_home_needs_no_cache(cache, monkeypatch):
    def nowhere():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("SYMMOTION_CACHE")
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(compiled.Path, "home", nowhere)
    kernel = square()
    assert kernel_function(kernel, "out", 1, "auto") is kernel.function("out")
    with pytest.warns(RuntimeWarning, match=r"no home directory; name a cache in \$SYMMOTION_CACHE"):
        assert kernel_function(kernel, "out", 1, "compiled") is kernel.function("out")


@needs_compiler
def test_the_cache_may_be_the_working_directory(cache, monkeypatch):
    cache.mkdir(mode=0o700)
    monkeypatch.chdir(cache)
    monkeypatch.setenv("SYMMOTION_CACHE", ".")
    assert isinstance(kernel_function(square(), "out", 1, "compiled"), compiled.MachineFunction)
    assert len(list(cache.glob("*.so"))) == 1


@needs_compiler
def test_an_operation_without_c_form_is_interpreted(cache):
    z = ca.SX.sym("z", 1)
    kernel = Kernel(z, ca.SX.sym("data", 0), ca.erfinv(z), channels=1)
    assert c_source(kernel.function("out")) is None
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert kernel_function(kernel, "out", 1, "compiled") is kernel.function("out")


@pytest.mark.parametrize("options", [{"kernels": "compile"}, {"threads": 0}, {"threads": 1.5}])
def test_unknown_kernels_and_threads_are_refused(options):
    (name, value), *_ = options.items()
    with pytest.raises(sm.InputError, match=f"{name} {value!r}"):
        sm.ExactNewton(**options).solve(sm.affine_program(sm.examples.planar_keyframes()))


def test_an_interrupt_waits_for_the_other_threads():
    kernel = every_operation()
    mapped = Mapped(kernel.function("out"), 100_000, threads=2)
    assert len(mapped._workers) == 2
    main, running = threading.get_ident(), []

    def use(nodes, _):
        if threading.get_ident() == main:
            raise KeyboardInterrupt
        running.append(nodes)

    with pytest.raises(KeyboardInterrupt):
        mapped.each(use, np.ones((100_000, 2)), np.ones((100_000, 1)), None)
    assert running and running[-1].stop == 100_000


def test_wrong_sizes_are_refused(cache):
    kernel = square()
    mapped = Mapped(kernel.function("out"), 5)
    with pytest.raises(ValueError, match=r"\(5, 2\) is needed, not \(4, 2\)"):
        mapped(np.ones((4, 2)), np.ones((5, 1)), None)


@needs_compiler
def test_the_study_finds_the_same_bits_in_every_way():
    result = kernels.STUDY.run(StudyOptions())
    assert "the same in every bit" in result.conclusion
    assert len(result.runs) == 4 * 3 and all(run.certified for run in result.runs)
    values = {run.objective for run in result.runs if run.case.startswith("20 keyframes")}
    assert len(values) == 1 and values.pop() == pytest.approx(0.01012, rel=1e-5)  # as IPOPT
    (instructions,) = {row[1] for row in result.tables[1].rows if row[0] == "R"}
    assert instructions == 916
