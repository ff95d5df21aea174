"""Signatures as the source has them: ArrayLike stays one word."""

import ast
import dataclasses
import inspect
from contextlib import suppress
from copy import deepcopy
from functools import cache
from pathlib import Path

LONGEST = 60  # of a default that is shown


def signature(thing: object) -> str | None:
    """What stands between the parentheses of a call, and what is returned; None where there is no source."""
    tree = definition(thing)
    if isinstance(tree, ast.FunctionDef):
        return _of_function(tree)
    if isinstance(tree, ast.ClassDef) and isinstance(thing, type) and dataclasses.is_dataclass(thing):
        return f"({', '.join(_fields(thing))})"
    if isinstance(tree, ast.ClassDef):
        made = [node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == "__init__"]
        return _of_function(made[0]).partition(" ->")[0] if made else "()"
    return None


def parameters(thing: object) -> tuple[str, ...]:
    """The names that its docstring may tell of: parameters, and of a class its fields and properties too."""
    names: list[str] = []
    with suppress(TypeError, ValueError):
        names += inspect.signature(thing).parameters  # pyright: ignore[reportArgumentType]
    if inspect.isclass(thing):
        names += [name for kind in thing.__mro__ for name in getattr(kind, "__annotations__", {})]
        names += [name for name in dir(thing) if not name.startswith("_")]
        if dataclasses.is_dataclass(thing):
            names += [f.name for f in dataclasses.fields(thing)]
    return tuple(names)


@cache
def _tree(file: str) -> ast.Module:
    return ast.parse(Path(file).read_text(encoding="utf-8"))


def definition(thing: object) -> ast.AST | None:
    """The definition in the source, whatever decorates it."""
    thing = inspect.unwrap(thing)  # pyright: ignore[reportArgumentType]
    try:
        found: ast.AST | None = _tree(inspect.getsourcefile(thing) or "")  # pyright: ignore[reportArgumentType]
    except (OSError, TypeError):
        return None
    for part in getattr(thing, "__qualname__", "").split("."):
        kinds = (ast.FunctionDef, ast.ClassDef)
        members = (n for n in getattr(found, "body", ()) if isinstance(n, kinds) and n.name == part)
        # The last of a name is what it stands for: overloads come before it.
        found = ([None, *members])[-1]
    return found


class _Plain(ast.NodeTransformer):
    """Annotations that are text, for what is not imported yet, as what they say; the texts of a Literal stay."""

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        return node if ast.unparse(node.value).endswith("Literal") else self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        return ast.parse(node.value, mode="eval").body if isinstance(node.value, str) else node


def _annotation(node: ast.AST | None) -> str:
    return ast.unparse(_Plain().visit(deepcopy(node))) if node else ""


def _of_function(node: ast.FunctionDef) -> str:
    arguments = deepcopy(node.args)
    for argument in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs, arguments.vararg, arguments.kwarg):
        if argument and argument.annotation:
            argument.annotation = _Plain().visit(argument.annotation)
    if arguments.args and arguments.args[0].arg in ("self", "cls"):
        arguments.args = arguments.args[1:]
    returned = f" -> {_annotation(node.returns)}" if node.returns else ""
    return f"({ast.unparse(arguments)}){returned}".replace("'", '"')


def _fields(thing: type) -> list[str]:
    annotations = {}
    for kind in reversed(thing.__mro__[:-1]):
        if isinstance(tree := definition(kind), ast.ClassDef):
            nodes = [n for n in tree.body if isinstance(n, ast.AnnAssign) and isinstance(n.target, ast.Name)]
            annotations |= {n.target.id: _annotation(n.annotation) for n in nodes if isinstance(n.target, ast.Name)}
    shown = []
    only = False
    for f in dataclasses.fields(thing):
        if not f.init:
            continue
        if f.kw_only and not only:
            only = True
            shown.append("*")
        default = ""
        if f.default is not dataclasses.MISSING:
            text = repr(f.default)
            default = f" = {text if len(text) < LONGEST and '<' not in text else '…'}"
        elif f.default_factory is not dataclasses.MISSING:
            default = " = …"
        shown.append(f"{f.name}: {annotations.get(f.name, '')}{default}".replace(": =", " ="))
    return shown
