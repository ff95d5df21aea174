"""`symmotion fair`: a two-parameter net made fair."""

import argparse
from pathlib import Path
from typing import cast, get_args

from symmotion import checks
from symmotion.commands.inputs import add_pipes
from symmotion.commands.outputs import check_outputs, write_outputs
from symmotion.commands.parsing import Commands, add_command, add_input, add_outputs, say
from symmotion.errors import InputError, SolveError
from symmotion.fairing import METHODS, Continued, fair
from symmotion.fairing.borders import SIDES, Border, Borders, Hold, Order
from symmotion.fairing.coordinates import PARTS
from symmotion.files.formats import read_file, rows
from symmotion.files.grids import read_matrix, read_tool_path
from symmotion.files.table import FORMATS
from symmotion.motions.two_parameter import TwoParameterMotion

EXAMPLE = """\
  symmotion fair net.json -o fair.json fair.npz --target 0.002
  symmotion fair net.json -o fair.json --noise 0.01 --keyframes kept.csv --borders u0=G1 u1=G1:next.json"""
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
    parser.add_argument(
        "--method", metavar="NAME", help=f"{', '.join(METHODS)}; default: greedy, with --noise least-squares"
    )
    parser.add_argument("--target", type=float, metavar="G", help="of the sum of squared jumps; default: least reached")
    parser.add_argument("--max-steps", type=int, metavar="N", help="default: 100 per knot")
    parser.add_argument("--tolerance", type=float, metavar="D", help="how far a control may go")
    parser.add_argument("--weight", type=float, metavar="W", help="of least-squares: of the distance to the start")
    parser.add_argument(
        "--noise",
        type=float,
        nargs="+",
        metavar="S",
        help="standard deviations, of all or of each part: how far to fair",
    )
    parser.add_argument(
        "--change", type=float, metavar="E", help="stop where a step changes G by less, which happens by chance"
    )
    parser.add_argument(
        "--keyframes",
        type=Path,
        metavar="TABLE",
        help="kept exactly: a table of u v x y z qw qx qy qz, or u v qw qx qy qz",
    )
    parser.add_argument(
        "--borders",
        nargs="+",
        metavar="B",
        help="ring, free, G0, G1, G2, or by side u0=G1, and u0=G1:FILE to continue the net in a file; default: ring",
    )
    parser.add_argument(
        "--weights", type=Path, metavar="TABLE", help="of the controls' displacements: a line for each u"
    )
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
    keyframes = read_tool_path(options.keyframes).keyframes() if options.keyframes else []
    borders = _borders(options.borders or ["ring"])
    weights = None if options.weights is None else read_matrix(options.weights)
    region = None if options.region is None else (options.region[:2], options.region[2:])
    try:
        result = fair(
            motion,
            options.method,
            target=options.target,
            max_steps=options.max_steps,
            change=options.change,
            tolerance=options.tolerance,
            weight=options.weight,
            noise=options.noise,
            region=region,
            parts=options.parts,
            length=options.length,
            keyframes=keyframes,
            borders=borders,
            weights=weights,
        ).require(options.target)
    except (InputError, SolveError) as error:
        raise type(error)(f"{_at_fault(options, str(error))}: {error}") from error
    write_outputs(result.motion, options, WRITTEN, given)
    say(options, result)


def _borders(words: list[str]) -> Borders:
    """One word for all sides, or sides with words, of neighbours with their files."""
    if len(words) == 1 and "=" not in words[0]:
        return _border(words[0])
    found: dict[str, Border] = {}
    for word in words:
        side, equals, border = word.partition("=")
        if not equals or side in found:
            fault = "twice" if side in found else "a word for all sides beside others"
            raise InputError(f"--borders {word}: {side} is {fault}; ring, or u0=G1 v1=free … is needed")
        found[checks.choice(side, SIDES, "--borders")] = _border(border)
    return found


def _border(word: str) -> Border:
    order, colon, path = word.partition(":")
    if not colon:
        return cast(Border, checks.choice(word, get_args(Hold), "--borders"))
    net = read_file(Path(path), TwoParameterMotion, FORMATS, "net")
    return Continued(net, cast(Order, checks.choice(order, get_args(Order), "--borders")))


def _at_fault(options: argparse.Namespace, message: str) -> str:
    """What a message is about: the table or the option that its first word comes from, else the net."""
    sources = {
        "keyframe": options.keyframes,
        "weights": options.weights,
        "border": options.borders and "--borders",
        "noise": options.noise and "--noise",
    }
    return str(next((s for word, s in sources.items() if s and message.startswith(word)), options.file))


def _check(options: argparse.Namespace) -> None:
    """Raise InputError for values that cannot be."""
    if options.method is not None:
        checks.choice(options.method, METHODS, "--method")
    for name in ("target", "weight", "length", "change"):
        if (value := getattr(options, name)) is not None:
            checks.positive(value, f"--{name}")
    if options.tolerance is not None and not options.tolerance >= 0:
        raise InputError(f"--tolerance {options.tolerance!r}: a number, 0 or more, is needed")
    if options.parts is not None:
        checks.choice(options.parts, PARTS, "--parts")
    if options.max_steps is not None:
        checks.whole(options.max_steps, 0, "--max-steps")
