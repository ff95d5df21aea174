"""python -m studies: run the studies into one report."""

import argparse
import pkgutil
import sys
from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import NoReturn

from rich.console import Console
from rich.markup import escape
from rich.table import Table

import studies
import symmotion as sm
from studies.runner.running import run_all
from symmotion.kernels import available_processors
from symmotion.report import Study, StudyOptions, StudyRecord, require_writable, write_report

PROGRAM = "python -m studies"
MOST_JOBS = 4  # by default: a process takes some 300 MB
EXAMPLE = """\
examples:
  python -m studies                                     all of them, in minutes, into report/
  python -m studies solvers --full -o paper             one in its long form, into paper/
  python -m studies --full --scheduler tcp://host:8786  on a Dask cluster

For a cluster, `pip install ".[distributed]"` in the same checkout on every machine. Run `dask scheduler` on one, and in
the checkout on each `python -m distributed.cli.dask_worker tcp://host:8786 --nworkers 4 --nthreads 1`: started with
python -m from there the workers find the studies, and figures are drawn by one thread at a time.
"""


class Parser(argparse.ArgumentParser):
    """Errors in one line, without the usage."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message}\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run studies as the arguments say; 0, or 1 where a study failed, or 2 for bad input."""
    options = _parser().parse_args(arguments)
    try:
        chosen = choose(discover(), options.names)
        if options.list:
            width = max((len(s.name) for s in chosen), default=0)
            for s in chosen:
                print(f"{s.name:{width}}  {s.question}")
            return 0
        if options.scheduler is not None and options.jobs is not None:
            raise sm.InputError("--jobs and --scheduler: give one of the two")
        jobs = min(MOST_JOBS, available_processors()) if options.jobs is None else options.jobs
        if jobs < 1:
            raise sm.InputError(f"--jobs {jobs}: 1 or more is needed")
        if options.data is not None and not options.data.is_file():
            raise sm.InputError(f"--data {options.data}: there is no such file")
        require_writable(options.output)
        records = run_all(chosen, StudyOptions(options.full, options.data), jobs, options.scheduler)
        form = "long" if options.full else "quick"
        # Read by subject, whatever the order they ran in.
        records.sort(key=lambda r: studies.SUBJECTS.index(r.subject) if r.subject in studies.SUBJECTS else 99)
        page = write_report(records, options.output, "symmotion: studies", f"The studies in their {form} form.")
    except sm.InputError as error:
        print(f"{PROGRAM}: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"{PROGRAM}: interrupted, no report", file=sys.stderr)
        return 130
    for record in records:
        print(record.traceback, end="", file=sys.stderr)
    _summarise(records)
    print(f"report: {page}")
    return 1 if any(record.status == "failed" for record in records) else 0


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog=PROGRAM,
        description="Run studies and write one report, index.html and report.json.",
        epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help="studies to run; all when left out")
    parser.add_argument("--full", action="store_true", help="the long form, with the figures a paper would print")
    parser.add_argument("--list", action="store_true", help="list the studies and their questions, and run none")
    parser.add_argument("-o", "--output", type=Path, default=Path("report"), metavar="DIR", help="default: report")
    jobs = "studies run at the same time (default: one a processor, 4 at most); those that time things run alone"
    parser.add_argument("--jobs", type=int, metavar="N", help=jobs)
    where = "run the studies on the workers of this Dask scheduler, such as tcp://10.0.0.1:8786"
    parser.add_argument("--scheduler", metavar="ADDRESS", help=where)
    parser.add_argument("--data", type=Path, metavar="FILE", help="recorded keyframes for the studies that use them")
    return parser


def discover() -> list[Study]:
    """The STUDY of every module under this folder that has one, its folder as subject, in the order they run."""
    # A package's __main__ is a program, which runs where it is imported; what builds the guide needs Sphinx.
    modules = pkgutil.walk_packages(studies.__path__, "studies.")
    names = [m.name for m in modules if not m.name.endswith(".__main__") and ".building." not in m.name]
    found = [(name.split(".")[1], getattr(import_module(name), "STUDY", None)) for name in names]
    named = (replace(s, subject=subject) for subject, s in found if isinstance(s, Study))
    return sorted(named, key=lambda s: (s.order, s.name))


def choose(found: Sequence[Study], names: Sequence[str]) -> list[Study]:
    """The studies of these names, all for none; InputError says which exist."""
    known = [s.name for s in found]
    for name in names:
        if name not in known:
            raise sm.InputError(f"no study {name!r}; there are {', '.join(known) or 'none'}")
    return [s for s in found if not names or s.name in names]


def _summarise(records: Sequence[StudyRecord]) -> None:
    table = Table("study", "status")
    table.add_column("certified", justify="right")
    table.add_column("seconds", justify="right")
    for r in records:
        runs = f"{r.result.certified} of {len(r.result.runs)}" if r.result and r.result.runs else "–"
        table.add_row(r.name, escape(f"{r.status} {r.error}".strip()), runs, f"{r.seconds:.1f}")
    Console().print(table)


if __name__ == "__main__":
    sys.exit(main())
