"""The gallery: pictures and players of studies, as they are made by the build."""

from collections.abc import Callable


def pages(progress: Callable[[str], None]) -> dict[str, str]:
    return {}
