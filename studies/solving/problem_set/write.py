"""Write the set: python -m studies.solving.problem_set.write [NAME…] makes manifest.json and problems.tar.xz anew.

NAME: problems that are made and searched for lower minima, the others stay; all where none is named.

What is written stays: texts whose functions have not changed are taken over byte by byte, and the best values known
are replaced by lower ones only. The numbers that a solve found when a problem was made are in the manifest.
"""

import hashlib
import io
import json
import lzma
import sys
import tarfile
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

import symmotion as sm
from studies.solving.problem_set import load
from studies.solving.problem_set.families import Entry, entries
from studies.solving.problem_set.problem import Measured
from symmotion.program import Program

STARTS, PATIENCE = 8, 10.0  # tries for the best value, beside every solver's own, and seconds of each
LICENCE = "BSD-3-Clause; recorded keyframes as in recorded.json"
# Relative: a value that is lower than the best known by less is the same.
SAME = 1e-9


@dataclass(frozen=True, eq=False)
class Best:
    """The least certified minimum that was found, and by which solver."""

    solution: sm.Solution
    solver: str


def text_of(program: Program) -> str:
    """(x, p) ↦ (f, g) of a program, as CasADi writes functions."""
    nlp = program.nlp()
    return ca.Function("nlp", [nlp["x"], nlp["p"]], [nlp["f"], nlp["g"]], ["x", "p"], ["f", "g"]).serialize()


def known() -> dict[str, dict[str, Any]]:
    """The rows of the manifest by name, as far as there is one."""
    return {row["name"]: row for row in load.manifest()["problems"]} if load.MANIFEST.is_file() else {}


def program_of(entry: Entry) -> tuple[Program, tuple[float, ...]]:
    """The program of an entry, with the numbers that were measured when it was written first, and these."""
    row = known().get(entry.name)
    measured = Measured(None if row is None else row["measured"])
    return entry.program(measured), measured.numbers


def search(program: Program, starts: int = STARTS) -> Best | None:
    """The least minimum that two solvers find, each from the program's own start and from others."""
    solvers = {"newton": sm.ExactNewton(time_limit=PATIENCE), "ipopt": sm.Ipopt(time_limit=PATIENCE)}
    found = [Best(s.solve(program), name) for name, s in solvers.items()]
    if any(b.solution.certified for b in found) and starts:
        for name, solver in solvers.items():
            more = sm.explore(program, budget=starts, solver=solver, unseen=0)
            found += [Best(s, f"{name}, {len(more.starts)} starts") for s in more.minima]
    return min((b for b in found if b.solution.certified), key=lambda b: b.solution.objective, default=None)


def written(entry: Entry, starts: int = STARTS) -> tuple[dict[str, Any], bytes, bytes]:
    """The row of the manifest, the text and the numbers of a problem."""
    program, measured = program_of(entry)
    text, row = text_of(program).encode("ascii"), known().get(entry.name)
    old = None if row is None else load.load(entry.name)
    if old is not None and _same(old, ca.Function.deserialize(text.decode("ascii"))):
        text = load.read(f"{entry.name}.casadi")
    else:
        old = None  # another problem, of which nothing is known
    best = search(program, starts)
    x, multipliers, about = None, None, None
    if best is not None:
        x, multipliers, c = best.solution.x, best.solution.multiplier_vector, best.solution.certificate
        figures = ("objective", "stationarity", "violation", "decrement", "complementarity", "inertia", "degenerate")
        about = {key: getattr(c, key) for key in figures} | {"weak": len(c.weak), "solver": best.solver}
    if old is not None and old.x is not None and row is not None:
        before = row["best"]
        if about is None or not about["objective"] < before["objective"] - SAME * abs(before["objective"]):
            x, multipliers, about = old.x, old.multipliers, before
    fresh = {
        "name": entry.name,
        "family": entry.family,
        "kind": entry.kind,
        "seed": entry.seed,
        "unknowns": program.unknowns,
        "conditions": program.conditions,
        "equalities": int((program.lower == program.upper).sum()),
        "measured": list(measured),
        "best": about,
        "sha256": hashlib.sha256(text).hexdigest(),
    }
    nlp = {"x0": program.x0, "p0": program.nlp()["p0"], "lbg": program.lower, "ubg": program.upper}
    vectors = {**nlp, "unit": program.unit, "x": x, "multipliers": multipliers}
    numbers = {
        key: None if v is None else [n if np.isfinite(n) else None for n in v.tolist()] for key, v in vectors.items()
    }
    return fresh, text, json.dumps(numbers, separators=(",", ":")).encode("ascii")


def _same(old: load.Problem, function: ca.Function) -> bool:
    """Whether a function has the values of the one that is there, up to rounding."""
    if function.size_in(0) != old.function.size_in(0):
        return False
    for point in (old.x0, old.x0 + 0.1 * old.unit * np.cos(np.arange(len(old.x0)))):
        a, b = (np.concatenate([np.asarray(v).ravel() for v in f(point, old.p0)]) for f in (old.function, function))
        if a.shape != b.shape or not np.allclose(a, b, rtol=1e-11, atol=1e-11 * np.abs(a).max()):
            return False
    return True


def main(*names: str) -> None:
    rows, files = [], {}
    for entry in entries().values():
        if names and entry.name not in names:
            rows.append(known()[entry.name])
            for name in (f"{entry.name}.casadi", f"{entry.name}.json"):
                files[name] = load.read(name)
            continue
        row, files[f"{entry.name}.casadi"], files[f"{entry.name}.json"] = written(entry)
        rows.append(row)
        told = "none" if row["best"] is None else f"{row['best']['objective']:.10g} by {row['best']['solver']}"
        print(f"{entry.name}: {row['unknowns']} unknowns, best {told}", file=sys.stderr, flush=True)
    head = {"set": "symmotion", "version": 2, "licence": LICENCE, "casadi": ca.CasadiMeta.version(), "problems": rows}
    # A problem a line: a change of one is a change of one line.
    lines = ",\n".join(json.dumps(row, ensure_ascii=False) for row in rows)
    start = json.dumps({**head, "problems": []}, ensure_ascii=False)[:-2]
    load.MANIFEST.write_text(f"{start}\n{lines}\n]}}\n", encoding="utf-8")
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w", format=tarfile.USTAR_FORMAT) as archive:
        # Alike ones beside each other: texts first, which share kernels.
        for name in sorted(files, key=lambda n: (n.endswith(".json"), list(files).index(n))):
            about = tarfile.TarInfo(name)
            about.size = len(files[name])
            archive.addfile(about, io.BytesIO(files[name]))
    load.ARCHIVE.write_bytes(lzma.compress(packed.getvalue(), preset=9 | lzma.PRESET_EXTREME))


if __name__ == "__main__":
    main(*sys.argv[1:])
