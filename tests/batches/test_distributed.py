"""A Dask cluster of its own on loopback: the same results, also where a worker is killed, and studies on it."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import batches
import pytest

import symmotion as sm
from studies.__main__ import main
from studies.runner import cluster
from symmotion.batches.many import solve_many

distributed = pytest.importorskip("distributed", reason="Dask is an extra: pip install '.[distributed]'")

ROOT = Path(__file__).parents[2]
PATIENCE = 60  # seconds for a process to start; only a broken one takes as long


@contextmanager
def process(*command: str):
    """A Python module run in a process group of its own, which is killed at the end whatever happens."""
    paths = os.pathsep.join((str(ROOT), str(ROOT / "tests")))
    with subprocess.Popen(
        [sys.executable, "-m", *command],
        env={**os.environ, "PYTHONPATH": paths, "OPENBLAS_NUM_THREADS": "1"},
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    ) as started:
        try:
            yield started
        finally:
            with suppress(ProcessLookupError):
                os.killpg(started.pid, signal.SIGKILL)


def until(condition):
    """What a condition returns as soon as that is true."""
    end = time.monotonic() + PATIENCE
    while not (value := condition()):
        assert time.monotonic() < end, "the cluster does not start"
        time.sleep(0.05)
    return value


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory):
    file = tmp_path_factory.mktemp("dask") / "scheduler.json"
    options = ("--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(file))
    with process("distributed.cli.dask_scheduler", *options):

        def address():
            with suppress(OSError, json.JSONDecodeError):
                return json.loads(file.read_text())["address"]

        yield until(address)


@pytest.fixture(scope="module")
def client(scheduler):
    with distributed.Client(scheduler, timeout=PATIENCE, set_as_default=False) as client:
        yield client


@contextmanager
def two_workers(scheduler, client):
    options = ("--host", "127.0.0.1", "--no-dashboard", "--no-nanny", "--nthreads", "1")
    command = ("distributed.cli.dask_worker", scheduler, *options)
    with process(*command) as first, process(*command) as second:
        client.wait_for_workers(2, timeout=PATIENCE)
        yield first, second


def test_every_result_arrives_though_a_worker_is_killed(scheduler, client, tmp_path):
    wanted = batches.numbers(solve_many(batches.small_programs(60)))
    with two_workers(scheduler, client) as (victim, other):
        done: list[int] = []

        def watch(tally):
            done.append(tally.done)
            if tally.done == 20:
                os.kill(victim.pid, signal.SIGKILL)

        with client.get_executor() as executor:
            answers = solve_many(
                batches.small_programs(60), executor=executor, progress=watch, chunk=3, results=tmp_path / "f"
            )
        assert victim.wait() == -signal.SIGKILL and other.poll() is None
    assert batches.numbers(answers) == wanted
    assert done == list(range(1, 61))


def test_a_failure_and_the_studies_on_a_cluster(scheduler, client, tmp_path):
    with two_workers(scheduler, client):
        with client.get_executor() as executor:
            programs = [batches.lasting(duration) for duration in (1, 2, 3)]
            answers: list[Any] = solve_many(programs, batches.Stubborn(refused=2), executor, chunk=2)
        assert (answers[1].error, answers[1].message) == ("ValueError", "not this one")
        assert [answers[k].status for k in (0, 2)] == [sm.solvers.Status.SOLVED] * 2
        said = studies("sweep", "spatial_keyframes", "--scheduler", scheduler, "-o", str(tmp_path))
        assert said.returncode == 0, said.stderr
    found = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))["studies"]
    assert {s["name"]: s["status"] for s in found} == {"spatial_keyframes": "ok", "sweep": "ok"}


def studies(*arguments: str) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "studies", *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE)


def test_a_cluster_that_is_not_there_is_told_in_one_line(scheduler, client, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(cluster, "PATIENCE", 0.5)
    until(lambda: not client.scheduler_info(n_workers=-1)["workers"])
    with monkeypatch.context() as without:
        without.setitem(sys.modules, "distributed", None)
        refused(capsys, "pip install 'symmotion[distributed]'", "--scheduler", scheduler)
    refused(capsys, "it has no workers yet; --help says", "--scheduler", scheduler)
    refused(capsys, "'nonsense': an address such as tcp://", "--scheduler", "nonsense")
    refused(capsys, "no Dask scheduler answers there", "--scheduler", "tcp://127.0.0.1:1")
    refused(capsys, "give one of the two", "--scheduler", scheduler, "--jobs", "2")


def refused(capsys, message: str, *arguments: str) -> None:
    assert main(["sweep", *arguments]) == 2
    out, err = capsys.readouterr()
    assert not out and err.count("\n") == 1 and message in err
