"""Lines for people and programs. Their contents are untrusted; each stays one line, and cannot control the terminal.
Notes for people are separate from a command's output; a report for programs is one JSON object, with a bundled schema.

Standard output and error survive a full disk, a reader that went away, and a closed descriptor. The command's work is
done in any case; the exit code reports lost output.
"""

import errno
import io
import json
import logging
import os
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TextIO

import typer

from spin_usd.errors import printable

if TYPE_CHECKING:
    from msgspec import Struct


GOOD, BAD, DOUBTFUL, NAME, QUIET = "green", "red", "yellow", "cyan", "bright_black"
"""Colours by their meaning."""

DUMB = ("dumb", "unknown")
CLOSED = OSError(errno.EBADF, os.strerror(errno.EBADF))


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
    """Return whether the stream leads to a terminal that can move its cursor: a dumb one is treated like a pipe."""
    return stream is not None and stream.isatty() and os.environ.get("TERM", "").lower() not in DUMB


def has_colours(stream: TextIO | None) -> bool:
    """Return whether output there may have colours: on a terminal, unless NO_COLOR (https://no-color.org)."""
    return is_terminal(stream) and not os.environ.get("NO_COLOR")


def show_report(report: "Struct") -> None:
    """Print the `report` of a command in one line, by schemas/COMMAND-report-1.schema.json."""
    from msgspec import to_builtins  # not above: most commands print no report

    print_out(json.dumps(to_builtins(report)))


def show_note(note: str) -> None:
    """Print the note on standard error."""
    print_err((Painted("note:", NAME), f" {note}"))


def show_notes(notes: Iterable[str]) -> None:
    """Print each note on standard error."""
    for note in notes:
        show_note(note)


class _Notes(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        show_note(record.getMessage())


def show_warnings() -> None:
    """Print warnings of this package's loggers as notes."""
    logger = logging.getLogger("spin_usd")
    logger.handlers, logger.propagate = [_Notes()], False


class LastingStream(io.RawIOBase):
    """A descriptor that can be written for ever. `fault`: the first reason why something did not arrive, but for a
    reader that went away, such as head: that has all it wanted."""

    def __init__(self, descriptor: int, *, closed: bool) -> None:
        self._descriptor, self._closed = descriptor, closed
        self.fault: OSError | None = None

    def writable(self) -> bool:
        return True

    def fileno(self) -> int:
        return self._descriptor

    def isatty(self) -> bool:
        return os.isatty(self._descriptor)

    def write(self, data: Any, /) -> int:
        """Write as much as possible, and accept all."""
        try:
            if self._closed:
                raise CLOSED
            return os.write(self._descriptor, data)
        except BrokenPipeError:
            pass
        except OSError as fault:
            self.fault = self.fault or fault
        return len(data)


def lasting_streams() -> LastingStream:
    """Replace standard output and error by lasting streams, and return the output's.

    Closed descriptors are opened on the null device: the next file opened would otherwise become standard output.
    """
    given = (sys.__stdin__, sys.__stdout__, sys.__stderr__)
    for descriptor, stream in enumerate(given):
        if stream is None and not _is_open(descriptor):
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free
    output = LastingStream(1, closed=sys.__stdout__ is None)
    if sys.stdout is sys.__stdout__:
        sys.stdout = _wrapped(output, sys.stdout)
    if sys.stderr is sys.__stderr__:
        sys.stderr = _wrapped(LastingStream(2, closed=sys.__stderr__ is None), sys.stderr)
    return output


def _is_open(descriptor: int) -> bool:
    try:
        os.fstat(descriptor)
    except OSError:
        return False
    return True


def _wrapped(stream: LastingStream, old: TextIO | None) -> TextIO:
    encoding = "utf-8" if old is None else old.encoding
    return io.TextIOWrapper(io.BufferedWriter(stream), encoding, "backslashreplace", line_buffering=True)
