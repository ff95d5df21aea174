"""`symmotion convert`: keyframes or motions from one format to another."""

import argparse
from collections.abc import Sequence

from symmotion import checks
from symmotion.commands.inputs import add_reading, recording_of
from symmotion.commands.outputs import check_outputs, write_outputs
from symmotion.commands.parsing import (
    Commands,
    add_command,
    add_format_options,
    add_input,
    add_outputs,
    at_fault,
    dotted,
    format_options,
)
from symmotion.errors import InputError
from symmotion.files.formats import FilePath, Format, Holds, endings, keywords, rows, rows_of
from symmotion.files.table import FORMATS

EXAMPLE = """\
  symmotion convert walk.bvh --node LeftHand -o hand.tum
  symmotion convert motion.json -o motion.csv motion.glb --rate 100"""
# As what a file is written, by what it holds.
WAYS: dict[Holds, tuple[Holds, ...]] = {
    "keyframes": ("keyframes",),
    "motion": ("motion", "scene", "film"),
    "net": ("net",),
}
SAID: dict[Holds, str] = {
    "keyframes": "holds keyframes, which go into",
    "motion": "holds a motion, which goes into",
    "net": "holds a two-parameter motion, which goes into",
}
REMEDIES: dict[Holds, str] = {"keyframes": "; `symmotion design` makes a motion of them"}
READ = rows(FORMATS, "read", *WAYS)
READ_KEYFRAMES = rows(FORMATS, "read", "keyframes")
WRITTEN = rows(FORMATS, "write", *WAYS, "scene", "film")


def add(commands: Commands) -> None:
    """The command and its options."""
    parser = add_command(
        commands,
        "convert",
        run,
        "keyframes, a motion or a two-parameter motion from one format to another",
        example=EXAMPLE,
        formats=tuple(row for row in FORMATS if row in READ or row in WRITTEN),
    )
    add_input(parser, READ, "keyframes, a motion or a two-parameter motion")
    add_outputs(parser, WRITTEN)
    add_reading(parser, READ)
    add_format_options(parser, WRITTEN, "write")


def run(options: argparse.Namespace) -> None:
    """Read, and write as what was read."""
    source = source_of(options.file, READ, options.format)
    written = rows(WRITTEN, "write", *WAYS[source.holds])
    with at_fault(options.file):
        _require_way(options, source, written)
    rate = None
    if source.holds == "keyframes":
        # Of keyframes the rate says which are kept: they are not sampled.
        rate, options.write_rate = options.write_rate, None
    given = check_outputs(options, written)
    if source.holds == "keyframes":
        value = recording_of(
            options, READ_KEYFRAMES, None if rate is None else checks.positive(rate, "--rate")
        ).keyframes
    else:
        reading = format_options(options, READ, "read", [source])
        for name in ("every", "keep_rate"):
            if getattr(options, name) is not None:
                raise InputError(f"--{name.replace('_', '-')} is of keyframes: leave it out")
        assert source.read is not None
        value = source.read(options.file, **keywords(options.file, source, "read", reading, READ))
    write_outputs(value, options, written, given)


def source_of(path: FilePath, formats: Sequence[Format] = READ, format: str | None = None) -> Format:
    """The format of a file: of those that share its ending the one that claims it; InputError where none does."""
    found = rows_of(path, formats, format)
    claiming = [row for row in found if len(found) == 1 or (row.claims is not None and row.claims(path))]
    claiming = claiming or [row for row in found if row.claims is None]
    if not claiming:
        raise InputError(f"{path}: holds none of {', '.join(dict.fromkeys(row.holds for row in found))}")
    return claiming[0]


def _require_way(options: argparse.Namespace, source: Format, written: Sequence[Format]) -> None:
    """Raise InputError for a file of another kind than what is read can be written as."""
    for path in options.output:
        ending = path.suffix.lower().removeprefix(".")
        if ending in endings(WRITTEN) and ending not in endings(written):
            raise InputError(f"{SAID[source.holds]} {dotted(endings(written))}{REMEDIES.get(source.holds, '')}")
