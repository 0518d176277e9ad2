"""The help of a command, with colours where a terminal has some. rich would draw it too, and take 0.2 s to load."""

import re
import shutil
import sys

import typer

from spin_usd.terminal.terminal import has_colours

MAX_WIDTH = 110
"""Columns of the help on a wide terminal."""

_HEADING = re.compile(r"^[A-Z][a-z]+(?: [a-z]+)*:", re.MULTILINE)
_NAME = re.compile(r"^  (?:-{1,2}[a-z][\w-]*(?:, --[\w-]+)*|[a-z][\w-]*(?=  ))", re.MULTILINE)


def width() -> int:
    """Return how many columns of the terminal the help takes; 80 in a pipe."""
    return min(shutil.get_terminal_size().columns, MAX_WIDTH)


def help_text(plain: str) -> str:
    """Return the `plain` text of a help with bold headings, and colours for the names of commands and options."""
    if not has_colours(sys.stdout):
        return plain
    headed = _HEADING.sub(lambda found: typer.style(found[0], bold=True), plain)
    return _NAME.sub(lambda found: typer.style(found[0], fg=typer.colors.CYAN), headed)
