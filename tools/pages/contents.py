"""The site's contents: the headings and links of docs/index.md, as Sphinx wants them."""

import re
from collections.abc import Sequence
from pathlib import Path

LAST = "Reference"
"""The heading below which pages that are made of the code belong."""


def add_contents(index: Path, made: Sequence[str]) -> None:
    """Append to the page a hidden table of contents for each of its headings, with the pages linked below it."""
    text = index.read_text()
    for heading, below in re.findall(r"^## ([^\n]*)\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL):
        linked = re.findall(r"\]\(([^)\s#:]+\.(?:md|ipynb))\)", below)
        text += _toctree(heading, [*linked, *(made if heading == LAST else [])])
    index.write_text(text)


def _toctree(caption: str, pages: Sequence[str]) -> str:
    named = "\n".join(dict.fromkeys(pages))
    return f"\n```{{toctree}}\n:hidden:\n:caption: {caption}\n\n{named}\n```\n"
