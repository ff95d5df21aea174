"""The command line: `symmotion compare`, `symmotion design` and `symmotion fair`."""

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter
from typing import Any, NoReturn

import numpy as np

from symmotion.answers import auto_knots
from symmotion.commands.outputs import check_outputs, write_output
from symmotion.constraints import MotionConstraint, Periodic, Tolerance
from symmotion.design import affine_program, free_times_program
from symmotion.energies import Energy, Rigidity, TrajectoryEnergy
from symmotion.errors import InputError, SolveError
from symmotion.files import read_keyframes
from symmotion.files.formats import format_of
from symmotion.motions import Keyframes
from symmotion.solvers import Solution, solver_by_name

KEYFRAMES = "keyframes: .tum, .kitti, .csv, .json; of a node: .bvh, .glb, .gltf"
OBJECTIVES = ("rigidity", "rigidity2", "energy")
EXAMPLES = {
    "compare": """\
example:
  symmotion compare poses.tum --objective rigidity rigidity2 --solvers newton ipopt -o report
""",
    "design": """\
example:
  symmotion design poses.tum -o motion.json motion.csv --objective rigidity+0.001*energy
  symmotion design walk.bvh --node LeftHand -o hand.glb hand.usda hand.gif
""",
    "fair": """\
example:
  symmotion fair net.json -o fair.json fair.npz --target 0.002
""",
}


class Parser(argparse.ArgumentParser):
    """Errors in one line, without the usage."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message}\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command: 0, 1 where a solve failed, 2 for bad input."""
    options = _parser().parse_args(arguments)
    try:
        return options.command(options)
    except InputError as error:
        print(f"symmotion {options.name}: {error}", file=sys.stderr)
        return 2
    except SolveError as error:
        print(f"symmotion {options.name}: {error}", file=sys.stderr)
        return 1


def objective_by_name(text: str, dimension: int) -> Energy:
    """An objective from its name or a weighted sum of names, such as "rigidity+0.001*energy".

    Names: rigidity (or R), rigidity2 (R*), energy (E, of the unit points and their opposites).
    """
    points = np.concatenate([np.eye(dimension), -np.eye(dimension)])
    known: dict[str | Any, Energy] = dict(
        zip(OBJECTIVES, (Rigidity(), Rigidity(2), TrajectoryEnergy(points)), strict=True)
    )
    known |= dict(zip(("R", "R*", "E"), known.values(), strict=True))
    total: Energy | None = None
    # A plus after an exponent's e belongs to the number.
    for part in re.split(r"(?<![0-9.][eE])\+", text):
        match = re.fullmatch(r"\s*(?:([-+0-9.eE]+)\s*\*\s*)?([A-Za-z0-9]+\*?)\s*", part)
        if match is None or match[2] not in known:
            raise InputError(f"objective {part.strip()!r} is unknown; there are {', '.join(OBJECTIVES)} and their sums")
        try:
            weight = float(match[1] or 1)
        except ValueError:
            raise InputError(f"objective {part.strip()!r}: {match[1]!r} is no number") from None
        term = weight * known[match[2]] if match[1] else known[match[2]]
        total = term if total is None else total + term
    assert total is not None
    return total


def _compare(options: argparse.Namespace) -> int:
    # Matplotlib and Jinja take longer to import than a design takes to solve.
    from symmotion.report import StudyRecord, require_writable, write_report
    from symmotion.report.comparison import comparison_result

    solvers = [solver_by_name(name) for name in options.solvers]
    files = [(path, read_keyframes(path)) for path in options.files]
    require_writable(options.output)
    records, failed = [], False
    for k, (path, keyframes) in enumerate(files):
        began = perf_counter()
        try:
            objectives = [objective_by_name(name, keyframes.dimension) for name in options.objective]
            result = comparison_result(keyframes, objectives, options.degree, options.refine, solvers)
        except InputError as error:
            raise InputError(f"{path}: {error}") from error
        reached = {r.case for r in result.runs if r.status == "solved" and r.inertia != "indefinite"}
        failed |= any(o.name not in reached for o in objectives)
        question = f"{path}: {len(keyframes)} keyframes in {keyframes.dimension}D"
        records.append(StudyRecord(f"file_{k + 1}", question, "your keyframes", perf_counter() - began, result))
    page = write_report(records, options.output, "symmotion: comparison", _settings(options))
    for record in records:
        print(f"{record.question}\n{record.result.conclusion if record.result else record.error}\n")
    print(f"report: {page}")
    if failed:
        raise SolveError("no solver reached a minimum of one of the problems; the report says why")
    return 0


def _settings(options: argparse.Namespace) -> str:
    return f"Degree {options.degree}, {options.refine} inserted knots per segment."


def _design(options: argparse.Namespace) -> int:
    # Before the work, not after it.
    check_outputs(options.output, options.file, options.seconds, options.rate, options.orthonormalise)
    keyframes = read_keyframes(options.file, node=options.node)
    try:
        objective = objective_by_name(options.objective, keyframes.dimension)
        solution = _solve(options, keyframes, objective)
    except (InputError, SolveError) as error:
        raise type(error)(f"{options.file}: {error}") from error
    for path in options.output:
        said = write_output(solution.motion, path, options.rate, options.orthonormalise, options.seconds)
        print(f"wrote {said}")
    print(solution)
    return 0


def _solve(options: argparse.Namespace, keyframes: Keyframes, objective: Energy) -> Solution:
    """The optimal motion that the options ask for; InputError for options that do not go together."""
    constraints: list[MotionConstraint] = [Periodic()] if options.periodic else []
    if options.tolerance is not None:
        constraints.append(Tolerance(linear=options.tolerance))
    name = options.solver or ("ipopt" if options.tolerance is not None else "newton")
    if options.auto_knots is not None:
        if constraints or options.free_times:
            raise InputError("--auto-knots does not go with --periodic, --tolerance or --free-times: leave one out")
        solver = solver_by_name(name)
        return auto_knots(
            keyframes, degree=options.degree, objective=objective, budget=options.auto_knots, solver=solver
        ).solution
    if options.free_times:
        if constraints:
            raise InputError("--free-times does not go with --periodic or --tolerance: leave one out")
        program = free_times_program(keyframes, degree=options.degree, refine=options.refine, objective=objective)
        return solver_by_name(options.solver or "ipopt").solve(program).require()
    program = affine_program(
        keyframes,
        degree=options.degree,
        refine=options.refine,
        objective=objective,
        constraints=constraints,
        ends=options.ends,
    )
    return solver_by_name(name).solve(program).require()


def _fair(options: argparse.Namespace) -> int:
    from symmotion.fairing import fair
    from symmotion.files import read_two_parameter, write_two_parameter

    for path in options.output:
        format_of(path, None, ("json", "npz"))  # before the work, not after it
    motion = read_two_parameter(options.file)
    region = None if options.region is None else (options.region[:2], options.region[2:])
    try:
        result = fair(
            motion,
            options.method,
            target=options.target,
            max_steps=options.max_steps,
            tolerance=options.tolerance,
            weight=options.weight,
            region=region,
            parts=options.parts,
            length=options.length,
        ).require(options.target)
    except (InputError, SolveError) as error:
        raise type(error)(f"{options.file}: {error}") from error
    for path in options.output:
        write_two_parameter(result.motion, path)
        print(f"wrote {path}")
    print(result)
    return 0


def _add_fair(commands: Any) -> None:
    fair = commands.add_parser(
        "fair",
        help="a two-parameter net made fair",
        description="Smaller jumps of the third derivatives at the knots; the outermost controls stay.",
        epilog=EXAMPLES["fair"],
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    fair.set_defaults(command=_fair)
    fair.add_argument(
        "file",
        metavar="FILE",
        type=Path,
        help=".json, .npz: a motion written by symmotion, or a net: axis, angle [rad], translation, knots_u, knots_v",
    )
    fair.add_argument(
        "-o", "--output", nargs="+", type=Path, required=True, metavar="OUT", help=".json, .npz: the motion, exactly"
    )
    fair.add_argument(
        "--method", default="greedy", metavar="NAME", help="greedy (default), orthogonal, least-squares, bounded"
    )
    fair.add_argument("--target", type=float, metavar="G", help="of the sum of squared jumps; default: least reached")
    fair.add_argument("--max-steps", type=int, metavar="N", help="default: 100 per knot")
    fair.add_argument("--tolerance", type=float, metavar="D", help="how far a control may go")
    fair.add_argument("--weight", type=float, metavar="W", help="of least-squares: of the distance to the start")
    fair.add_argument("--region", type=float, nargs=4, metavar=("U0", "U1", "V0", "V1"), help="fair only there")
    fair.add_argument(
        "--parts", metavar="NAME", help="real, dual, translation, real+dual, real+translation; default: all that moves"
    )
    fair.add_argument(
        "--length", type=float, default=1.0, metavar="L", help="unit of dual part, translation; default: 1"
    )


def _parser() -> argparse.ArgumentParser:
    parser = Parser(prog="symmotion", description="Smooth motions through keyframes.")
    commands = parser.add_subparsers(title="commands", required=True, dest="name", parser_class=Parser)
    compare = commands.add_parser(
        "compare",
        help="solvers side by side on your keyframes, as a report",
        epilog=EXAMPLES["compare"],
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    compare.set_defaults(command=_compare)
    compare.add_argument("files", metavar="FILE", nargs="+", type=Path, help=KEYFRAMES)
    compare.add_argument("-o", "--output", type=Path, default=Path("report"), metavar="DIR", help="default: report")
    compare.add_argument(
        "--objective",
        nargs="+",
        default=["rigidity"],
        metavar="NAME",
        help=f"{', '.join(OBJECTIVES)} or weighted sums such as rigidity+0.001*energy; default: rigidity",
    )
    compare.add_argument(
        "--solvers",
        nargs="+",
        default=["newton", "ipopt", "elimination"],
        metavar="NAME",
        help="default: newton ipopt elimination",
    )
    design = commands.add_parser(
        "design",
        help="one optimal motion through your keyframes",
        epilog=EXAMPLES["design"],
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    design.set_defaults(command=_design)
    design.add_argument("file", metavar="FILE", type=Path, help=KEYFRAMES)
    design.add_argument(
        "-o",
        "--output",
        nargs="+",
        type=Path,
        required=True,
        metavar="OUT",
        help=".json: exact; .csv, .tum: samples; .glb, .usda: an animated scene; .gif, .mp4: a film",
    )
    design.add_argument(
        "--node",
        type=lambda text: int(text) if text.isdecimal() else text,
        metavar="NAME",
        help="joint of a .bvh or node of a .glb, .gltf, by name or index; default: the root",
    )
    design.add_argument("--seconds", type=float, metavar="S", help="length of .glb, .usda, .gif, .mp4")
    design.add_argument("--objective", default="rigidity", metavar="NAME", help="as for compare; default: rigidity")
    design.add_argument("--solver", metavar="NAME", help="default: newton; ipopt with --tolerance and --free-times")
    design.add_argument("--periodic", action="store_true", help="close the motion with its derivatives")
    design.add_argument("--tolerance", type=float, metavar="E", help="meet each entry of the A*ᵢ to within E only")
    design.add_argument("--auto-knots", type=int, metavar="N", help="insert at most N knots, where they pay most")
    design.add_argument("--free-times", action="store_true", help="choose the inner keyframe times too, order kept")
    design.add_argument("--ends", default="natural", metavar="NAME", help="of the start: natural, not-a-knot, periodic")
    design.add_argument("--rate", type=float, metavar="R", help="samples of .csv, .tum per unit of time; default: 200")
    design.add_argument(
        "--orthonormalise", action="store_true", help="write the closest rotation of each sample to .tum"
    )
    for command in (compare, design):
        command.add_argument("--degree", type=int, default=3, metavar="P", help="default: 3")
        command.add_argument("--refine", type=int, default=1, metavar="K", help="knots per segment; default: 1")
    _add_fair(commands)
    return parser


if __name__ == "__main__":
    raise SystemExit(main())
