"""The gallery: pictures and players of studies, as they are made by the build."""

import re
from collections.abc import Callable, Sequence
from dataclasses import replace

from studies.__main__ import discover
from studies.guide.building import pages as woven
from symmotion.report import Player, Study, StudyOptions, StudyResult

# Those that show something that moves or is seen, in their quick form, a few seconds each. By subject.
SHOWN = {
    "affine": ("planar_keyframes", "spatial_keyframes", "morphing", "keyframe_prices"),
    "quaternions": ("boomerang", "quaternion_curves", "keyframe_body"),
    "curves": ("curve_constraints",),
    "recorded": ("recorded_poses",),
    "sweeps": ("sweep", "sweep_surfaces"),
    "fairing": ("fairing_spherical", "tool_path"),
}
TITLES = {
    "affine": "Affine motions",
    "quaternions": "Orientations",
    "curves": "Motion curves",
    "recorded": "Recordings",
    "sweeps": "Sweeps",
    "fairing": "Fairing",
}
CODE = re.compile(r"`[^`]+`")
INTRODUCTION = """# Gallery

What studies found, each one question with its answer, drawn while this guide was built. Press play; where a body moves
in space, drag to turn the view. All studies, with tables, runs and their certificates, are in the report that
`python -m studies` writes. Nets before and after fairing are in the tutorial on [tool paths](../tutorials/toolpath.md).

"""


def pages(progress: Callable[[str], None]) -> dict[str, str]:
    """The pages of the gallery by name, in Markdown."""
    found = {study.name: study for study in discover()}
    links = "".join(
        f"- [{TITLES[subject]}]({subject}.md)\n"
        + "".join(f"  - [{_plain(found[name].question)}](#study-{name})\n" for name in names)
        for subject, names in SHOWN.items()
    )
    tree = "\n```{toctree}\n:hidden:\n\n" + "\n".join(SHOWN) + "\n```\n"
    made = {"gallery/index": INTRODUCTION + links + tree}
    for subject, names in SHOWN.items():
        results = []
        for name in names:
            progress(f"gallery/{name}")
            result = found[name].run(StudyOptions())
            # Players of a page have names of their own.
            players = tuple(replace(player, name=f"{name}-{player.name}") for player in result.players)
            results.append((found[name], replace(result, players=players)))
        made[f"gallery/{subject}"] = _page(TITLES[subject], results)
    return made


def _page(title: str, results: Sequence[tuple[Study, StudyResult]]) -> str:
    players: list[Player] = [player for _, result in results for player in result.players]
    elements, rest = woven.stage(players) if players else ([], "")
    drawn = iter(elements)
    parts = [f"# {title}\n"]
    for study, result in results:
        parts.append(f"\n(study-{study.name})=\n## {_plain(study.question)}\n\n{_plain(result.answer)}\n")
        parts += [next(drawn) for _ in result.players]
        if not result.players:
            parts += [woven.picture(figure) for figure in result.figures[:1]]
        parts.append(f"\n{_plain(result.conclusion)}\n" if result.conclusion != result.answer else "")
        source = f". Source: {_plain(study.source)}." if study.source else ""
        parts.append(f"\n`python -m studies {study.name}`{source}\n")
    return "".join(parts) + rest


def _plain(text: str) -> str:
    """Text in which Markdown finds nothing but code between backticks."""
    parts = re.split(f"({CODE.pattern})", text)
    return "".join(part if CODE.fullmatch(part) else re.sub(r"([\\`*_\[\]<>$|#{}])", r"\\\1", part) for part in parts)
