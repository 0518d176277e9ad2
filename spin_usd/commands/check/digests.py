"""Rule: a file of the dataset has the bytes that its record says."""

from collections.abc import Iterator
from pathlib import Path

from spin_usd.commands.check.special_files import special_file_finding
from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.files.node import NodeType
from spin_usd.scene.finding import Finding

MAKE_AGAIN = "run spin-usd check --repair"


def digest_findings(root: Path, name: str, sha256: str) -> Iterator[Finding]:
    """Find whether the file `name` of the dataset in `root` is missing, cannot be read, or has other bytes than its
    record says. Where a link is in its way, the finding is on that."""
    folder = Folder(root)
    try:
        found = folder.sha256(name)
    except InputError as e:
        yield _unread(folder, name, e.found)
        return
    if found != sha256:
        yield Finding(code="sha256", where=name, message=f"differs from its record; {MAKE_AGAIN}")


def _unread(folder: Folder, name: str, reason: str) -> Finding:
    if node := folder.in_the_way(name):
        return special_file_finding(node)
    match folder.type_of(name):
        case None:
            message = f"the file is missing; {MAKE_AGAIN}"
        case NodeType.FOLDER:
            message = f"is a folder; move it elsewhere, and {MAKE_AGAIN}"
        case _:
            message = f"{reason}; {MAKE_AGAIN}"
    return Finding(code="missing", where=name, message=message)
