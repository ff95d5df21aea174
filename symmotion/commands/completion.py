"""What shells complete: commands, options, choices and files, by shtab."""

import argparse
from collections.abc import Iterator, Sequence
from importlib import import_module
from pathlib import Path

SHELLS = ("bash", "zsh", "tcsh")


class Completion(argparse.Action):
    """Print the script of a shell, and end."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: object,
        option_string: str | None = None,
    ) -> None:
        try:
            shtab = import_module("shtab")
        except ImportError:
            parser.error(f'{option_string} takes shtab: python -m pip install "symmotion[completion]"')
        for action in _actions(parser):
            if action.type is Path:
                vars(action)["complete"] = shtab.DIRECTORY if action.metavar == "DIR" else shtab.FILE
        print(shtab.complete(parser, shell=str(values)))
        parser.exit()


def add_completion(parser: argparse.ArgumentParser) -> None:
    """`--completion SHELL`."""
    shown = "print what the shell completes by and end, for eval in its start-up file or its directory of completions"
    parser.add_argument("--completion", action=Completion, choices=SHELLS, help=shown)


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """Those of a parser and of its commands."""
    groups: Sequence[argparse.Action] = parser._actions  # argparse has no public way to them
    for action in groups:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield from _actions(command)
