"""Rule: every file among the pictures and the events is in a record.

Outside these folders all else is the user's.
"""

from collections import defaultdict
from collections.abc import Iterator
from pathlib import PurePosixPath

from spin_usd.commands.check.digests import MAKE_AGAIN
from spin_usd.commands.check.inventory import Inventory
from spin_usd.files.folder import Folder
from spin_usd.picture.kinds import FILE_KINDS
from spin_usd.scene.finding import WARNING, Finding
from spin_usd.store.names import EVENTS, event_record_of, events_of, record_of

STRAY = "stray"


def stray_findings(inventory: Inventory) -> Iterator[Finding]:
    """Yield a finding on the first of the files that could be one picture's and have no record, and on each other file
    in no record. Files that an unusable record may list are skipped."""
    by_record = defaultdict[str | None, list[str]](list)
    for name in sorted(inventory.present - inventory.files):
        if name.partition("/")[0] in FILE_KINDS:
            by_record[_record(name)].append(name)
    for record, names in by_record.items():
        if record is None or record in inventory.present - inventory.unread:
            yield from (_stray(name, "move it elsewhere, or remove it") for name in names)
        elif record not in inventory.unread and not Folder(inventory.root).in_the_way(record):
            do = f"if it is a picture's, {MAKE_AGAIN}; if not, move it elsewhere"
            yield _stray(names[0], do, _others(len(names) - 1))
    for name in sorted(name for name in inventory.present if name.startswith(f"{EVENTS}/")):
        record = event_record_of(PurePosixPath(name).stem)
        known = name in (record, events_of(PurePosixPath(name).stem)) and record in inventory.present
        if not known and not Folder(inventory.root).in_the_way(record):
            yield _stray(name, "run spin-usd render again with --events, or remove it")


def _record(name: str) -> str | None:
    """Return the name of the record that could list that file."""
    match PurePosixPath(name).parts:
        case [_, variant, file]:
            return record_of(variant, PurePosixPath(file).stem)
    return None


def _others(count: int) -> str:
    """Return a note that the other files of a picture are in no record either."""
    if count == 0:
        return ""
    return ", nor is another file of that picture" if count == 1 else f", nor are {count} other files of that picture"


def _stray(name: str, do: str, others: str = "") -> Finding:
    return Finding(code=STRAY, where=name, message=f"is not in any record{others}; {do}", severity=WARNING)
