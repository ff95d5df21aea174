"""The file that a command reads: its format and options, standard input, and what takes long."""

import argparse
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from shutil import copyfileobj
from tempfile import TemporaryDirectory
from time import monotonic

from symmotion import checks
from symmotion.commands.parsing import add_format_options, format_options
from symmotion.commands.wording import note
from symmotion.errors import InputError, SolveError
from symmotion.files.formats import Format, endings, read_file, row_of
from symmotion.files.recording import Recording, thinned
from symmotion.opening import LARGEST

PIPE = Path("-")
LONG = 2.0  # seconds after which it is told that something is still going on


def add_pipes(parser: argparse.ArgumentParser, formats: Sequence[Format], writes: bool = True) -> None:
    """`--format` of what is read, and `--to` of standard output where the command writes files."""
    names = ", ".join(dict.fromkeys([*(row.name for row in formats), *endings(formats)]))
    parser.add_argument("--format", metavar="NAME", help=f"of FILE, whatever its ending: {names}")
    if writes:
        parser.add_argument("--to", metavar="NAME", help="format of standard output, -o -")


def add_reading(parser: argparse.ArgumentParser, formats: Sequence[Format], writes: bool = True) -> None:
    """`--format`, `--to`, thinning, and the options of the formats."""
    add_pipes(parser, formats, writes)
    parser.add_argument("--every", type=int, metavar="N", help="keep every Nth keyframe only")
    parser.add_argument("--keep-rate", type=float, metavar="R", help="keep the keyframes nearest to R per unit of time")
    add_format_options(parser, formats, "read")


def recording_of(
    options: argparse.Namespace, formats: Sequence[Format], rate: float | None = None, path: Path | None = None
) -> Recording:
    """The keyframes that the options ask for, of one of several files the one at a path; notes go to standard error."""
    asked: Path = options.file if path is None else path
    every, kept = getattr(options, "every", None), getattr(options, "keep_rate", None)
    if every is not None:
        checks.whole(every, 1, "--every")
    if kept is not None:
        checks.positive(kept, "--keep-rate")
    if every is not None and (kept is not None or rate is not None):
        raise InputError(f"--every and {'--rate' if kept is None else '--keep-rate'} both thin a recording: give one")
    given = format_options(options, formats, "read", [row_of(asked, formats, options.format)])
    found = read_file(asked, Recording, formats, "keyframes", format=options.format, options=given)
    try:
        found = thinned(found, every, kept if kept is not None else rate)
    except InputError as error:
        raise InputError(f"{asked}: {error}") from None
    note(options, asked, found.notes)
    return found


@contextmanager
def progress(options: argparse.Namespace, what: str) -> Iterator[None]:
    """Lines on standard error while something takes longer than two seconds, unless the command is to be quiet."""
    if options.quiet:
        yield
        return
    over, began = threading.Event(), monotonic()

    def tell() -> None:
        wait = LONG
        while not over.wait(wait):
            print(f"symmotion {options.name}: {what}: {monotonic() - began:.0f} s", file=sys.stderr, flush=True)
            wait = min(2 * wait, 30.0)

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield
    finally:
        over.set()
        teller.join()


@contextmanager
def piped(options: argparse.Namespace) -> Iterator[None]:
    """Files in place of standard input and output, where the options name these by `-`.

    What was written for standard output goes there when the block ends without an error.
    """
    many = getattr(options, "files", None)
    reading = PIPE in many if isinstance(many, list) else getattr(options, "file", None) == PIPE
    outputs = getattr(options, "output", None)
    writing = isinstance(outputs, list) and PIPE in outputs
    if not reading and not writing:
        yield
        return
    with TemporaryDirectory(prefix="symmotion-pipe-") as directory:
        target = Path(directory) / f"output.{getattr(options, 'to', None)}"
        try:
            if reading:
                taken = options.piped_input = _taken(Path(directory), getattr(options, "format", None))
                if isinstance(many, list):
                    options.files = [taken if p == PIPE else p for p in many]
                else:
                    options.file = taken
            if writing and isinstance(outputs, list):
                if not getattr(options, "to", None):
                    raise InputError("-: standard output has no ending: name its format with --to")
                options.output, options.piped_output = [target if p == PIPE else p for p in outputs], target
            yield
        except (InputError, SolveError) as error:
            shown = str(error)
            for file in (getattr(options, "piped_input", None), target):
                shown = shown.replace(str(file), "-")
            raise type(error)(shown) from error
        if writing:
            with target.open("rb") as made:
                copyfileobj(made, sys.stdout.buffer)
            sys.stdout.buffer.flush()


def _taken(directory: Path, format: str | None) -> Path:
    """Standard input as a file whose ending is its format."""
    if format is None:
        raise InputError("-: standard input has no ending: name its format with --format")
    data = sys.stdin.buffer.read(LARGEST + 1)
    if len(data) > LARGEST:
        raise InputError(f"-: more than {LARGEST >> 20} MB come from standard input: that is the most that is read")
    path = directory / f"input.{format}"
    path.write_bytes(data)
    return path
