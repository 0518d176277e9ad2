"""The names that data give files: relative to a folder, and never out of it.

The schemas hold the same pattern, and a test compares the two.
"""

import os
import re
from pathlib import Path

from spin_usd.errors import InputError

CHECK = "run spin-usd check on the dataset"
PATTERN = r"^(?!\.{0,2}(/|$))(?![\s\S]*/\.{0,2}(/|$))[^\u0000]{1,4000}$"
"""Parts with slashes between them: none is empty, "." or ".."; the first cannot be empty, so the name is not absolute.
A limit as in file systems, which refuse further names themselves."""
_NAME = re.compile(PATTERN)


def parts_of(name: str, root: Path) -> list[str]:
    """Return the parts of a `name` below the folder `root`. Raises InputError for names that lead elsewhere."""
    if not (_NAME.match(name) and (name.isascii() or _can_be_encoded(name))):
        raise InputError(f"{name[:200]!r} lies outside the folder, or names no file", where=root, do=CHECK)
    return name.split("/")


def _can_be_encoded(name: str) -> bool:
    """Return whether a file system can have that name: half of a pair of surrogates has no bytes."""
    try:
        os.fsencode(name)
    except UnicodeEncodeError:
        return False
    return True
