"""`symmotion fair`: a two-parameter net made fair."""

import argparse

from symmotion import checks
from symmotion.commands.inputs import add_pipes
from symmotion.commands.outputs import check_outputs, write_outputs
from symmotion.commands.parsing import Commands, add_command, add_input, add_outputs, say
from symmotion.errors import InputError, SolveError
from symmotion.fairing import METHODS, fair
from symmotion.fairing.coordinates import PARTS
from symmotion.files.formats import read_file, rows
from symmotion.files.table import FORMATS
from symmotion.motions.two_parameter import TwoParameterMotion

EXAMPLE = "  symmotion fair net.json -o fair.json fair.npz --target 0.002"
READ, WRITTEN = rows(FORMATS, "read", "net"), rows(FORMATS, "write", "net")


def add(commands: Commands) -> None:
    """The command and its options."""
    parser = add_command(
        commands,
        "fair",
        run,
        "a two-parameter net made fair",
        about="Smaller jumps of the third derivatives at the knots; the outermost controls stay.",
        example=EXAMPLE,
        formats=READ,
    )
    add_input(parser, READ, "a two-parameter motion or net")
    add_outputs(parser, WRITTEN)
    add_pipes(parser, READ)
    parser.add_argument("--method", default="greedy", metavar="NAME", help=f"{', '.join(METHODS)}; default: greedy")
    parser.add_argument("--target", type=float, metavar="G", help="of the sum of squared jumps; default: least reached")
    parser.add_argument("--max-steps", type=int, metavar="N", help="default: 100 per knot")
    parser.add_argument("--tolerance", type=float, metavar="D", help="how far a control may go")
    parser.add_argument("--weight", type=float, metavar="W", help="of least-squares: of the distance to the start")
    parser.add_argument("--region", type=float, nargs=4, metavar=("U0", "U1", "V0", "V1"), help="fair only there")
    parser.add_argument("--parts", metavar="NAME", help=f"{', '.join(PARTS)}; default: all that moves")
    parser.add_argument(
        "--length", type=float, default=1.0, metavar="L", help="unit of dual part, translation; default: 1"
    )


def run(options: argparse.Namespace) -> None:
    """Fair and write the motion; SolveError where the target is not reached."""
    _check(options)
    given = check_outputs(options, WRITTEN)
    motion = read_file(options.file, TwoParameterMotion, FORMATS, "net", format=options.format)
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
    write_outputs(result.motion, options, WRITTEN, given)
    say(options, result)


def _check(options: argparse.Namespace) -> None:
    """Raise InputError for values that cannot be."""
    checks.choice(options.method, METHODS, "--method")
    for name in ("target", "weight", "length"):
        if (value := getattr(options, name)) is not None:
            checks.positive(value, f"--{name}")
    if options.tolerance is not None and not options.tolerance >= 0:
        raise InputError(f"--tolerance {options.tolerance!r}: a number, 0 or more, is needed")
    if options.parts is not None:
        checks.choice(options.parts, PARTS, "--parts")
    if options.max_steps is not None:
        checks.whole(options.max_steps, 0, "--max-steps")
