"""The README as a package index shows it, which keeps absolute addresses only and drops pictures inside the text.

The address is that of `[project.urls] Source` in pyproject.toml, which forges serve files of below `raw` and `blob`.
While there is none, the README goes as it is.
"""

import re
import tomllib
from pathlib import Path

from setuptools import setup

HERE = Path(__file__).parent
# Of Markdown: a picture's mark, its text or a link's, and a target that is neither an address nor a heading.
RELATIVE = re.compile(r"(!?)(\[[^]]*\])\((?![a-z]+:|#)([^)]+)\)")


def readme(text: str, source: str) -> str:
    """The text with its relative targets below the address of a repository; as it is where that is empty."""
    if not source:
        return text
    below = {"!": f"{source.rstrip('/')}/raw/HEAD", "": f"{source.rstrip('/')}/blob/HEAD"}
    return RELATIVE.sub(lambda found: f"{found[1]}{found[2]}({below[found[1]]}/{found[3]})", text)


if __name__ == "__main__":
    project = tomllib.loads((HERE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    text = (HERE / "README.md").read_text(encoding="utf-8")
    source = project.get("urls", {}).get("Source", "")
    setup(long_description=readme(text, source), long_description_content_type="text/markdown")
