"""Findings on a dataset's pictures: records, their files' digests, then what the rules say."""

from collections.abc import Iterator
from pathlib import Path

from spin_usd.dataset.check.checked_picture import MAKE_AGAIN, CheckedPicture, Inventory, digest_findings
from spin_usd.dataset.check.picture_rules import PICTURE_RULES
from spin_usd.dataset.store.cache import uses
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.dataset.store.json_schema import read_json
from spin_usd.errors import InputError
from spin_usd.scene.finding import Finding


def picture_findings(store: Store, path: Path, inventory: Inventory) -> Iterator[Finding]:
    """Yield all that is wrong with the picture whose record is at `path`, and add what the record lists to the
    inventory."""
    where = store.relative(path)
    try:
        record = read_json(path, "record-1")
    except InputError as e:
        yield Finding(code="record", where=where, message=f"{e.found}; {MAKE_AGAIN}")
        return
    if (record["variant"], record["frame"]) != (path.parent.name, path.stem):
        message = f"its frame and variant differ from its own path; {MAKE_AGAIN}"
        yield Finding(code="record", where=where, message=message)
    files = list(record["files"].values())
    inventory.files.update(entry["path"] for entry in files)
    inventory.uses |= uses(record)
    inventory.inodes.update(_inode(store.root / entry["path"]) for entry in files if entry["path"] in inventory.present)
    damaged = [each for entry in files for each in digest_findings(store, entry["path"], entry["sha256"], inventory)]
    yield from damaged
    picture = CheckedPicture(store=store, where=where, record=record, intact=not damaged, inventory=inventory)
    for rule in PICTURE_RULES:
        yield from rule(picture)


def _inode(path: Path) -> tuple[int, int]:
    return path.stat().st_dev, path.stat().st_ino
