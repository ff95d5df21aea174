"""What Sphinx is told: pages with what their code shows, formulas as MathML, docstrings as they are written here."""

from typing import Any

from docutils import nodes
from docutils.parsers.rst import directives
from docutils.utils.math import MathError
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective
from sphinx.writers.html5 import HTML5Translator

from studies.guide.building import reference, signatures
from studies.guide.building.formulas import lines_of
from studies.guide.building.mathml import apart, mathml

logger = logging.getLogger(__name__)


class Formula(SphinxDirective):
    """A formula, and beside it the lines of the library that compute it.

    ```{formula} symmotion/energies/affine.py
    :code: text of the first line, which is there once
    :lines: 2
    :of: symmotion.energies.Rigidity
    :source: HJK (10)
    the formula in TeX
    ```
    """

    has_content = True
    required_arguments = 1
    option_spec = {  # noqa: RUF012 - as Docutils has it
        "code": directives.unchanged_required,
        "lines": directives.nonnegative_int,
        "of": directives.unchanged_required,
        "source": directives.unchanged,
    }

    def run(self) -> list[nodes.Node]:
        path = self.arguments[0]
        try:
            number, code = lines_of(path, self.options["code"], self.options.get("lines", 1))
        except (LookupError, OSError) as error:
            raise self.error(str(error)) from error
        target = self.options["of"]
        formula = nodes.container("", classes=["formula"])
        tex = "\n".join(self.content)
        said = nodes.container("", classes=["formula-says"])
        said += nodes.math_block(tex, tex, nowrap=True, number=None, label=None, docname=self.env.docname)
        if source := self.options.get("source"):
            said += nodes.paragraph("", source, classes=["formula-source"])
        does = nodes.container("", classes=["formula-does"])
        block = nodes.literal_block(code, code, language="python")
        line = nodes.paragraph("", classes=["formula-where"])
        reference = addnodes.pending_xref(
            "", refdomain="py", reftype="obj", reftarget=target, refexplicit=True, refdoc=self.env.docname, refwarn=True
        )
        reference += nodes.literal("", target.replace("symmotion.", "sm."))
        line += [reference, nodes.Text(f" in {path}, line {number}")]
        does += [block, line]
        formula += [said, does]
        self.set_source_info(formula)
        return [formula]


def _inline(self: HTML5Translator, node: nodes.math) -> None:
    self.body.append(_mathml(node, node.astext(), False))
    raise nodes.SkipNode


def _block(self: HTML5Translator, node: nodes.math_block) -> None:
    formulas = "".join(_mathml(node, tex, True) for tex in apart(node.astext()))
    self.body.append(f'<div class="math">{formulas}</div>\n')
    raise nodes.SkipNode


def _mathml(node: nodes.Element, tex: str, block: bool) -> str:
    try:
        return mathml(tex, block)
    except MathError as error:
        logger.warning("%s: %s", tex, error, location=node)
        return ""


def _docstring(app: Sphinx, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    lines[:] = [*reference.converted("\n".join(lines), signatures.parameters(thing)), ""]


def _signature(app: Sphinx, what: str, name: str, thing: Any, *_: Any) -> tuple[str, str] | None:
    if what == "property" or (found := signatures.signature(thing)) is None:
        return None
    arguments, arrow, returned = found.partition(") -> ")
    return (f"{arguments})" if arrow else found), returned


def setup(app: Sphinx) -> dict[str, Any]:
    app.add_directive("formula", Formula)
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    app.connect("autodoc-process-docstring", _docstring)
    app.connect("autodoc-process-signature", _signature)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
