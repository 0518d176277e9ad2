"""The callback by which long work reports how far it is."""

from collections.abc import Callable

Progress = Callable[[str, int, int], None]
"""Takes what is being counted, how many are done and how many there are, such as ("rendering: picture", 3, 8)."""

Note = Callable[[str], None]
"""Takes a sentence about work that goes on."""


def no_progress(subject: str, done: int, total: int) -> None:
    """Ignore the progress: for callers that do not ask for it."""


def no_note(sentence: str) -> None:
    """Ignore the note: for callers that do not ask for them."""
