"""The command line: one file a command, and what becomes of their errors."""

import sys
from collections.abc import Sequence

from symmotion.commands import compare, convert, design, fair, smooth
from symmotion.commands.completion import add_completion
from symmotion.commands.inputs import piped
from symmotion.commands.parsing import Parser, add_version
from symmotion.commands.wording import worded
from symmotion.errors import InputError, SolveError

INTERRUPTED = 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command: 0, 1 where a solve failed, 2 for bad input, 130 where it was interrupted."""
    options = parser().parse_args(arguments)
    try:
        with piped(options):
            options.run(options)
    except (InputError, SolveError) as error:
        print(f"symmotion {options.name}: {worded(str(error), options)}", file=sys.stderr)
        return 2 if isinstance(error, InputError) else 1
    except KeyboardInterrupt:
        print(f"symmotion {options.name}: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # whoever reads has seen enough
        sys.stderr.close()
        return 0
    return 0


def parser() -> Parser:
    """The commands and their options."""
    made = Parser(prog="symmotion", description="Smooth motions through keyframes.")
    add_version(made)
    add_completion(made)
    commands = made.add_subparsers(title="commands", required=True, dest="name", parser_class=Parser)
    for command in (smooth, compare, design, convert, fair):
        command.add(commands)
    return made
