"""Text between a block's marks, `<!-- generated: NAME -->` and `<!-- end -->`, each on a line of its own."""

import re
import textwrap
from collections.abc import Callable

WIDTH = 120
BLOCK = re.compile(r"^<!-- generated: (\w+) -->\n(.*?)^<!-- end -->$", re.MULTILINE | re.DOTALL)


class NotMeasuredError(Exception):
    """The figures that a block is made of are not there."""


def filled(text: str, make: Callable[[str], str]) -> str:
    """Return `text` with what `make` makes of each block's name in its place."""
    return BLOCK.sub(lambda found: _block(found[1], make(found[1]).strip()), text)


def _block(name: str, text: str) -> str:
    return "\n".join((f"<!-- generated: {name} -->", *([text] if text else []), "<!-- end -->"))


def names(text: str) -> list[str]:
    """Return the names of the blocks in `text`, in their order."""
    return [found[1] for found in BLOCK.finditer(text)]


def prose(text: str) -> str:
    """Break text into lines as long as those of the documents."""
    return textwrap.fill(text, WIDTH, break_on_hyphens=False)
