"""Whether a stream leads to a terminal, where people look, or to a pipe or a file, which programs read."""

import os
from typing import TextIO

DUMB = ("dumb", "unknown")


def is_terminal(stream: TextIO | None) -> bool:
    """Return whether the stream leads to a terminal that can move its cursor: a dumb one gets what a pipe gets."""
    return stream is not None and stream.isatty() and os.environ.get("TERM", "").lower() not in DUMB


def has_colours(stream: TextIO | None) -> bool:
    """Return whether what is written there may have colours: on a terminal, unless NO_COLOR (https://no-color.org)."""
    return is_terminal(stream) and not os.environ.get("NO_COLOR")
