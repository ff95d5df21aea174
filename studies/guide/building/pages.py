"""Pages as Sphinx reads them: the sources, with what their code shows, links of names, and generated pages."""

import html
import re
from collections.abc import Mapping
from pathlib import Path

from studies.guide.building.running import FENCE, Shown, run_page
from symmotion.report import Figure, Player, inline, player_elements

SOURCES = Path(__file__).parents[1] / "pages"
WIDE = 90  # characters that a page has room for
NAME = re.compile(r"`sm\.([A-Za-z_][\w.]*)(\([^`]*\))?`")


def sources() -> list[str]:
    """The names of all pages that are written by hand."""
    return sorted(p.relative_to(SOURCES).with_suffix("").as_posix() for p in SOURCES.rglob("*.md"))


def source(name: str) -> str:
    return (SOURCES / f"{name}.md").read_text(encoding="utf-8")


def woven(name: str, text: str, known: Mapping[str, str]) -> str:
    """A page whose code has been run, with what it shows below each block and names of the reference as links."""
    parts: list[str] = []
    shown: list[Shown] = []
    end = 0
    for block, found in run_page(text, name):
        begin, after = block.place
        parts += [linked(text[end:begin], known), _fence(block.language, block.said, block.code)]
        parts.append(f"\0{len(shown)}\0")
        shown.append(found)
        end = after
    parts.append(linked(text[end:], known))
    players = [player for found in shown for player in found.players]
    figures, rest = player_elements(players) if players else ([], "")
    elements = iter(figures)
    page = "".join(parts)
    for number, found in enumerate(shown):
        page = page.replace(f"\0{number}\0", _below(found, [next(elements) for _ in found.players]), 1)
    return page + (raw(rest) if rest else "")


def _fence(language: str, said: str, code: str) -> str:
    words = said.split(":")[0].split()
    caption = f":caption: {words[1]}\n" if words[:1] == ["file"] else ""
    return f"```{{code-block}} {language}\n{caption}\n{code}```"


def _below(found: Shown, players: list[str]) -> str:
    text = found.text.strip("\n")
    # Where columns are aligned, lines must not be broken; wide ones are set smaller.
    kind = "output" if text.count("   ") < 4 else "output aligned"
    if kind != "output" and max(map(len, text.splitlines())) > WIDE:
        kind += " wide"
    parts = [f"\n\n````{{code-block}} text\n:class: {kind}\n\n{text}\n````\n"] if text.strip() else []
    parts += [picture(figure) for figure in found.pictures]
    parts += [raw(player) for player in players]
    return "".join(parts)


def picture(figure: Figure) -> str:
    """A figure as part of a page."""
    caption = f"<figcaption>{html.escape(figure.caption)}</figcaption>" if figure.caption else ""
    return raw(f"<figure>{inline(figure, 'drawn')}{caption}</figure>")


def raw(text: str) -> str:
    return f"\n\n`````{{raw}} html\n{text}\n`````\n"


def stage(players: list[Player]) -> tuple[list[str], str]:
    figures, rest = player_elements(players)
    return [raw(figure) for figure in figures], raw(rest)


def linked(text: str, known: Mapping[str, str]) -> str:
    """Text whose names of the library, as `sm.fair`, lead to the reference; a name that is not there is an error.

    known: by name the path of its entry; a name without one stays as it is.
    """

    def link(match: re.Match[str]) -> str:
        name = match[1]
        if name not in known:
            raise LookupError(f"`sm.{name}` is not in the reference")
        return f"{{py:obj}}`sm.{name}{match[2] or ''} <{known[name]}>`" if known[name] else match[0]

    # Not inside of the fences of directives.
    parts = re.split(r"(^```.*?^```$)", text, flags=re.MULTILINE | re.DOTALL)
    return "".join(part if part.startswith("```") else NAME.sub(link, part) for part in parts)


__all__ = ["FENCE", "linked", "picture", "raw", "source", "sources", "stage", "woven"]
