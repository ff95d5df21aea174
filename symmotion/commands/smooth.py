"""`symmotion smooth`: a recording or keyframes to a motion."""

import argparse

from symmotion.commands.inputs import add_reading, progress, recording_of
from symmotion.commands.outputs import check_outputs, write_outputs
from symmotion.commands.parsing import (
    Commands,
    add_command,
    add_format_options,
    add_input,
    add_outputs,
    at_fault,
    say,
)
from symmotion.commands.wording import note
from symmotion.errors import InputError, SolveError
from symmotion.files.formats import row_of, rows
from symmotion.files.table import FORMATS
from symmotion.smoothing import is_rigid, plan

EXAMPLE = """\
  symmotion smooth poses.tum -o motion.json motion.tum
  symmotion smooth odometry.csv --columns "time=stamp" --noise 0.005 0.01 -o smooth.csv --rate 100"""
READ = rows(FORMATS, "read", "keyframes")
WRITTEN = rows(FORMATS, "write", "motion", "scene", "film")


def add(commands: Commands) -> None:
    """The command and its options."""
    parser = add_command(
        commands,
        "smooth",
        run,
        "a recording or keyframes to a motion, smoothed as much as its noise asks for",
        example=EXAMPLE,
        formats=(*READ, *WRITTEN),
    )
    add_input(parser, READ, "a recording or keyframes")
    add_outputs(parser, WRITTEN)
    parser.add_argument(
        "--noise",
        type=float,
        nargs="+",
        metavar="S",
        help="standard deviations of places and of turns in rad; 0: interpolate; default: estimated",
    )
    add_reading(parser, READ)
    add_format_options(parser, WRITTEN, "write")


def run(options: argparse.Namespace) -> None:
    """Smooth and write the motion."""
    noise = options.noise
    if noise is not None and noise != [0.0] and len(noise) != 2:
        raise InputError("--noise: two numbers are needed, of places and of turns in rad, or 0 to interpolate")
    given = check_outputs(options, WRITTEN)
    recording = recording_of(options, READ)
    if is_rigid(recording.keyframes) and any(row_of(p, WRITTEN).name in ("tum", "bvh") for p in options.output):
        given["orthonormalise"] = True
    with at_fault("--noise") if noise is not None else at_fault(options.file):
        planned = plan(recording.keyframes, noise=0 if noise == [0.0] else noise)
    note(options, options.file, planned.notes)
    try:
        with progress(options, f"{planned.program.unknowns} unknowns"):
            solution = planned.solve()
    except (InputError, SolveError) as error:
        raise type(error)(f"{options.file}: {error}") from error
    write_outputs(solution.motion, options, WRITTEN, {"up": recording.up, **given})
    say(options, solution)
