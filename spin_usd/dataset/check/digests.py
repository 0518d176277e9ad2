"""Rule: a file of the dataset has the bytes that its record says."""

from collections.abc import Iterator
from pathlib import Path

from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.scene.finding import Finding

MAKE_AGAIN = "run spin-usd check --repair"


def digest_findings(root: Path, name: str, sha256: str) -> Iterator[Finding]:
    """Find whether the file `name` of the dataset in `root` is missing, or has other bytes than its record says."""
    try:
        found = Folder(root).sha256(name)
    except InputError:
        yield Finding(code="missing", where=name, message=f"the file is missing; {MAKE_AGAIN}")
        return
    if found != sha256:
        yield Finding(code="sha256", where=name, message=f"differs from its record; {MAKE_AGAIN}")
