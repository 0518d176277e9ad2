"""The digest by which files are known."""

import hashlib
from pathlib import Path

from spin_usd.files.size_limits import UNBOUNDED
from spin_usd.files.user_file import open_file


def sha256_of(file: Path, *, most: int = UNBOUNDED) -> str:
    """Return the sha256 (hex) of the bytes in `file`. Raises InputError if it is not a file, or has more than
    `most`."""
    with open_file(file, most) as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
