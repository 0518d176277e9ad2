"""Notes for people, beside what a command prints."""

import sys
from collections.abc import Iterable


def show_notes(notes: Iterable[str]) -> None:
    """Print each note on standard error."""
    for note in notes:
        print(f"note: {note}", file=sys.stderr)
