"""One form beside the other: closed, and as programs with explicit multipliers by two solvers."""

from collections.abc import Callable
from time import process_time
from typing import TypeVar

import numpy as np

import symmotion as sm
from symmotion.fairing import FairingResult, Jumps, StepTables, fair, fairing_program, local_step_program
from symmotion.motions import TwoParameterMotion
from symmotion.report import Column, Table

Found = TypeVar("Found")
STEPS = 40


def forms_table(net: TwoParameterMotion, keyframes: list) -> Table:
    """Nets and multipliers of both forms, and the CPU time of each."""
    rows = []
    for method in ("greedy", "orthogonal"):
        (closed, fast), (program, slow) = (
            _timed(lambda form=form, method=method: fair(net, method, max_steps=STEPS, form=form))
            for form in ("closed", "program")
        )
        apart = _apart(closed.multipliers["jumps"], program.multipliers["jumps"])
        rows.append((f"{STEPS} {method} steps, λ and μ", *_nets(closed, program), apart, fast, slow))
    given = {"weight": 1.0, "keyframes": keyframes}
    (closed, fast), (program, slow) = (
        _timed(lambda form=form: fair(net, "least-squares", form=form, **given)) for form in ("closed", "program")
    )
    apart = _apart(closed.multipliers["keyframes"], program.multipliers["keyframes"])
    name = f"least squares, {len(keyframes)} keyframes' prices"
    rows.append((name, *_nets(closed, program), apart, fast, slow))
    ipopt, slow = _timed(lambda: sm.Ipopt().solve(fairing_program(net, **given)))
    assert isinstance(ipopt.motion, TwoParameterMotion)
    far = float(np.abs(ipopt.motion.real - closed.motion.real).max())
    rows.append(
        (f"{name}, IPOPT", far, _apart(closed.multipliers["keyframes"], ipopt.multipliers["keyframes"]), fast, slow)
    )
    columns = (
        Column("what"),
        Column("nets apart by"),
        Column("multipliers apart by, relative"),
        Column("closed form", "s"),
        Column("program", "s"),
    )
    caption = "CPU; programs by Newton's method unless said, with what they build. Multipliers: over the largest."
    return Table("one form beside the other", columns, tuple(rows), caption)


def multipliers_table(nets: list[TwoParameterMotion]) -> Table:
    """How the multipliers of a step, of an iteration, and of the least squares at its G are alike."""
    found = []
    for net in nets:
        greedy = fair(net, "greedy", max_steps=1500)
        least = fair(net, "least-squares", target=greedy.final)
        summed, whole = greedy.multipliers["jumps"], least.multipliers["jumps"]
        k, l = np.unravel_index(int(greedy.before.argmax()), greedy.before.shape)  # noqa: E741 - PCG's letters
        first = fair(net, "greedy", max_steps=1).multipliers["jumps"]
        cosines = (_cosine(first[k, l], whole[k, l]), _cosine(summed, whole))
        found.append(
            (*cosines, float(np.linalg.norm(summed) / np.linalg.norm(whole)), *_conditions(net, (int(k), int(l))))
        )
    names = (
        "cosine of the first step's with the least squares', at its knot",
        "cosine of the steps', summed, with the least squares', at the same G",
        "size of those over these",
        "condition of the closed step's system, 2 × 2",
        "condition of the step's program, multipliers and all",
    )
    rows = tuple(
        (name, float(np.median(v)), float(np.min(v)), float(np.max(v)))
        for name, v in zip(names, np.array(found).T, strict=True)
    )
    columns = (Column("what"), Column("median"), Column("least", end=True), Column("largest", end=True))
    return Table("multipliers", columns, rows, f"{len(nets)} nets, 1500 greedy steps, the best net of them.")


def _timed(call: Callable[[], Found]) -> tuple[Found, float]:
    began = process_time()
    return call(), process_time() - began


def _nets(closed: FairingResult[TwoParameterMotion], program: FairingResult[TwoParameterMotion]) -> tuple[float]:
    return (float(np.abs(closed.motion.real - program.motion.real).max()),)


def _apart(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.abs(one - other).max() / np.abs(one).max())


def _cosine(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.vdot(one, other) / (np.linalg.norm(one) * np.linalg.norm(other)))


def _conditions(net: TwoParameterMotion, knot: tuple[int, int]) -> tuple[float, float]:
    """Condition numbers of the two systems for a step at a knot."""
    solve = StepTables(Jumps.of(net.bases), "nine").solve[knot]
    rows = np.vstack([c.block.operator.toarray() for c in local_step_program(net, knot).constraints])
    saddle = np.block([[np.eye(rows.shape[1]), rows.T], [rows, np.zeros((len(rows), len(rows)))]])
    return float(np.linalg.cond(solve)), float(np.linalg.cond(saddle))
