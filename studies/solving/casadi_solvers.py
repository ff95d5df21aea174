"""The other solvers of CasADi's wheel on the files of the problem set: which work, what they claim, which crash."""

import json
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Any

import numpy as np

import symmotion as sm
from studies.shares import ends, share, shifted_mean, with_interval
from studies.solving.contest import tables
from studies.solving.contest.attempts import alike
from studies.solving.problem_set import load
from studies.solving.problem_set.families import FAMILIES
from studies.solving.problem_set.tasks import SLOW, program
from symmotion.report import Column, Study, StudyOptions, StudyResult, Table
from symmotion.systems import Certificate

FINE = 1e-9  # what each is asked for, by its own tests
ACCURACIES = (1e-4, 1e-6, 1e-8)
MOST = 300  # unknowns
WALL = 60.0  # seconds of the clock in which a process that lives says something
WORKER = Path(__file__).with_name("casadi_worker.py")
QRQP = {"print_iter": False, "print_header": False, "error_on_fail": False}
SQP = {"qpsol": "qrqp", "qpsol_options": QRQP, "max_iter": 200, "tol_du": FINE, "tol_pr": FINE}
SILENT = {"print_header": False, "print_iteration": False, "print_status": False}
# By name: the plugin and its options.
PLUGINS: dict[str, tuple[str, dict[str, Any]]] = {
    "ipopt": ("ipopt", {"ipopt": {"print_level": 0, "sb": "yes", "tol": FINE, "max_iter": 1000}}),
    "fatrop": ("fatrop", {"structure_detection": "none", "fatrop": {"print_level": 0, "tolerance": FINE}}),
    "uno, filterSQP": ("uno", {"uno": {"preset": "filtersqp", "logger": "SILENT", "print_solution": False}}),
    "uno, interior point": ("uno", {"uno": {"preset": "ipopt", "logger": "SILENT", "print_solution": False}}),
    "sleqp": ("sleqp", {"print_level": 0, "sleqp": {"stat_tol": FINE, "feas_tol": FINE}}),
    "alpaqa": ("alpaqa", {"alpaqa": {"alm": {"tolerance": FINE, "dual_tolerance": FINE}}}),
    "sqpmethod": ("sqpmethod", {**SQP, **SILENT}),
    "sqpmethod, L-BFGS": ("sqpmethod", {**SQP, **SILENT, "hessian_approximation": "limited-memory"}),
    "feasiblesqpmethod": ("feasiblesqpmethod", {"qpsol": "qrqp", "qpsol_options": QRQP, **SILENT}),
    "qrsqp": ("qrsqp", {"max_iter": 200, "tol_du": FINE, "tol_pr": FINE, "print_header": False}),
    "scpgen": ("scpgen", {"qpsol": "qrqp", "qpsol_options": QRQP}),
    "blocksqp": ("blocksqp", {}),
}
QUICK_PLUGINS = ("ipopt", "fatrop", "uno, filterSQP")


@dataclass(frozen=True)
class Answer:
    """What a plugin did with a problem: said, in its words or ours where it crashed or was stopped; CPU seconds."""

    problem: str
    family: str
    plugin: str
    claimed: bool
    said: str
    seconds: float | None
    evaluations: int
    certificate: Certificate | None


def run(options: StudyOptions) -> StudyResult:
    # Some take 20 s to differentiate 100 unknowns before they begin.
    most, patience = (MOST, 60.0) if options.full else (100, 5.0)
    names = chosen(6 if options.full else 1, most)
    plugins = PLUGINS if options.full else {name: PLUGINS[name] for name in QUICK_PLUGINS}
    answers = []
    for plugin, (name, settings) in plugins.items():
        for answer in asked(names, plugin, name, settings, patience):
            options.progress(f"{plugin}, {answer.problem}: {answer.said}")
            answers.append(answer)
    working = [p for p in plugins if any(_certified(a, 1e-6) for a in answers if a.plugin == p)]
    best = max(working, key=lambda p: sum(_certified(a, 1e-6) for a in answers if a.plugin == p))
    told = "; ".join(
        f"{p} {share(sum(_certified(a, 1e-6) for a in mine), len(mine))}"
        for p in (best, *[w for w in working if w != best][:2])
        for mine in [[a for a in answers if a.plugin == p]]
    )
    answer = f"Of CasADi's solvers {len(working)} of {len(plugins)} certify problems of the set to 1e-6: {told}."
    text = (
        f"{len(names)} problems of at most {most} unknowns, each plugin in a process that imports CasADi alone and "
        f"reads the set by its own loader, {patience:g} s of CPU for a problem. Without a minimum to 1e-6 "
        f"anywhere: {', '.join(p for p in plugins if p not in working) or 'none'}."
    )
    note = (
        "Limits: default options but for tolerances, iterations and silence; CasADi differentiates the plain problem."
    )
    return StudyResult((_table(answers, plugins), _failures(answers, plugins)), (), (), text, (note,), answer=answer)


def chosen(count: int, most: int) -> list[str]:
    """Some problems of every family, of at most so many unknowns; slow kinds where there are others only."""
    found = []
    for family in FAMILIES:
        rows = [r for r in load.manifest()["problems"] if r["family"] == family and r["unknowns"] <= most]
        kinds = dict.fromkeys(r["kind"] for r in rows if r["best"] is not None and r["kind"] not in SLOW[:4])
        # One of each kind, then the second ones.
        ranked = sorted(rows, key=lambda r: [q["name"] for q in rows if q["kind"] == r["kind"]].index(r["name"]))
        found += list(islice((r["name"] for r in ranked if r["kind"] in kinds), count))
    return found


def asked(
    names: Sequence[str], plugin: str, name: str, settings: Mapping[str, Any], patience: float
) -> Iterator[Answer]:
    """The answers of a plugin; where its process crashes or takes too long the next one goes on behind that problem."""
    left = list(names)
    while left:
        with _Worker(name, settings, left, patience) as worker:
            while left:
                row = worker.answer()
                yield _judged(left.pop(0), plugin, row)
                if "x" not in row:
                    break


class _Worker:
    """A process that answers a line for each problem."""

    def __init__(self, plugin: str, settings: Mapping[str, Any], names: Sequence[str], patience: float):
        self._patience = patience
        # Isolated: nothing of this process is on its path.
        command = [
            sys.executable,
            "-I",
            str(WORKER),
            str(load.HERE),
            plugin,
            json.dumps(settings),
            str(patience),
            *names,
        ]
        nothing = subprocess.DEVNULL
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=nothing, stdin=nothing, text=True)
        self._lines: SimpleQueue[str | None] = SimpleQueue()
        Thread(target=self._listen, daemon=True).start()

    def __enter__(self) -> "_Worker":
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()

    def answer(self) -> dict[str, Any]:
        """What it says of the next problem; where it says nothing, only why."""
        with suppress(Empty):
            if self._heard(WALL) is None:  # that it began, after its imports
                return {"said": self._ending()}
            row = self._heard(max(WALL, 10 * self._patience))
            return {"said": self._ending()} if row is None else row
        return {"said": f"more than {self._patience:g} s"}

    def _ending(self) -> str:
        code = self._process.wait()
        if hasattr(signal, "SIGPROF") and code == -signal.SIGPROF:
            return f"more than {self._patience:g} s"
        return f"the process ended with code {code}"

    def _heard(self, seconds: float) -> dict[str, Any] | None:
        line = self._lines.get(timeout=seconds)
        return None if line is None else json.loads(line)

    def _listen(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._lines.put(line)
        self._lines.put(None)


def _judged(name: str, plugin: str, row: Mapping[str, Any]) -> Answer:
    made, family = program(name), load.load(name).about["family"]
    certificate = None
    if row.get("x") is not None:
        certificate = sm.certify(made, np.array(row["x"], dtype=float), np.array(row["multipliers"], dtype=float))
    claimed, evaluations = bool(row.get("claimed")), int(row.get("evaluations", 0))
    return Answer(name, family, plugin, claimed, str(row["said"]), row.get("seconds"), evaluations, certificate)


def _certified(answer: Answer, tolerance: float) -> bool:
    c = answer.certificate
    return c is not None and c.holds(tolerance) and c.inertia == "positive"


def _table(answers: Sequence[Answer], plugins: Mapping[str, object]) -> Table:
    rows = []
    for plugin in plugins:
        mine = [a for a in answers if a.plugin == plugin]
        shares = [with_interval(sum(_certified(a, t) for a in mine), len(mine)) for t in ACCURACIES]
        best = sum(_best(a) for a in mine)
        right = sum(a.claimed == _certified(a, 1e-6) for a in mine)
        wrong = sum(a.claimed and not _certified(a, 1e-6) for a in mine)
        seconds = [a.seconds for a in mine if a.seconds is not None]
        rows.append(
            (
                plugin,
                len(mine),
                *(number for found in shares for number in found),
                *with_interval(best, len(mine)),
                wrong,
                *with_interval(right, len(mine)),
                1e3 * shifted_mean(seconds, tables.SHIFT) if seconds else None,
            )
        )
    columns = (
        Column("plugin"),
        Column("problems"),
        Column("certified to 1e-4", "%"),
        *ends("certified to 1e-4"),
        Column("to 1e-6", "%"),
        *ends("to 1e-6"),
        Column("to 1e-8", "%"),
        *ends("to 1e-8"),
        Column("best known", "%"),
        *ends("best known"),
        Column("says solved and is not"),
        Column("right", "%"),
        *ends("right"),
        Column("CPU", "ms"),
    )
    caption = (
        "Certified at the returned point with the returned multipliers, to three tolerances; best known: to 1e-6, "
        "within "
        "1e-6 of the best value known. Right: says solved, and is to 1e-6, or neither. In brackets: Wilson's 95 % "
        "interval. "
        "CPU: geometric mean, shifted by 10 ms, with what CasADi takes to read and differentiate the problem, without "
        "what was stopped."
    )
    return Table("plugins", columns, tuple(rows), caption)


def _best(answer: Answer) -> bool:
    best = load.load(answer.problem).about["best"]
    return best is not None and _certified(answer, 1e-6) and alike(_objective(answer), best["objective"])


def _objective(answer: Answer) -> float:
    return np.inf if answer.certificate is None else answer.certificate.objective


def _failures(answers: Sequence[Answer], plugins: Mapping[str, object]) -> Table:
    """What each says where it is not certified to 1e-6, most often first."""
    rows = []
    for plugin in plugins:
        failed = [a for a in answers if a.plugin == plugin and not _certified(a, 1e-6)]
        words = {said: [a for a in failed if a.said == said] for said in dict.fromkeys(a.said for a in failed)}
        for said, mine in sorted(words.items(), key=lambda item: -len(item[1]))[:4]:
            families = ", ".join(dict.fromkeys(a.family for a in mine))
            rows.append((plugin, said or "nothing", len(mine), families, mine[0].problem))
    columns = (Column("plugin"), Column("says"), Column("problems"), Column("families"), Column("such as"))
    return Table("failures", columns, tuple(rows), "What plugins say where no minimum is certified to 1e-6.")


STUDY = Study(
    "casadi_solvers",
    "Which of CasADi's other solvers solve these problems, and what do they fail on?",
    "fatrop, Uno, SLEQP, alpaqa, sqpmethod and others of the CasADi wheel, through program.nlp()",
    run,
    order=7,
    effort=6.0,
)
