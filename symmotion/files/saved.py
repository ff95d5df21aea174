"""What `save` wrote, where motions and two-parameter motions are read."""

from collections.abc import Mapping
from typing import TypeVar

from symmotion.errors import InputError
from symmotion.files.formats import FilePath
from symmotion.loading import load
from symmotion.saving import MARK

Kind = TypeVar("Kind")


def class_saved(document: Mapping[str, object]) -> str | None:
    """The name of the class that a JSON object was saved from; None where `save` did not write it."""
    name = document.get("class")
    return name if document.get("symmotion") == MARK["symmotion"] and isinstance(name, str) else None


def load_as(path: FilePath, kind: type[Kind] | tuple[type[Kind], ...], what: str) -> Kind:
    """What was saved, of this class or one of these; InputError that says what is needed for another."""
    found = load(path)
    if not isinstance(found, kind):
        raise InputError(f"{path}: holds a {type(found).__name__}: a {what} is needed; `load` reads any")
    return found
