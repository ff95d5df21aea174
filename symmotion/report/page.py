"""The report: a page to read, the same as JSON, and the figures as files."""

import base64
import hashlib
import json
import math
import os
import platform
import re
import tempfile
from collections.abc import Sequence
from dataclasses import asdict
from datetime import datetime
from importlib import import_module, resources
from pathlib import Path
from typing import Any, TypeAlias

from jinja2 import Environment, FunctionLoader, StrictUndefined
from jinja2.utils import htmlsafe_json_dumps
from markupsafe import Markup

from symmotion.bodies import Body
from symmotion.errors import InputError
from symmotion.report.trust import tally, trust
from symmotion.report.values import Figure, Player, Run, StudyRecord, require_distinct
from symmotion.svg import as_element
from symmotion.tables import Table, shown
from symmotion.version import __version__
from symmotion.whole import whole_file

Json: TypeAlias = Any  # numbers, texts, lists and objects, nested

SCHEMA = 1


def write_report(
    records: Sequence[StudyRecord], directory: Path | str, title: str = "symmotion", intro: str = ""
) -> Path:
    """Write index.html, report.json and figures/ into a directory, made where it is missing; returns the page's path.

    intro: plain text, blank lines between paragraphs. Raises InputError where it cannot write.

    records: of studies that were run; title: of the page.

    >>> from symmotion.report import StudyRecord, StudyResult
    >>> record = StudyRecord("mine", "Is it so?", "", 0.1, StudyResult(conclusion="It is."))
    >>> sm.report.write_report([record], "report").name
    'index.html'
    """
    directory = Path(directory)
    require_distinct("studies", (record.name for record in records))
    require_writable(directory)
    document = report_document(records)
    files = {directory / path: figure.svg for path, figure in _figures(records).items()}
    files[directory / "report.json"] = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False)
    files[directory / "index.html"] = _page(records, document, title, intro)
    for path, text in files.items():
        with whole_file(path) as file:
            file.write(text)
    return directory / "index.html"


def require_writable(directory: Path) -> None:
    """Raise InputError unless a report can be written into a directory; makes it where it is missing.

    >>> from pathlib import Path
    >>> sm.report.require_writable(Path("report"))
    """
    try:
        for folder in (directory, directory / "figures"):
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                pass
    except OSError as error:
        raise InputError(
            f"{directory}: cannot write a report there ({error.strerror}); choose another directory"
        ) from error


def report_document(records: Sequence[StudyRecord]) -> dict[str, Json]:
    """The content of report.json; numbers in full, None for what is missing or not finite."""
    return _finite(
        {
            "schema": SCHEMA,
            "symmotion": __version__,
            "created": datetime.now().astimezone().isoformat(timespec="seconds"),
            "environment": _environment(),
            "studies": [_study(record) for record in records],
        }
    )


def _study(record: StudyRecord) -> dict[str, Json]:
    result = record.result
    return {
        "name": record.name,
        "subject": record.subject,
        "question": record.question,
        "source": record.source,
        "status": record.status,
        "error": record.error or None,
        "seconds": record.seconds,
        "answer": (result.answer or None) if result else None,
        "conclusion": result.conclusion if result else None,
        "notes": list(result.notes) if result else [],
        "figures": list(_figures([record])),
        "tables": [_table(table) for table in result.tables] if result else [],
        "runs": [_run(run) for run in result.runs] if result else [],
        "players": [_player(player) for player in result.players] if result else [],
    }


def _table(table: Table) -> dict[str, Json]:
    columns = [{"name": c.name, "unit": c.unit, **({"end": True} if c.end else {})} for c in table.columns]
    return {**asdict(table), "columns": columns}


def _run(run: Run) -> dict[str, Json]:
    return {key: value for key, value in asdict(run).items() if key not in ("log", "message")}


def _player(player: Player) -> dict[str, Json]:
    return {"name": player.name, "tracks": [track.label for track in player.tracks], "domain": list(player.domain)}


def _figures(records: Sequence[StudyRecord]) -> dict[str, Figure]:
    """The figures of all studies by their path in the report."""
    return {f"figures/{r.name}-{f.name}.svg": f for r in records if r.result for f in r.result.pictures}


def _finite(value: object) -> Json:
    if isinstance(value, dict):
        return {key: _finite(v) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _environment() -> dict[str, Json]:
    return {
        "python": platform.python_version(),
        **{name: import_module(name).__version__ for name in ("casadi", "numpy", "scipy", "matplotlib")},
        "platform": platform.platform(),
        "processor": _processor(),
        "cpus": os.cpu_count(),
    }


def _processor() -> str | None:
    # platform.processor() is empty or only the architecture on Linux.
    try:
        named = re.search(r"^model name\s*:\s*(.+)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    except OSError:
        named = None
    return named[1] if named else platform.processor() or None


def _page(records: Sequence[StudyRecord], document: dict[str, Json], title: str, intro: str) -> str:
    bodies = list(dict.fromkeys(player.body for r in records if r.result for player in r.result.players))
    script = player_script() if bodies else ""
    subjects = dict.fromkeys(record.subject for record in records)
    return (
        _templates(bodies)
        .get_template("page.html.jinja")
        .render(
            groups=[(name.capitalize(), [r for r in records if r.subject == name]) for name in subjects],
            tally=tally(records),
            document=document,
            title=title,
            intro=intro,
            bodies=_corners(bodies),
            script=Markup(script),
            script_hash=base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(),
        )
    )


def player_elements(players: Sequence[Player]) -> tuple[list[str], str]:
    """Players for a page of one's own: a figure each, and what the page needs once, after the last of them.

    The figures show their still pictures until the second part, a style, the bodies and a script, is there. Colours are
    those of the page, whose style may define --ink, --paper, --line, --wash, --link and the font --data. Nothing is
    fetched. Names differ. Raises InputError where they do not.

    players: of one page.

    >>> import symmotion as sm
    >>> keys = sm.examples.planar_keyframes()
    >>> moving = sm.report.player("spline", {"spline": sm.interpolants.component_cubic(keys)}, None, "A letter.", keys)
    >>> figures, rest = sm.report.player_elements([moving])
    >>> page = "<!doctype html><title>A letter</title>" + figures[0] + rest
    """
    require_distinct("players", (player.name for player in players))
    bodies = list(dict.fromkeys(player.body for player in players))
    templates = _templates(bodies)
    macros = templates.get_template("study.html.jinja").module
    figures = [str(macros.played(player)) for player in players]  # pyright: ignore[reportAttributeAccessIssue]
    style = templates.get_template("player.css.jinja").render()
    rest = (
        f'<style>\n{style}</style>\n<script type="application/json" id="bodies">{_corners(bodies)}</script>\n'
        f"<script>{player_script()}</script>\n"
    )
    return figures, rest


def player_script() -> str:
    """The one script that moves all players of a page."""
    return _resource("scene.js") + _resource("player.js")


def _corners(bodies: Sequence[Body]) -> Markup:
    return _embedded([{"corners": body.vertices.tolist(), "faces": body.faces} for body in bodies])


def _templates(bodies: Sequence[Body]) -> Environment:
    environment = Environment(
        loader=FunctionLoader(_resource),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    environment.filters |= {
        "shown": shown,
        "duration": duration,
        "inline": inline,
        "small": small,
        "paragraphs": paragraphs,
        "trust": trust,
        "moved": lambda player: _embedded(_moved(player, bodies)),
    }
    return environment


def _resource(name: str) -> str:
    return resources.files("symmotion.report").joinpath(name).read_text(encoding="utf-8")


def _moved(player: Player, bodies: Sequence[Body]) -> dict[str, Json]:
    """What player.js reads: the player with the body's place among those of the page, which players share."""
    data = {key: value for key, value in asdict(player).items() if key != "picture"}
    return data | {
        "body": bodies.index(player.body),
        "alt": player.alt or player.caption,
        "dimension": player.dimension,
        "domain": player.domain,
        "start": player.start,
    }


def _embedded(value: object) -> Markup:
    """JSON for a script element: no name in it ends the element."""
    return htmlsafe_json_dumps(_short(value), dumps=json.dumps, separators=(",", ":"), allow_nan=False)


def _short(value: object) -> Json:
    """Whole numbers without their “.0”: 8 % of the data of the studies' players."""
    if isinstance(value, dict):
        return {key: _short(v) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [_short(v) for v in value]
    return int(value) if isinstance(value, float) and value.is_integer() else value


def duration(seconds: float) -> str:
    """Wall-clock time as a reader wants it."""
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{seconds:.1f} s"


def paragraphs(text: str) -> list[str]:
    """Plain text cut at its blank lines."""
    return [part.strip() for part in re.split(r"\n\s*\n", text) if part.strip()]


def inline(figure: Figure, prefix: str) -> Markup:
    """A figure as an element of the page: labelled, its ids kept apart from those of other figures by a prefix.

    >>> figure = sm.report.Figure("dot", "<svg xmlns='http://www.w3.org/2000/svg'/>", "A dot.")
    >>> print(sm.report.inline(figure, "page"))
    <svg id="page-dot" role="img" aria-label="A dot." xmlns='http://www.w3.org/2000/svg'/>
    """
    return as_element(figure.svg, figure.alt or figure.caption, f"{prefix}-{figure.name}")


def small(figure: Figure, prefix: str) -> Markup:
    """The same figure once more, small: drawn by reference, it adds nothing to the page."""
    box = re.match(r'<svg [^>]*viewBox="([-\d. ]+)"', figure.svg)
    if box is None:
        return Markup("")
    width, height = box[1].split()[2:]
    drawn = Markup('<use href="#{}-{}" width="{}" height="{}"/>').format(prefix, figure.name, width, height)
    head = Markup('<svg viewBox="{}" preserveAspectRatio="xMinYMin" aria-hidden="true">').format(box[1])
    return head + drawn + Markup("</svg>")
