"""`Any` stands in a signature only where it is the truth, with its reason beside it."""

import ast
import io
import tokenize
from pathlib import Path

import pytest

import symmotion

ROOT = Path(str(symmotion.__file__)).parent


def remarks(source: str) -> dict[int, str]:
    """The comments of a file by line."""
    tokens = tokenize.generate_tokens(io.StringIO(source).readline)
    return {token.start[0]: token.string for token in tokens if token.type == tokenize.COMMENT}


def named(part: ast.AST | None) -> list[int]:
    """The lines where a type says `Any`, in quotes too."""
    found = []
    for node in ast.walk(part) if part is not None else ():
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            found += [node.lineno] * ("Any" in node.value.replace("[", " ").replace("]", " ").replace(",", " ").split())
        elif isinstance(node, ast.Name) and node.id == "Any":
            found.append(node.lineno)
    return found


def types_in(tree: ast.Module) -> list[tuple[int, int]]:
    """Every line where a type says `Any`, with the first line of what it is the type of."""
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            a = node.args
            first = min([node.lineno, *(d.lineno for d in node.decorator_list)])
            each = [*a.posonlyargs, *a.args, *a.kwonlyargs, *(x for x in (a.vararg, a.kwarg) if x is not None)]
            types = [node.returns, *(x.annotation for x in each)]
        elif isinstance(node, ast.AnnAssign):
            # An alias is one of its value.
            first, types = (
                node.lineno,
                [node.annotation, node.value if "Alias" in ast.unparse(node.annotation) else None],
            )
        elif isinstance(node, ast.Assign):
            first, types = node.lineno, [node.value] if isinstance(node.value, ast.Name | ast.Subscript) else []
        elif isinstance(node, ast.ClassDef):
            first, types = node.lineno, node.bases
        else:
            continue
        found += [(line, first) for part in types for line in named(part)]
    return found


def unexplained(source: str) -> list[int]:
    """The lines that say `Any` without a comment on them, or one that begins with it above what they are part of."""
    said = remarks(source)

    def reason(line: int, first: int) -> bool:
        above = first - 1
        while above in said and "Any:" not in said[above]:
            above -= 1
        beside = said.get(line, "# noqa")
        return not beside.startswith(("# noqa", "# pyright:")) or above in said

    return sorted({line for line, first in types_in(ast.parse(source)) if not reason(line, first)})


@pytest.mark.parametrize(
    ("source", "wrong"),
    [
        ("def f(a: Any): ...", [1]),
        ("def f(\n    a: int,\n    *b: Any,  # Any: of the caller\n): ...", []),
        ("# Any: JSON.\n@cached\ndef f() -> dict[str, Any]: ...", []),
        ("# What it is. Any: as it comes,\n# from CasADi.\nStats: TypeAlias = dict[str, Any]", []),
        ("# Something else.\nStats: TypeAlias = dict[str, Any]", [2]),
        ('# Any: one.\nx: int\ny: "Program[Any]"', [3]),
        ("def f(\n    a: Any,  # pyright: ignore\n): ...", [2]),
        ("class A(dict[str, Any]): ...\nT = Any\nz = cast(Any, 1)", [1, 2]),
    ],
)
def test_what_counts_as_a_reason(source, wrong):
    assert unexplained(source) == wrong


def test_every_any_has_its_reason():
    texts = {path.relative_to(ROOT): path.read_text(encoding="utf-8") for path in sorted(ROOT.rglob("*.py"))}
    assert [f"{path}:{line}" for path, text in texts.items() if "Any" in text for line in unexplained(text)] == []
