"""What the commands' options have in common."""

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

from symmotion.design.spans import knots_between, spline_degree
from symmotion.errors import InputError, plain
from symmotion.files.formats import Format, Option, Way, endings, takers
from symmotion.version import __version__


class Parser(argparse.ArgumentParser):
    """Errors in one line, without the usage."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {plain(message)}\n")


# Any: what argparse returns where commands are added, which has no public name.
Commands = Any
Run = Callable[[argparse.Namespace], None]


def add_version(parser: argparse.ArgumentParser) -> None:
    """`--version`."""
    parser.add_argument(
        "--version", action="version", version=f"symmotion {__version__}", help="show the version and end"
    )


def add_command(
    commands: Commands, name: str, run: Run, help: str, *, example: str, formats: Sequence[Format], about: str = ""
) -> argparse.ArgumentParser:
    """A command with what all of them have; formats: those that its help explains."""
    parser = commands.add_parser(
        name,
        help=help,
        description=about or f"{help[0].upper()}{help[1:]}.",
        epilog=f"formats:\n{explained(formats)}\n\nexample:\n{example}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(run=run)
    add_version(parser)
    parser.add_argument("--quiet", action="store_true", help="say nothing but what went wrong")
    return parser


def explained(formats: Sequence[Format]) -> str:
    """A line for each format: its endings, what it holds, and its help."""
    lines = [(dotted(row.endings), f"{row.holds}: {row.help}") for row in formats]
    width = max(len(names) for names, _ in lines)
    return "\n".join(f"  {names:{width}}  {what}" for names, what in lines)


def dotted(names: Sequence[str]) -> str:
    """Endings as a text has them: .csv, .tum."""
    return ", ".join(f".{name}" for name in names)


def add_input(parser: argparse.ArgumentParser, formats: Sequence[Format], what: str, *, several: bool = False) -> None:
    """FILE, or FILE…, of these formats, as `file` or `files`."""
    shown = f"{what}: {dotted(endings(formats))}"
    if several:
        parser.add_argument("files", metavar="FILE", nargs="+", type=Path, help=shown)
    else:
        parser.add_argument("file", metavar="FILE", type=Path, help=shown)


def add_outputs(parser: argparse.ArgumentParser, formats: Sequence[Format]) -> None:
    """`-o OUT…`, as `output`."""
    shown = f"the ending is the format: {dotted(endings(formats))}"
    parser.add_argument("-o", "--output", nargs="+", type=Path, required=True, metavar="OUT", help=shown)


def add_spline(parser: argparse.ArgumentParser) -> None:
    """`--degree` and `--refine`."""
    parser.add_argument("--degree", type=int, default=3, metavar="P", help="default: 3")
    parser.add_argument("--refine", type=int, default=1, metavar="K", help="knots per segment; default: 1")


def check_spline(options: argparse.Namespace) -> None:
    """Raise InputError for a degree or number of knots that cannot be."""
    spline_degree(options.degree, what="--degree")
    knots_between(options.refine, "--refine")


def flag_of(name: str) -> str:
    """The flag of an option of the table."""
    return f"--{name.replace('_', '-')}"


def spoken(formats: Sequence[Format], way: Way) -> dict[str, list[Option]]:
    """By name, what words can say of how these formats are read, or written: formats may mean different things."""
    found: dict[str, list[Option]] = {}
    for row in formats:
        for option in row.options(way):
            if option.of_text is not None and option not in found.setdefault(option.name, []):
                found[option.name].append(option)
    return {name: options for name, options in found.items() if options}


def add_format_options(
    parser: argparse.ArgumentParser, formats: Sequence[Format], way: Way, leave: Sequence[str] = ()
) -> None:
    """The options that the formats have; leave: names that mean something else to the command."""
    for name, options in spoken(formats, way).items():
        if name in leave:
            continue
        flag, shown = flag_of(name), "; ".join(_meaning(option, formats, way) for option in options)
        if options[0].of_text is bool:
            parser.add_argument(flag, dest=f"{way}_{name}", help=shown, action="store_true")
        else:
            of_text = options[0].of_text or str
            parser.add_argument(flag, dest=f"{way}_{name}", help=shown, type=of_text, metavar=name.upper())


def format_options(
    options: argparse.Namespace, formats: Sequence[Format], way: Way, used: Sequence[Format]
) -> dict[str, object]:
    """The values of those that `add_format_options` added and that were given, checked.

    Raises InputError for one that none of the formats used takes, and for a value that its option cannot have.
    """
    given: dict[str, object] = {}
    for name, known in spoken(formats, way).items():
        value = getattr(options, f"{way}_{name}", None)
        if value is None or value is False:
            continue
        if not set(takers(name, way, formats)) & set(takers(name, way, used)):
            raise InputError(f"{flag_of(name)} goes with {dotted(takers(name, way, formats))}: leave it out")
        check = known[0].check
        given[name] = value if check is None else check(value, flag_of(name))
    return given


@contextmanager
def at_fault(culprit: object) -> Iterator[None]:
    """Put the name of the option, or file, before what is wrong with it."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{culprit}: {error}") from error


def say(options: argparse.Namespace, text: object) -> None:
    """Lines on standard output, or on standard error where a file goes there; none if the command is to be quiet."""
    if not options.quiet:
        where = sys.stderr if getattr(options, "piped_output", None) else sys.stdout
        print("\n".join(map(plain, str(text).split("\n"))), file=where)


def named(options: argparse.Namespace, culprit: object) -> object:
    """What a file is called, standard input as it was asked for."""
    return "-" if culprit == getattr(options, "piped_input", None) else culprit


def _meaning(option: Option, formats: Sequence[Format], way: Way) -> str:
    having = [row for row in formats if option in row.options(way)]
    default = "" if option.default is None or option.default is False else f"; default: {option.default:g}"
    return f"of {dotted(endings(having))}: {option.meaning}{default}"
