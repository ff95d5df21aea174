"""The files that commands write."""

import argparse
from collections.abc import Mapping, Sequence

from symmotion.commands.parsing import format_options, say
from symmotion.errors import InputError
from symmotion.files.formats import Format, row_of
from symmotion.whole import require_place


def check_outputs(options: argparse.Namespace, formats: Sequence[Format]) -> dict[str, object]:
    """Raise InputError for files that cannot be written, here and not after the work; returns the formats' options.

    options: with `output`, the files, and `file`, the one that is read, which stays. formats: those to choose from.
    """
    chosen = [row_of(path, formats) for path in options.output]
    given = format_options(options, formats, "write", chosen)
    for path, row in zip(options.output, chosen, strict=True):
        require_place(path)
        if path.exists() and options.file.exists() and path.samefile(options.file):
            raise InputError(f"{path}: is the file that is read, which would be lost: name another one")
        if row.check is not None:
            row.check(path, **_taken(row, given))
    return given


# What is written, and what of the options, the row knows.
def write_outputs(
    value: object, options: argparse.Namespace, formats: Sequence[Format], given: Mapping[str, object]
) -> None:
    """Write a value into all files, each with those of the options that its format takes, and say so."""
    for path in options.output:
        row = row_of(path, formats)
        assert row.write is not None
        said = row.write(value, path, **_taken(row, given))
        if path != getattr(options, "piped_output", None):
            say(options, f"wrote {path if said is None else said}")


def _taken(row: Format, given: Mapping[str, object]) -> dict[str, object]:
    return {option.name: given[option.name] for option in row.writing if given.get(option.name) is not None}
