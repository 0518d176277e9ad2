"""Notes for people, beside what a command prints."""

from collections.abc import Iterable

from spin_usd.cli.output.lines import tell


def show_notes(notes: Iterable[str]) -> None:
    """Print each note on standard error."""
    for note in notes:
        tell(f"note: {note}")
