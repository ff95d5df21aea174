"""The guide: every block of every page runs, every formula has its line, every name is in the reference."""

import inspect
import re
import sys
import tomllib
from functools import cache
from importlib.metadata import packages_distributions

import pytest

import symmotion as sm
from studies.__main__ import discover
from studies.guide.building import reference
from studies.guide.building.formulas import ROOT, lines_of
from studies.guide.building.gallery import SHOWN, TITLES
from studies.guide.building.pages import WIDE, linked, source, sources
from studies.guide.building.running import PageError, blocks, run_page
from studies.guide.building.signatures import signature

PAGES = sources()
FORMULA = re.compile(r"^```\{formula\} (\S+)\n((?::.*\n)+)", re.MULTILINE)
# What a page can only show: it wants a fresh machine, a cluster, or another program.
ELSEWHERE = re.compile(r"pip install|python -m studies( |$)|python -m studies\.guide|dask|distributed|usdview|blender")


@cache
def undocumented() -> tuple[str, ...]:
    """The modules that extras beside `docs` bring."""
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    others = [name for name in extras if name not in ("docs", "test") and f"symmotion[{name}]" not in extras["docs"]]
    absent = {re.split("[>;[]", needed)[0] for name in others for needed in extras[name]}
    return tuple(module for module, owners in packages_distributions().items() if absent & {*owners})


@pytest.mark.parametrize("name", PAGES)
def test_every_block_of_a_page_runs_with_what_the_extra_docs_brings(name, monkeypatch):
    for module in undocumented():
        monkeypatch.setitem(sys.modules, module, None)
    for _block, _shown in run_page(source(name), name):
        pass


@pytest.mark.parametrize("name", PAGES)
def test_what_a_page_names_is_there(name):
    text = source(name)
    linked(text, reference.known())
    for path, options in FORMULA.findall(text):
        said = dict(re.findall(r":(\w+): (.*)", options))
        lines_of(path, said["code"], int(said.get("lines", 1)))
    assert text.count("```{formula}") == len(FORMULA.findall(text))
    for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", text):
        page = (ROOT / "studies/guide/pages" / name).parent / target
        made = page.relative_to(ROOT / "studies/guide/pages").parts[0] in ("gallery", "reference")
        assert made or page.is_file(), target


def test_code_is_no_wider_than_a_page():
    wide = [(n, line) for n in PAGES for b in blocks(source(n)) for line in b.code.splitlines() if len(line) > WIDE]
    assert wide == []


def test_few_blocks_run_elsewhere_and_say_why():
    said = [(name, block) for name in PAGES for block in blocks(source(name)) if block.is_said("elsewhere")]
    for name, block in said:
        assert ELSEWHERE.search(block.code), (name, block.code)
    assert len(said) <= 10


def test_a_page_that_fails_says_where():
    text = "# A page\n\n```python\nx = 1\n```\n\n```python\nx + y\n```\n"
    with pytest.raises(PageError, match=r"page, line 7:\nx \+ y\n(.|\n)*NameError: name 'y' is not defined"):
        list(run_page(text, "page"))
    with pytest.raises(PageError, match="it raises nothing"):
        list(run_page("```python raises\n1\n```\n", "page"))
    with pytest.raises(PageError, match="is no command of symmotion"):
        list(run_page("```sh\nls\n```\n", "page"))
    (_, shown), (_, told) = run_page("```python\n1 + 1\n```\n\n```python raises\nraise ValueError('no')\n```\n", "page")
    assert (shown.text, told.text) == ("2\n", "ValueError: no\n")


def test_a_formula_whose_line_is_gone_fails():
    path = "symmotion/version.py"
    assert lines_of(path, "__version__ = ")[1].startswith("__version__ = ")
    with pytest.raises(LookupError, match="has 'nothing of this' 0 times, once is needed"):
        lines_of(path, "nothing of this")


def test_a_name_that_is_not_in_the_reference_fails():
    with pytest.raises(LookupError, match=r"`sm\.nothing` is not in the reference"):
        linked("see `sm.nothing(1)`", reference.known())
    assert "<symmotion.fairing.fair>" not in linked("```python\n`sm.fair`\n```", reference.known())


@pytest.mark.parametrize("name", PAGES)
def test_formulas_are_mathml(name):
    pytest.importorskip("docutils")
    from studies.guide.building.mathml import mathml

    text = re.sub(r"^```(?!\{formula).*?^```$", "", source(name), flags=re.MULTILINE | re.DOTALL)
    formulas = re.findall(r"^```\{formula\} \S+\n(?::.*\n)+(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"`[^`]*`", "", re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL))
    for formula in [*formulas, *re.findall(r"\$\$?([^$]+)\$\$?", text)]:
        assert mathml(formula, True).startswith("<math"), formula


@pytest.mark.parametrize(
    ("formula", "set_as"),
    [
        # An index of an accented letter beside it, not below.
        (r"\tilde B_i", '<msub><mover accent="true"><mi>B</mi><mo stretchy="false">~</mo></mover><mi>i</mi></msub>'),
        # Both bars of a norm as high as the line, however high what they hold is; those of \left grow.
        (r"\lVert a \rVert", 2 * '<mo stretchy="false" lspace="0" rspace="0">‖</mo>'),
        (r"\left|a\right|", "<mo>|</mo><mo>|</mo>"),
        (
            r"2\log d",
            '<mn>2</mn><mspace width="0.1667em"></mspace><mi>log</mi><mo>\u2061</mo><mspace width="0.1667em">',
        ),
        (r"\log(d)", '<mi>log</mi><mo>\u2061</mo><mo stretchy="false">('),
    ],
)
def test_formulas_are_set_as_tex_sets_them(formula, set_as):
    pytest.importorskip("docutils")
    from studies.guide.building.mathml import mathml

    found = mathml(formula, False).replace(' class="mathopen"', "").replace("<mi>a</mi>", "").replace("\n", "")
    assert set_as in re.sub(r">\s+<", "><", found)


def test_the_anchor_of_a_group_comes_once():
    # Furo wraps a table and gives both its anchor.
    found = [text.split(".. py:module:: ")[1].split("\n", 1)[1] for text in map(reference._group, ["jets", "curves"])]
    assert not any(after.lstrip().startswith("..") for after in found)


@pytest.mark.parametrize("name", [name for name in PAGES if name.startswith("explanation/")])
def test_in_explanations_every_displayed_formula_stands_beside_its_line(name):
    assert "$$" not in source(name)


@pytest.mark.parametrize(
    ("tex", "parts"),
    [
        (r"a = b, \quad c = d \qquad e", ["a = b,", "c = d", "e"]),
        # Inside of braces, brackets that grow, and tables a formula is one.
        (r"\frac{a \quad b}{c}", [r"\frac{a \quad b}{c}"]),
        (r"\left\{ a \quad b \right\} \quad c", [r"\left\{ a \quad b \right\}", "c"]),
        (r"\begin{pmatrix} a \quad b \end{pmatrix}", [r"\begin{pmatrix} a \quad b \end{pmatrix}"]),
    ],
)
def test_formulas_side_by_side_can_stand_below_each_other(tex, parts):
    pytest.importorskip("docutils")
    from studies.guide.building.mathml import apart

    assert apart(tex) == parts


def test_the_gallery_shows_studies_that_there_are():
    found = {study.name: study.subject for study in discover()}
    assert all(found[name] == subject for subject, names in SHOWN.items() for name in names)
    assert list(TITLES) == list(SHOWN)


def test_the_table_of_the_grammar_is_that_of_the_signatures():
    text = source("explanation/conventions")
    table = text[text.index("## One grammar") :].split("\n\n")[2].splitlines()
    kinds = [cell.strip() for cell in table[0].split("|")[2:-1]]
    assert kinds == ["affine", "fit", "free_times", "orientation", "pose", "curve"]
    orders = set()
    for kind in kinds:
        shown = {}
        for line in table[2:]:
            first, *cells = (cell.strip() for cell in line.split("|")[1:-1])
            for name in re.findall(r"`(\w+)`", first):
                shown[name] = cells[kinds.index(kind)]
        found = inspect.signature(inspect.unwrap(getattr(sm, f"{kind}_program"))).parameters
        orders.add(tuple(name for name in found if name in shown and name != "refine"))
        for name, cell in shown.items():
            assert (name in found) == (cell != "–"), (kind, name)
            if cell not in ("yes", "–"):
                assert str(found[name].default) == cell, (kind, name)
    assert len(orders) == 1


def test_parameters_of_a_docstring_become_a_list_and_what_is_raised_stands_apart():
    text = "Do it.\n\nfirst: one, see `x`; second,\n    third (2,): two. No name: here. Raises InputError for others."
    lines = [line for line in reference.converted(text, ("first", "second", "third")) if line]
    assert lines == [
        "Do it.",
        "- **first**: one, see ``x``",
        "- **second, third (2,)**: two. No name: here.",
        "Raises InputError for others.",
    ]


def test_signatures_show_annotations_as_they_are_meant():
    assert signature(sm.answers.Band.plot) == "(axes: Axes | None=None) -> Axes"
    assert "system: Literal['auto', 'condensed', 'sparse'] = 'auto'" in str(signature(sm.ExactNewton))
