"""The folder of an export, and the file in it that says of what: export.json."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from spin_usd.dataset.store.atomic import write_json
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.dataset.store.json_schema import read_json
from spin_usd.errors import InputError
from spin_usd.files.folder import Folder

SELF = "export.json"
SCHEMA = "export-1"
WORDS = {
    "format": "of another format",
    "options": "with other options",
    "dataset": "of other pictures",
    "target": "of another target",
    "splits": "with other splits",
    "seed": "with another seed",
    "pictures": "of other pictures",
    "spin_usd": "by another version of spin_usd",
}


def refuse_other(out: Path, described: Mapping[str, Any]) -> None:
    """Raise InputError where the folder holds anything but what is `described`, begun or finished. Write nothing."""
    held = Store(root=out).held()
    if not held:
        return
    if SELF not in held:
        raise InputError(f"holds {held[0]} but no {SELF}", where=out, do="choose an empty folder")
    found = read_json(Folder(out), SELF, SCHEMA)
    for name, words in WORDS.items():
        if found[name] != described[name]:
            raise InputError(f"is an export {words}", where=out, do="choose another folder, or remove that one")


def describe(out: Path, described: Mapping[str, Any], *, complete: bool, work: Path) -> None:
    """Write export.json."""
    write_json(Folder(out), SELF, {"schema": SCHEMA, **described, "complete": complete}, work=work)
