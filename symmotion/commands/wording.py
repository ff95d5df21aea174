"""Remedies that messages name as Python has them, in the words of the command line."""

import argparse
import re
import shlex
import sys
from collections.abc import Sequence

from symmotion.commands.parsing import flag_of, named
from symmotion.errors import InputError
from symmotion.files.formats import row_of, rows
from symmotion.files.table import FORMATS

# What a message says to give: frames='found', delimiter=';', norms=0.05, orthonormalise=True, columns={'time': …}.
GIVEN = re.compile(r"\b([a-z_]+)=('[^']*'|\{[^}]*\}|True)|\b(norms)=([0-9.e-]*[0-9])")
# What a message begins with where an option is at fault: rate 1e+09 makes …, w.csv: rate ….
AT_FAULT = re.compile(r"(?:(?<=^)|(?<=: ))[a-z_]+(?= [-+]?[0-9])")
QUOTE = "'"
COLUMNS = re.compile(r"\{(?:'(\w+)': )?…\}")
SOLVERS = {"ExactNewton()": "newton", "Ipopt()": "ipopt"}


def note(options: argparse.Namespace, culprit: object, notes: Sequence[str]) -> None:
    """Lines on standard error with what there is to say of a file that is taken all the same, unless quiet."""
    if not options.quiet:
        for text in notes:
            said = f"{named(options, culprit)}: note: {worded(text, options)}"
            print(f"symmotion {options.name}: {said}", file=sys.stderr)


def worded(text: str, options: argparse.Namespace) -> str:
    """A message with the flags of a command where it names what Python's functions are given."""
    known = {name.removeprefix("read_").removeprefix("write_") for name in vars(options)}

    def flagged(found: re.Match[str]) -> str:
        name, value = found[1] or found[3], found[2] or found[4]
        if name not in known or value == "'twice'":  # `steps` of a solver, whose settings are told
            return found[0]
        if value == "True":
            return flag_of(name)
        if (roles := COLUMNS.fullmatch(value)) is not None:
            return f"{flag_of(name)} {roles[1] or 'ROLE'}=NAME,…"
        return f"{flag_of(name)} {shlex.quote(value.strip(QUOTE))}"

    def blamed(found: re.Match[str]) -> str:
        flag = flag_of(found[0])
        return flag if found[0] in known and not text[: found.start()].endswith(f"{flag}: ") else found[0]

    said = AT_FAULT.sub(blamed, text)
    said = GIVEN.sub(flagged, said).replace("NAME,…, None for none", "NAME,…, without a NAME for none")
    said = re.sub(r"(^|: )columns: ", r"\1--columns: ", said) if "columns" in known else said
    if _repeats(options):
        said = said.replace("keys.merged()", "--repeated merge")
    else:  # nothing on the command line does it
        said = said.replace(", as keys.merged() does", "").replace("keys.merged() leaves", "leave")
    if "solver" in known or "solvers" in known:
        flag = "--solver" if "solver" in known else "--solvers"
        for python, name in SOLVERS.items():
            said = said.replace(python, f"{flag} {name}")
    return said


def _repeats(options: argparse.Namespace) -> bool:
    """Whether the file that is read is of a format of which repeated times can be merged."""
    try:
        row = row_of(options.file, rows(FORMATS, "read", "keyframes"), options.format)
    except (AttributeError, InputError):
        return False
    return any(option.name == "repeated" for option in row.reading)
