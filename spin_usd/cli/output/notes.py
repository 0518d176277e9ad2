"""Notes for people, beside what a command prints."""

from collections.abc import Iterable

from spin_usd.cli.output.lines import NAME, Painted, tell


def show_note(note: str) -> None:
    """Print the note on standard error."""
    tell((Painted("note:", NAME), f" {note}"))


def show_notes(notes: Iterable[str]) -> None:
    """Print each note on standard error."""
    for note in notes:
        show_note(note)
