"""The remedy for a name that is not among the known ones."""

from collections.abc import Collection
from difflib import get_close_matches


def suggestion(name: str, known: Collection[str], otherwise: str = "") -> str:
    """Return the nearest of the known names as a question; if none is near, `otherwise`, or all of them."""
    if meant := get_close_matches(name, known, n=1):
        return f"did you mean {meant[0]}?"
    return otherwise or f"choose among {', '.join(known)}"
