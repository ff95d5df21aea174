"""What of a frozen dataclass goes into its pickle."""

from dataclasses import fields
from typing import Any


def made_of(self: Any) -> dict[str, object]:  # Any: a dataclass, for which typing has no name
    """The fields of a dataclass by name: its state in a pickle, without what it derived and keeps beside them.

    The `__getstate__` of a class with cached properties: some of those are large, some hold CasADi
    symbols, and all are made again where they are asked for.
    """
    return {f.name: getattr(self, f.name) for f in fields(self)}
