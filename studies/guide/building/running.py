"""The code of a page, run in the order it is read, and what it shows.

A fence ```python runs, all of a page in one namespace; what it prints is shown below it, and so is the value of its
last expression: pictures as pictures, players as players. Behind the language may stand what is said of it:

- `: A caption.` of the picture or the player that it shows,
- `raises`: it ends by an error, whose message is shown,
- `file NAME`: no code but the content of a file, which is written for the code below,
- `elsewhere`: not run here, for it wants a cluster, a fresh machine or another program.

A fence ```sh runs the commands `symmotion …` and `python -m studies …` in this process.
"""

import ast
import contextlib
import io
import os
import re
import shlex
import tempfile
import traceback
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from studies.__main__ import main as run_studies
from symmotion.commands import main as run_command
from symmotion.report import Figure, Player, to_figure

FENCE = re.compile(r"^```(\w+)([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
RUN = ("python", "sh")


@dataclass(frozen=True)
class Block:
    """A fence of a page: its language, what is said of it, its code, the line it begins in, and where it is."""

    language: str
    said: str
    code: str
    line: int
    place: tuple[int, int]

    @property
    def caption(self) -> str:
        return self.said.partition(":")[2].strip()

    @property
    def file(self) -> str:
        words = self.said.split(":")[0].split()
        return words[1] if words[:1] == ["file"] else ""

    def is_said(self, word: str) -> bool:
        return word in self.said.split(":")[0].split()


@dataclass
class Shown:
    """What a block shows: text, pictures, players."""

    text: str = ""
    pictures: list[Figure] = field(default_factory=list)
    players: list[Player] = field(default_factory=list)


class PageError(Exception):
    """A block of a page that failed."""


def blocks(text: str) -> list[Block]:
    """The fences of a page, of directives none."""
    found = FENCE.finditer(text)
    return [Block(m[1], m[2].strip(), m[3], text.count("\n", 0, m.start()) + 1, m.span()) for m in found]


def run_page(text: str, name: str) -> Iterator[tuple[Block, Shown]]:
    """Run a page's blocks in a folder of its own, one after the other; PageError names the one that failed."""
    namespace: dict[str, Any] = {"__name__": "__main__"}
    # A random draw that a page does not seed would change it from build to build.
    np.random.seed(0)
    with tempfile.TemporaryDirectory() as folder, _inside(folder), warnings.catch_warnings():
        warnings.simplefilter("error")
        # Rich and others ask for things that Python has deprecated.
        warnings.simplefilter("ignore", DeprecationWarning)
        warnings.simplefilter("ignore", PendingDeprecationWarning)
        for number, block in enumerate(blocks(text)):
            if block.file:
                Path(block.file).write_text(block.code, encoding="utf-8")
                yield block, Shown()
            elif block.language not in RUN or block.is_said("elsewhere"):
                yield block, Shown()
            else:
                label = f"{name.replace('/', '-')}-{number}"
                yield block, _run(block, namespace, f"{name}, line {block.line}", label)


@contextlib.contextmanager
def _inside(folder: str) -> Iterator[None]:
    """In another folder, with figures drawn without a display."""
    before, columns, backend = Path.cwd(), os.environ.get("COLUMNS"), matplotlib.get_backend()
    os.chdir(folder)
    os.environ["COLUMNS"] = "88"
    matplotlib.use("agg")
    try:
        yield
    finally:
        matplotlib.use(backend)
        os.chdir(before)
        os.environ.pop("COLUMNS")
        if columns is not None:
            os.environ["COLUMNS"] = columns


def _run(block: Block, namespace: dict[str, Any], where: str, label: str) -> Shown:
    out = io.StringIO()
    value: object = None
    error: BaseException | None = None
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out if block.language == "sh" else io.StringIO()):
        try:
            value = _python(block.code, namespace, where) if block.language == "python" else _commands(block.code)
        except (Exception, SystemExit) as raised:
            error = raised
    if block.is_said("raises") != (error is not None):
        told = traceback.format_exception(error) if error else ["it raises nothing\n"]
        raise PageError(f"{where}:\n{block.code}\n{''.join(told)}{out.getvalue()}")
    shown = Shown(out.getvalue())
    if error is not None:
        shown.text += f"{type(error).__name__}: {error}\n"
    _show(value, shown, block.caption, label)
    return shown


def _python(code: str, namespace: dict[str, Any], where: str) -> object:
    """Run code, and return the value of its last line where that is an expression."""
    tree = ast.parse(code, where)
    last = tree.body[-1] if tree.body else None
    if not isinstance(last, ast.Expr):
        exec(compile(tree, where, "exec"), namespace)
        return None
    tree.body.pop()
    exec(compile(tree, where, "exec"), namespace)
    return eval(compile(ast.Expression(last.value), where, "eval"), namespace)


def _commands(code: str) -> None:
    for line in code.replace("\\\n", " ").splitlines():
        words = shlex.split(line, comments=True)
        match words:
            case []:
                continue
            case ["symmotion", *rest]:
                status = run_command(rest)
            case ["python", "-m", "studies", *rest]:
                status = run_studies(rest)
            case _:
                raise ValueError(f"{line}: is no command of symmotion; say 'elsewhere'")
        if status:
            raise RuntimeError(f"{line}: ended with status {status}")


def _show(value: object, shown: Shown, caption: str, label: str) -> None:
    """Add what a value looks like; open figures of pyplot are shown and closed."""
    import matplotlib.pyplot as plt

    canvases = [plt.figure(number) for number in plt.get_fignums()]
    match value:
        case Player():
            shown.players.append(value)
        case Figure():
            shown.pictures.append(value)
        case Canvas() | Axes():
            drawn = value if isinstance(value, Canvas) else value.figure
            if isinstance(drawn, Canvas) and drawn not in canvases:
                canvases.append(drawn)
        case None:
            pass
        case _ if not canvases:
            shown.text += f"{value!r}\n"
    for index, canvas in enumerate(canvases):
        shown.pictures.append(to_figure(canvas, f"{label}-{index}" if index else label, caption))
    plt.close("all")
