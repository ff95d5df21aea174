"""The build: pages woven into a folder, which Sphinx reads."""

import shutil
import sys
import tempfile
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.util.docutils import docutils_namespace, patch_docutils

from studies.guide.building import gallery, pages, reference

HERE = Path(__file__).parent
SETTINGS = {
    "project": "symmotion",
    "author": "The symmotion developers",
    "copyright": "the symmotion developers, BSD-3-Clause",
    "version": version("symmotion"),
    "release": version("symmotion"),
    "extensions": [
        "myst_parser",
        "sphinx.ext.autodoc",
        "sphinx.ext.viewcode",
        "studies.guide.building.extension",
    ],
    "myst_enable_extensions": ["dollarmath", "colon_fence", "deflist"],
    "myst_heading_anchors": 3,
    "html_theme": "furo",
    "html_title": "symmotion",
    "html_math_renderer": "mathml",
    "html_static_path": [str(HERE / "static")],
    "html_css_files": ["guide.css"],
    "html_copy_source": False,
    "html_show_sphinx": False,
    # Summaries would be fetched, which browsers refuse of pages that are files.
    "html_show_search_summary": False,
    "html_theme_options": {"navigation_with_keys": True},
    "pygments_style": "tango",
    "pygments_dark_style": "monokai",
    "autodoc_typehints": "none",
    "autodoc_inherit_docstrings": False,
    "autodoc_member_order": "bysource",
    "add_module_names": False,
    "python_maximum_signature_line_length": 78,
    "toc_object_entries": False,
    # Links that lead nowhere are errors, but for the types in signatures.
    "nitpicky": True,
    "nitpick_ignore_regex": [("py:class", ".*")],
    "suppress_warnings": ["config.cache"],
}


def build(output: Path, progress: Callable[[str], None]) -> int:
    """Write the guide into a folder; 0, or 1 where a page fails or Sphinx has a warning."""
    with tempfile.TemporaryDirectory() as folder:
        sources, work = Path(folder, "pages"), Path(folder, "work")
        made = {name: _woven(name, progress) for name in pages.sources()}
        made |= gallery.pages(progress)
        for name, text in made.items():
            _write(sources / f"{name}.md", text)
        for name, text in reference.pages().items():
            _write(sources / f"{name}.rst", text)
        # In a file: what only the theme knows would be refused from elsewhere.
        (sources / "conf.py").write_text("".join(f"{key} = {value!r}\n" for key, value in SETTINGS.items()))
        progress("Sphinx")
        with patch_docutils(), docutils_namespace():
            told = {"status": None, "warning": sys.stderr}
            app = Sphinx(sources, sources, output, work, "html", **told, warningiserror=True, freshenv=True)
            app.build(force_all=True)
    shutil.rmtree(output / ".doctrees", ignore_errors=True)
    return app.statuscode


def _woven(name: str, progress: Callable[[str], None]) -> str:
    progress(name)
    return pages.woven(name, pages.source(name), reference.known())


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
