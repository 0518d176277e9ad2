"""Plain text in Markdown."""

import re
from collections.abc import Iterable, Sequence


def cell(text: str) -> str:
    """Return the text on one line, with what Markdown or a table would take for markup escaped, but `code` kept."""
    parts = re.split(r"(`[^`]*`)", " ".join(text.split()))
    parts[::2] = [re.sub(r"([*<>\[\]{}$]|(?<!\w)_|_(?!\w))", r"\\\1", part) for part in parts[::2]]
    return "".join(parts).replace("|", r"\|")


def table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of cells."""
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (headings, ["---"] * len(headings), *rows))


def page_of_table(head: str, headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a page that is a table below its head."""
    return f"{head}\n{table(headings, rows)}\n"
