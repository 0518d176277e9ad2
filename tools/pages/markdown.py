"""Plain text in Markdown."""

import re


def cell(text: str) -> str:
    """Return the text on one line, with what Markdown or a table would take for markup escaped, but `code` kept."""
    parts = re.split(r"(`[^`]*`)", " ".join(text.split()))
    parts[::2] = [re.sub(r"([*<>\[\]{}$]|(?<!\w)_|_(?!\w))", r"\\\1", part) for part in parts[::2]]
    return "".join(parts).replace("|", r"\|")


def row(*cells: str) -> str:
    """Return the row of a table."""
    return f"| {' | '.join(cells)} |"
