"""Lines for people and programs. What is in them may come from anywhere; each stays one, and steers no terminal."""

import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TextIO

import typer

from spin_usd.errors import printable

GOOD, BAD, DOUBTFUL, NAME, QUIET = "green", "red", "yellow", "cyan", "bright_black"
"""Colours by what they say of a text."""

DUMB = ("dumb", "unknown")


@dataclass(frozen=True)
class Painted:
    """A part of a line with a colour, where it is shown on a terminal that has some."""

    text: str
    colour: str | None = None
    bold: bool = False

    def on_terminal(self) -> str:
        return typer.style(printable(self.text), fg=self.colour, bold=self.bold or None)


Line = str | Sequence[str | Painted]
"""The text of a line, or its parts."""


def print_out(*lines: Line) -> None:
    """Print the lines on standard output."""
    _print(lines, sys.stdout)


def print_err(*lines: Line) -> None:
    """Print the lines on standard error."""
    _print(lines, sys.stderr)


def _print(lines: Sequence[Line], stream: TextIO) -> None:
    coloured = has_colours(stream)
    for line in lines:
        parts = (line,) if isinstance(line, str) else line
        stream.write("".join(_text(part, coloured) for part in parts) + "\n")
    stream.flush()


def _text(part: str | Painted, coloured: bool) -> str:
    if isinstance(part, Painted):
        return part.on_terminal() if coloured else printable(part.text)
    return printable(part)


def is_terminal(stream: TextIO | None) -> bool:
    """Return whether the stream leads to a terminal that can move its cursor: a dumb one gets what a pipe gets."""
    return stream is not None and stream.isatty() and os.environ.get("TERM", "").lower() not in DUMB


def has_colours(stream: TextIO | None) -> bool:
    """Return whether what is written there may have colours: on a terminal, unless NO_COLOR (https://no-color.org)."""
    return is_terminal(stream) and not os.environ.get("NO_COLOR")
