"""The parts of pages that reports are written as: one file each, in light and dark, without scripts."""

import re
from collections.abc import Callable, Iterable, Sequence
from html import escape
from io import StringIO
from typing import Any

STYLE: dict[Any, Any] = {"svg.fonttype": "none", "svg.hashsalt": "spin_usd", "font.size": 8}
"""Settings of matplotlib: text stays text, and the same figure has the same bytes."""
HEAD = """<!doctype html><meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{title}</title>
<style>:root{{color-scheme:light dark}}body{{font:14px sans-serif;margin:2em;max-width:85em}}
table{{border-collapse:collapse}}td,th{{padding:.2em .8em;text-align:right}}
td:first-child,th:first-child,td:last-child,th:last-child{{text-align:left}}.scroll{{overflow-x:auto}}
svg{{background:#fff;max-width:100%;height:auto}}{style}</style>
"""


def head(title: str, style: str = "") -> str:
    """Return the start of a page; `style`: more rules of CSS."""
    return HEAD.format(title=escape(title), style=style)


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of texts, which scrolls by itself where it is wide."""
    lines = [_row("th", heads), *(_row("td", row) for row in rows)]
    return '<div class="scroll"><table>' + "\n".join(lines) + "</table></div>"


def figure_of(size: tuple[float, float], draw: Callable[[Any], None]) -> str:
    """Return an SVG of `size` inches, filled by a function that takes matplotlib's Figure."""
    import matplotlib.style
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    text = StringIO()
    with matplotlib.style.context(["default", STYLE]):
        figure = Figure(figsize=size, facecolor="white", layout="constrained")
        FigureCanvasSVG(figure)
        draw(figure)
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    return re.sub(r"^.*?(?=<svg)", "", text.getvalue(), flags=re.DOTALL)


def _row(tag: str, cells: Iterable[str]) -> str:
    return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"
