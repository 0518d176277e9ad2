"""One picture's files to a dataset at a URL, in an order that leaves no record of files that are not there."""

from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Any

from spin_usd.errors import OutputError
from spin_usd.files.changes import remove_file
from spin_usd.files.folder import Folder
from spin_usd.nesting import finite_json
from spin_usd.store.json_schema import read_json
from spin_usd.store.names import RECORDS
from spin_usd.store.publish.dataset_url import DatasetUrl
from spin_usd.store.unfinished import recorded_files


def publish_picture(root: Path, record: str, url: DatasetUrl) -> None:
    """Move the picture whose record is so named, from the dataset's folder `root` to `url`.

    An old record goes first, a new one comes last, then what the old one alone described goes. Raises OutputError, and
    InputError where the record is not one.
    """
    variant, frame = _picture_of(record)
    new = recorded_files(read_json(Folder(root), record, "record-1"), variant, frame)
    old = recorded_files(_old_record(url, record), variant, frame)
    if old:
        url.remove(record)
    for name in (*new.values(), record):
        url.put(name, Folder(root).path(name))
    for name in set(old.values()) - set(new.values()):
        url.remove(name)
    for name in (record, *new.values()):
        remove_file(Folder(root), name)


def _picture_of(record: str) -> tuple[str, str]:
    """Return the variant and the frame whose record is so named: a child says the name, which may be anybody's."""
    match PurePosixPath(record).parts:
        case (folder, variant, file) if folder == RECORDS and file.endswith(".json"):
            return variant, file.removesuffix(".json")
    raise OutputError("is not the name of a record", where=record)


def _old_record(url: DatasetUrl, name: str) -> Mapping[str, Any]:
    try:
        record = finite_json(url.read(name) or b"{}")
    except ValueError:
        return {}
    return record if isinstance(record, dict) else {}
