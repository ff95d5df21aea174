"""python -m studies.guide: build the guide."""

import argparse
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

PROGRAM = "python -m studies.guide"


def main(arguments: Sequence[str] | None = None) -> int:
    """Build the guide as the arguments say; 0, or 1 where a page fails, or 2 where something is missing."""
    parser = argparse.ArgumentParser(prog=PROGRAM, description="Build the guide: run its pages, draw its pictures.")
    parser.add_argument("-o", "--output", type=Path, default=Path("site"), metavar="DIR", help="default: site")
    parser.add_argument("--quiet", action="store_true", help="show no progress")
    options = parser.parse_args(arguments)
    if missing := [name for name in ("sphinx", "myst_parser", "furo") if find_spec(name) is None]:
        print(f'{PROGRAM}: {", ".join(missing)} missing; python -m pip install ".[docs]"', file=sys.stderr)
        return 2
    from sphinx.errors import SphinxError

    from studies.guide.building.running import PageError
    from studies.guide.building.site import build

    def progress(what: str) -> None:
        if not options.quiet:
            print(f"guide: {what}", file=sys.stderr, flush=True)

    try:
        status = build(options.output.resolve(), progress)
    except KeyboardInterrupt:
        print(f"{PROGRAM}: interrupted", file=sys.stderr)
        return 130
    except (PageError, LookupError, SphinxError, OSError) as error:
        print(f"{PROGRAM}: {error}", file=sys.stderr)
        return 1
    if status == 0:
        print(f"guide: {options.output / 'index.html'}")
    return 1 if status else 0


if __name__ == "__main__":
    sys.exit(main())
