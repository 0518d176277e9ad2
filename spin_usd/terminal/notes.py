"""Notes for people, beside what a command prints."""

import logging
from collections.abc import Iterable

from spin_usd.terminal.lines import NAME, Painted, print_err


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
    """Print what this package's loggers warn of as notes."""
    logger = logging.getLogger("spin_usd")
    logger.handlers, logger.propagate = [_Notes()], False
