"""Settings of Sphinx for the site of the documents, which tools/build_site builds."""

import re
from typing import Any

from pygments.lexers.shell import BashLexer
from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx

project = "spin_usd"
author = copyright = "the spin_usd contributors"
root_doc = "docs/index"
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton"]
myst_heading_anchors = 4
nb_execution_mode = "force"
nb_execution_timeout = 300
nb_execution_raise_on_error = True
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
python_maximum_signature_line_length = 88
suppress_warnings = ["toc.not_included"]  # tables beside the pages that link them
default_role = "literal"  # docstrings have names in single backticks
html_theme = "furo"
html_title = "spin_usd"
html_static_path = html_css_files = ["site.css"]
html_copy_source = False
html_show_copyright = False

_QUOTED = re.compile(r"(`[^`]*`)")


def escape(app: Sphinx, what: str, name: str, of: Any, options: Any, lines: list[str]) -> None:
    """Escape what reStructuredText would take for markup in docstrings, which are plain text with `names`."""
    for number, line in enumerate(lines):
        parts = _QUOTED.split(line)
        parts[::2] = [re.sub(r"([*|]|(?<=\w)_(?!\w))", r"\\\1", part) for part in parts[::2]]
        lines[number] = "".join(parts)


def setup(app: Sphinx) -> None:
    """Know the languages of batch scripts and tables; read docstrings as the plain text that they are."""
    app.add_lexer("sbatch", BashLexer)
    app.add_lexer("csv", TextLexer)
    app.connect("autodoc-process-docstring", escape, priority=100)  # before napoleon
