"""Read the problem set. This file needs CasADi, with the NumPy that it brings, and nothing else: take it with you.

    python load.py                              the problems by name
    python load.py pace-3                       what is known of one, checked
    python load.py pace-3 --solver ipopt        a solver of CasADi's on it, checked in the same way

minimise f(x) subject to lbg ≤ g(x) ≤ ubg, from x0. Multipliers have the sign of CasADi's: ∇f + Jᵀλ = 0, λ ≥ 0 at an
upper and ≤ 0 at a lower bound.
"""

import argparse
import hashlib
import json
import lzma
import tarfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

HERE = Path(__file__).resolve().parent
MANIFEST, ARCHIVE = HERE / "manifest.json", HERE / "problems.tar.xz"
# Bounds that are nearer than this, in units of what a condition moves by, are met; multipliers below it are none.
MET = 1e-6


@dataclass(frozen=True, eq=False)
class Problem:
    """A nonlinear program.

    function: (x, p) ↦ (f, g); x0 (n,), p0, lbg, ubg (m,); unit (n,): what counts as one of each unknown.
    x, multipliers: of the best minimum known, None where none is; about: its row of the manifest.
    """

    name: str
    function: ca.Function
    x0: np.ndarray
    p0: np.ndarray
    lbg: np.ndarray
    ubg: np.ndarray
    unit: np.ndarray
    x: np.ndarray | None
    multipliers: np.ndarray | None
    about: dict[str, Any]

    def nlp(self) -> dict[str, ca.MX]:
        """x, p, f and g, as `casadi.nlpsol` takes them."""
        x, p = ca.MX.sym("x", len(self.x0)), ca.MX.sym("p", len(self.p0))
        f, g = self.function(x, p)
        return {"x": x, "p": p, "f": f, "g": g}

    def solve(self, solver: str, options: dict[str, Any] | None = None) -> tuple[np.ndarray, np.ndarray, Any]:
        """Where a solver of CasADi's ends, the multipliers there, and what it says: x (n,), λ (m,), its statistics."""
        made = ca.nlpsol("solver", solver, self.nlp(), {"print_time": False, "error_on_fail": False, **(options or {})})
        found = made(x0=self.x0, p=self.p0, lbg=self.lbg, ubg=self.ubg)
        return np.asarray(found["x"]).ravel(), np.asarray(found["lam_g"]).ravel(), made.stats()

    @property
    def _derivatives(self) -> ca.Function:
        nlp = self.nlp()
        multipliers = ca.MX.sym("lam", len(self.lbg))
        lagrangian = nlp["f"] + ca.dot(multipliers, nlp["g"])
        hessian, gradient = ca.hessian(lagrangian, nlp["x"])
        jacobian = ca.jacobian(nlp["g"], nlp["x"])
        return ca.Function("d", [nlp["x"], nlp["p"], multipliers], [nlp["f"], nlp["g"], gradient, jacobian, hessian])

    def check(self, x: np.ndarray, multipliers: np.ndarray) -> dict[str, float]:
        """First- and second-order conditions at a point x (n,) with multipliers (m,), dense: for up to some 1,000.

        stationarity ‖∇f + Jᵀλ‖∞; violation ‖·‖∞; decrement ½ rᵀM⁻¹r along the conditions that press, by how much a
        Newton step would still lower f; complementarity max |λ| · slack; curvature: the least eigenvalue of the Hessian
        of the Lagrangian there, relative to the largest, with unknowns in their units; independence: the least
        singular value of the conditions that press, rows of length one, 0 where they depend on each other.
        """
        f, g, gradient, jacobian, hessian = (np.asarray(v) for v in self._derivatives(x, self.p0, multipliers))
        g, residual = g.ravel(), gradient.ravel()
        violation = np.maximum(g - self.ubg, 0) + np.maximum(self.lbg - g, 0)
        equal = self.lbg == self.ubg
        towards = np.where(multipliers > 0, self.ubg - g, np.where(multipliers < 0, g - self.lbg, 0.0))
        slack = np.where(equal, 0.0, np.clip(towards, 0.0, None))
        rows = jacobian * self.unit
        reach = np.abs(rows).sum(axis=1)
        reach[reach == 0] = 1.0
        press = np.abs(multipliers) * reach
        pressing = equal | ((press / (press.max(initial=0.0) or 1.0) > slack / reach) & (multipliers != 0))
        lengths = np.linalg.norm(rows[pressing], axis=1, keepdims=True)
        # A gradient that vanishes stays next to nothing.
        scaled = rows[pressing] / np.maximum(lengths, MET * lengths.max(initial=0.0) or 1.0)
        _, sizes, basis = (
            np.linalg.svd(scaled, full_matrices=True) if pressing.any() else (0, np.ones(0), np.eye(len(x)))
        )
        free = basis[int((sizes > MET * sizes.max(initial=0.0)).sum()) :].T
        reduced = free.T @ (self.unit[:, None] * hessian * self.unit) @ free
        values, vectors = np.linalg.eigh((reduced + reduced.T) / 2) if reduced.size else (np.ones(1), np.ones((1, 1)))
        along = vectors.T @ (free.T @ (self.unit * residual)) if reduced.size else np.zeros(1)
        largest = float(np.abs(values).max()) or 1.0
        return {
            "objective": float(f.item()),
            "stationarity": float(np.abs(residual).max()),
            "violation": float(violation.max(initial=0.0)),
            "decrement": float(0.5 * np.sum(along**2 / np.maximum(np.abs(values), 1e-15 * largest))),
            "complementarity": float((np.abs(multipliers) * np.where(np.isfinite(slack), slack, 1.0)).max(initial=0.0)),
            "curvature": float(values.min() / largest),
            "independence": float(sizes.min(initial=1.0)) if len(scaled) <= len(x) else 0.0,
        }


@cache
def manifest() -> dict[str, Any]:
    """What is said of the set and of each problem."""
    return json.loads(MANIFEST.read_text(encoding="utf-8"))


def names(family: str | None = None) -> list[str]:
    """The problems' names, in order; of one family."""
    return [row["name"] for row in manifest()["problems"] if family in (None, row["family"])]


def read(name: str) -> bytes:
    """A file of the archive."""
    return _archive()[name]


@cache
def _archive() -> dict[str, bytes]:
    with lzma.open(ARCHIVE) as packed, tarfile.open(fileobj=packed) as files:
        opened = ((member.name, files.extractfile(member)) for member in files)
        return {name: file.read() for name, file in opened if file is not None}


def load(name: str) -> Problem:
    """The problem of a name; its text is the one that the manifest has the checksum of."""
    about = next((row for row in manifest()["problems"] if row["name"] == name), None)
    if about is None:
        raise KeyError(f"no problem {name!r}: names() lists them")
    text, told = read(f"{name}.casadi"), json.loads(read(f"{name}.json"))
    if hashlib.sha256(text).hexdigest() != about["sha256"]:
        raise ValueError(f"{name}: not the text that the manifest has the checksum of")
    # JSON has no infinity: a bound that is none is null.
    x0, p0, lbg, ubg, unit = (np.array(told[key], dtype=float) for key in ("x0", "p0", "lbg", "ubg", "unit"))
    lbg, ubg = np.where(np.isnan(lbg), -np.inf, lbg), np.where(np.isnan(ubg), np.inf, ubg)
    best = [None if told[key] is None else np.array(told[key]) for key in ("x", "multipliers")]
    function = ca.Function.deserialize(text.decode("ascii"))
    return Problem(name, function, x0, p0, lbg, ubg, unit, best[0], best[1], about)


def main() -> None:
    parser = argparse.ArgumentParser(description="The problem set of symmotion.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="problems to check; the list of all when left out")
    parser.add_argument("--solver", metavar="PLUGIN", help="solve with this plugin of CasADi's, such as ipopt")
    options = parser.parse_args()
    for row in manifest()["problems"] if not options.names else ():
        best = row["best"] or {"objective": float("nan")}
        size = f"{row['unknowns']:5} unknowns {row['conditions']:5} conditions"
        print(f"{row['name']:22} {row['family']:22} {size}  best known {best['objective']:.10g}")
    for problem in map(load, options.names):
        points = {}
        if problem.x is not None and problem.multipliers is not None:
            points["best known"] = problem.x, problem.multipliers
        if options.solver is not None:
            x, multipliers, stats = problem.solve(options.solver)
            points[f"{options.solver}, {stats['return_status']}"] = x, multipliers
        for what, (x, multipliers) in points.items():
            found = problem.check(x, multipliers)
            print(f"{problem.name}, {what}: " + ", ".join(f"{key} {value:.6g}" for key, value in found.items()))


if __name__ == "__main__":
    main()
