"""`symmotion compare`: the solvers side by side on your keyframes."""

import argparse
from pathlib import Path
from time import perf_counter

from symmotion.bodies.shapes import UPRIGHT
from symmotion.commands.inputs import add_reading, recording_of
from symmotion.commands.objectives import OBJECTIVES, objective_by_name
from symmotion.commands.parsing import (
    Commands,
    add_command,
    add_input,
    add_spline,
    at_fault,
    check_spline,
    named,
    say,
)
from symmotion.commands.wording import note
from symmotion.design.question import keyframe_notes
from symmotion.errors import SolveError
from symmotion.files.formats import rows
from symmotion.files.table import FORMATS
from symmotion.solvers import solver_by_name

EXAMPLE = "  symmotion compare poses.tum --objective rigidity rigidity2 --solvers newton ipopt -o report"
SOLVERS = ("newton", "ipopt", "elimination")
READ = rows(FORMATS, "read", "keyframes")


def add(commands: Commands) -> None:
    """The command and its options."""
    parser = add_command(
        commands,
        "compare",
        run,
        "solvers side by side on your keyframes, as a report",
        example=EXAMPLE,
        formats=READ,
    )
    add_input(parser, READ, "keyframes", several=True)
    parser.add_argument("-o", "--output", type=Path, default=Path("report"), metavar="DIR", help="default: report")
    parser.add_argument(
        "--objective",
        nargs="+",
        default=["rigidity"],
        metavar="NAME",
        help=f"{', '.join(OBJECTIVES)} or weighted sums such as rigidity+0.001*energy; default: rigidity",
    )
    parser.add_argument("--solvers", nargs="+", default=SOLVERS, metavar="NAME", help=f"default: {' '.join(SOLVERS)}")
    parser.add_argument("--up", choices=UPRIGHT, help="the axis that is upright; default: as FILE says, else z")
    add_spline(parser)
    add_reading(parser, READ, writes=False)


def run(options: argparse.Namespace) -> None:
    """Compare and write the report; SolveError where no minimum of one of the problems is certified."""
    # Matplotlib and Jinja take longer to import than a design takes to solve.
    from symmotion.report import StudyRecord, require_writable, write_report
    from symmotion.report.comparison import compared, comparison_result

    check_spline(options)
    with at_fault("--solvers"):
        solvers = [solver_by_name(name) for name in options.solvers]
    files = [(path, recording_of(options, READ, path=path)) for path in options.files]
    with at_fault("--objective"):
        asked = [
            [objective_by_name(name, found.keyframes.dimension) for name in options.objective] for _, found in files
        ]
    require_writable(options.output)
    records, failed = [], False
    for k, ((path, recording), objectives) in enumerate(zip(files, asked, strict=True)):
        began, keys = perf_counter(), recording.keyframes
        note(options, path, keyframe_notes(keys.times, keys.linear))
        with at_fault(path):
            comparisons = compared(keys, objectives, options.degree, options.refine, solvers)
            result = comparison_result(keys, objectives, comparisons, up=options.up or recording.up or "z")
        failed |= not all(any(s.certified for s in c.found) for c in comparisons.values())
        shown = str(named(options, path))
        name = "standard input" if shown == "-" else path.stem
        question = f"{name}: {len(keys)} keyframes in {'the plane' if keys.dimension == 2 else 'space'}"
        records.append(StudyRecord(f"file_{k + 1}", question, shown, perf_counter() - began, result))
        told = (f"{objective}\n{c}\n{c.verdict}\n" for objective, c in comparisons.items())
        say(options, "\n".join((f"{shown}: {question.partition(': ')[2]}\n", *told)))
    settings = f"Degree {options.degree}, {options.refine} inserted knots per segment."
    page = write_report(records, options.output, "symmotion: comparison", settings)
    say(options, f"report: {page}")
    if failed:
        raise SolveError("no minimum of one of the problems is certified; the report says why")
