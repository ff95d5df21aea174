"""The reference: a page for each group of the package, from docstrings."""

import ast
import inspect
import re
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from types import ModuleType
from typing import Any

import symmotion as sm

# By the order in which a reader meets them; the top level is a list of links.
GROUPS = {
    "Questions": ("design", "constraints", "energies", "jets"),
    "Motions": ("motions", "quaternions", "interpolants", "curves", "splines"),
    "Solving": ("solvers", "systems", "program", "kernels", "batches"),
    "Answers": ("answers", "smoothing", "fairing", "sweeps"),
    "In and out": ("files", "bodies", "views", "report"),
}
LONGEST = 60  # of a value that is shown
PACKAGES = {"quaternions": "motions.quaternions", "interpolants": "motions.interpolants"}


@dataclass(frozen=True)
class Entry:
    """A public name: where it is documented, and what it is."""

    group: str
    name: str
    thing: object

    @property
    def kind(self) -> str:
        if inspect.isclass(self.thing) and self.thing is not Any:
            return "class"
        return "function" if inspect.isroutine(self.thing) else "data"

    @property
    def path(self) -> str:
        return f"symmotion.{self.group}.{self.name}" if self.group else f"symmotion.{self.name}"

    @property
    def sentence(self) -> str:
        """The first sentence of the docstring; of data the value, where it is short, and what the source says of it."""
        text = inspect.getdoc(self.thing) or "" if self.kind != "data" else _beside(self.group, self.name)
        return " ".join(text.split("\n\n")[0].split())


def _beside(group: str, name: str) -> str:
    """The value of an assignment as it is written, where that is short, and the comment above it or behind it."""
    module = package(group)
    imports = (n for n in ast.parse(inspect.getsource(module)).body if isinstance(n, ast.ImportFrom))
    home = [n.module for n in imports if n.module and name in {a.asname or a.name for a in n.names}]
    source = inspect.getsource(import_module(home[0]) if home else module)
    rows = source.splitlines()
    for node in ast.parse(source).body:
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        if any(isinstance(target, ast.Name) and target.id == name for target in targets):
            first = node.lineno - 1
            while first and rows[first - 1].startswith("# "):
                first -= 1
            value = ast.unparse(node.value)
            comments = [row.removeprefix("# ") for row in rows[first : node.lineno - 1]]
            comments.append(rows[(node.end_lineno or node.lineno) - 1].partition("  # ")[2])
            said = re.sub(r"\s*fmt: skip", "", " ".join(comments))
            return ": ".join(filter(None, [f"`{value}`" if len(value) < LONGEST else "", said]))
    return ""


def package(group: str) -> ModuleType:
    return import_module(".".join(("symmotion", *filter(None, [PACKAGES.get(group, group)]))))


@cache
def entries() -> tuple[Entry, ...]:
    """Every public name once: in its group, or at the top where it is in none."""
    found: list[Entry] = []
    seen: set[int] = set()
    for group in [g for members in GROUPS.values() for g in members] + [""]:
        module = package(group)
        for name in module.__all__:
            thing = getattr(module, name)
            # Numbers and texts are shared by Python: each name is one of its own.
            plain = thing is Any or not (inspect.isclass(thing) or inspect.isroutine(thing))
            if inspect.ismodule(thing) or (not plain and id(thing) in seen):
                continue
            seen.add(id(thing))
            found.append(Entry(group, name, thing))
    return tuple(found)


@cache
def known() -> dict[str, str]:
    """By what `sm.…` names, the path of its entry: of names and of the members of classes; "" of what has none."""
    paths = {id(e.thing): e for e in entries()}
    found: dict[str, str] = {}
    for group in ["", *(g for members in GROUPS.values() for g in members)]:
        module = package(group)
        if group:
            found[group] = f"symmotion.{group}"
        for name in module.__all__:
            thing = getattr(module, name)
            if inspect.ismodule(thing):
                continue
            path = f"{group}.{name}".lstrip(".")
            entry = paths.get(id(thing))
            target = entry.path if entry and entry.kind != "data" else ""
            found[path] = target
            if inspect.isclass(thing):
                members = [m for m in dir(thing) if not m.startswith("_") and inspect.getdoc(getattr(thing, m))]
                found |= {f"{path}.{m}": f"{target}.{m}" for m in members if target}
    return found


def pages() -> dict[str, str]:
    """The generated pages by name, in reStructuredText."""
    made = {"reference/index": _index(), "reference/top": _top()}
    return made | {f"reference/{group}": _group(group) for members in GROUPS.values() for group in members}


def _title(text: str) -> list[str]:
    return [text, "=" * len(text), ""]


def _index() -> str:
    lines = _title("Reference")
    lines += [
        "Every public name, from its docstring. A program takes ``import symmotion as sm``: what most need is at the "
        "top level, as ``sm.fair``, the rest in groups, as ``sm.curves.bezier``. The examples run as they stand, with "
        "``import numpy as np`` and ``import symmotion as sm`` before them.",
        "",
    ]
    rows = [[f"   * - :doc:`{_heading('')} <top>`", "     - What most programs need."]]
    lines += [*_table(rows), ".. toctree::", "   :hidden:", "", "   top", ""]
    for heading, members in GROUPS.items():
        rows = [[f"   * - :doc:`{_heading(g)} <{g}>`", f"     - {inline_text(_sentence(g))}"] for g in members]
        lines += [heading, "-" * len(heading), "", *_table(rows)]
        lines += [".. toctree::", "   :hidden:", f"   :caption: {heading}", "", *(f"   {g}" for g in members), ""]
    return "\n".join(lines)


def _heading(group: str) -> str:
    if not group:
        return "The top level"
    return f"sm.{group}" if group in package("").__all__ else f"symmotion.{group}"


def _sentence(group: str) -> str:
    return " ".join((inspect.getdoc(package(group)) or "").split("\n\n")[0].split())


def _row(label: str, path: str, sentence: str, data: bool) -> list[str]:
    name = f"``{label}``" if data else f":py:obj:`{label} <{path}>`"
    return [f"   * - {name}", f"     - {inline_text(sentence)}"]


def _table(rows: list[list[str]]) -> list[str]:
    return [".. list-table::", "   :widths: 28 72", "   :class: names", "", *(line for row in rows for line in row), ""]


def _top() -> str:
    targets = known()
    rows, own = [], []
    homes = {e.path: e for e in entries()}
    for name in package("").__all__:
        if inspect.ismodule(thing := getattr(sm, name)):
            continue
        entry = homes[targets[name]]
        rows.append(_row(f"sm.{name}", entry.path, entry.sentence, entry.kind == "data"))
        if not entry.group:
            own.append(Entry("", name, thing))
    lines = [*_title(_heading("")), "``import symmotion as sm``", "", *_table(rows)]
    return "\n".join(lines + [line for entry in own for line in _described(entry)])


def _group(group: str) -> str:
    module = package(group)
    members = [e for e in entries() if e.group == group]
    # The module's anchor lands on what follows, which is a paragraph: on a table it would come twice.
    lines = [*_title(_heading(group)), f".. py:module:: symmotion.{group}", ""]
    lines += [*converted(inspect.getdoc(module) or "", ()), ""]
    lines += _table([_row(e.name, e.path, e.sentence, e.kind == "data") for e in members])
    return "\n".join(lines + [line for entry in members if entry.kind != "data" for line in _described(entry)])


def _described(entry: Entry) -> list[str]:
    if entry.kind == "data":
        return []
    directive = "autoclass" if entry.kind == "class" else "autofunction"
    lines = [f".. {directive}:: {entry.path}", *(["   :members:"] if directive == "autoclass" else []), ""]
    return lines


def inline_text(text: str) -> str:
    """A line of a docstring in reStructuredText: what stands between backticks is code, all else is plain."""
    parts = re.split(r"(`[^`]+`)", text)
    return "".join(
        f"``{part[1:-1]}``" if part.startswith("`") and part.endswith("`") and len(part) > 2 else _plain(part)
        for part in parts
    ).replace("``\\ ``", "`` ``")


def _plain(text: str) -> str:
    return re.sub(r"([\\*|_`])", r"\\\1", text)


def converted(text: str, parameters: tuple[str, ...]) -> list[str]:
    """A docstring in reStructuredText: paragraphs, what parameters are as a list, lists, examples as they stand."""
    lines: list[str] = []
    for part in re.split(r"\n[ \t]*\n", text.strip("\n")):
        rows = part.split("\n")
        if rows[0].lstrip().startswith(">>>"):
            lines += ["", *rows, ""]
        elif all(row.startswith("    ") for row in rows):
            lines += ["", "::", "", *rows, ""]
        else:
            lines += ["", *_items(rows, parameters), ""]
    return lines


NAMED = re.compile(r"((?:\w+(?:, )?)+(?: \([^)]*\))?): ")
# Where another parameter may begin, or what is raised.
STARTS = re.compile(r"(?<=[;.]) (?=(?:\w+, )*\w+(?: \([^)]*\))?: |Raises |Source: )")


def _items(rows: list[str], parameters: tuple[str, ...]) -> list[str]:
    """A paragraph as items: of a list, or of parameters, each of which begins a line, or a sentence, by its name."""
    items: list[tuple[str, list[str]]] = []
    for row in rows:
        if _is_parameter(row, parameters):
            items.append(("parameter", [row]))
        elif row.startswith("- "):
            items.append(("list", [row[2:]]))
        elif items and (items[-1][0] != "list" or row.startswith(" ")):
            items[-1][1].append(row.strip())
        else:
            items.append(("text", [row.strip()]))
    lines: list[str] = []
    for kind, texts in items:
        joined = " ".join(texts)
        for part in _parameters(joined, parameters) if kind == "parameter" else [joined]:
            if named := kind == "parameter" and _is_parameter(part, parameters):
                lines.append(f"- **{_plain(named[1])}**: {inline_text(part[named.end() :].rstrip(';'))}")
            elif kind == "list":
                lines.append(f"- {inline_text(part)}")
            else:
                lines += ["", inline_text(part), ""]
    return lines


def _is_parameter(text: str, parameters: tuple[str, ...]) -> re.Match[str] | None:
    found = NAMED.match(text)
    words = re.findall(r"\w+", found[1].split("(")[0]) if found else []
    return found if words and words[0] in parameters else None


def _parameters(text: str, parameters: tuple[str, ...]) -> list[str]:
    """The parameters that a paragraph tells of, one after the other, and what it says after them."""
    parts: list[str] = []
    for part in STARTS.split(text):
        if parts and not (_is_parameter(part, parameters) or part.startswith(("Raises ", "Source: "))):
            parts[-1] += f" {part}"
        else:
            parts.append(part)
    return parts
