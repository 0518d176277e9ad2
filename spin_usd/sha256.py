"""The digest by which files are known."""

import hashlib
from pathlib import Path


def sha256_of(file: Path) -> str:
    """Return the sha256 (hex) of the bytes in `file`. Raises OSError."""
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
