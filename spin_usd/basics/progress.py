"""The callback by which long work reports how far it is."""

from collections.abc import Callable

Progress = Callable[[str, int, int], None]
"""Takes the name of the counted things, the number done and the total, such as ("rendering: picture", 3, 8)."""

Note = Callable[[str], None]
"""Takes a sentence about work that goes on."""


def no_progress(subject: str, done: int, total: int) -> None:
    """Ignore the progress, for callers that do not need it."""


def no_note(sentence: str) -> None:
    """Ignore the note, for callers that do not need it."""
