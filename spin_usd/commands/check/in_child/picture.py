"""The child's part of `check` of a dataset: what is wrong with one picture, and what its record lists, as JSON."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from spin_usd.commands.check.digests import MAKE_AGAIN, digest_findings
from spin_usd.commands.check.in_child.checked_picture import CheckedPicture
from spin_usd.commands.check.in_child.picture_rules import PICTURE_RULES
from spin_usd.errors import InputError, SpinError
from spin_usd.faults import reading
from spin_usd.files.folder import FileIn, Folder
from spin_usd.scene.finding import Finding
from spin_usd.store.cache import uses
from spin_usd.store.json_schema import read_json
from spin_usd.store.names import DESCRIPTION, picture_of
from spin_usd.store.picture_file import read_picture_file


def picture_findings(*, dataset: str, record: str) -> dict[str, Any]:
    """Return "findings" on the picture whose record is the file `record` of the dataset, and "listed": what `check`
    needs of that besides, None where it is not valid."""
    root = Path(dataset)
    try:
        with reading(record):
            content = read_json(Folder(root), record, "record-1")
    except SpinError as e:
        return {"findings": [asdict(_finding("record", record, e))], "listed": None}
    found = dict.fromkeys(_findings(root, record, content))  # numbers that one rule cannot take, others cannot either
    return {"findings": [asdict(each) for each in found], "listed": _listed(content)}


def read_arrays(root: Path, record: Mapping[str, Any]) -> Iterator[tuple[str, NDArray[Any] | Finding]]:
    """Yield the numbers of each file of the record by its kind, or a finding on one that cannot be decoded."""
    for kind, entry in record["files"].items():
        try:
            with reading(entry["path"]):
                file, channels = FileIn(Folder(root), entry["path"]), len(entry["channels"])
                yield kind, read_picture_file(file, kind, entry["dtype"], channels)
        except SpinError as e:
            yield kind, _finding("unreadable", entry["path"], e)


def _listed(record: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "variant": record["variant"],
        "stage": record["provenance"]["stage"],
        "files": [entry["path"] for entry in record["files"].values()],
        "uses": [asdict(use) for use in uses(record)],
    }


def _findings(root: Path, where: str, record: Mapping[str, Any]) -> Iterator[Finding]:
    if (record["frame"], record["variant"]) != picture_of(where):
        message = f"its frame and variant differ from its own path; {MAKE_AGAIN}"
        yield Finding(code="record", where=where, message=message)
    entries = record["files"].values()
    wrong = [each for entry in entries for each in digest_findings(root, entry["path"], entry["sha256"])]
    found = {} if wrong else dict(read_arrays(root, record))
    wrong += [each for each in found.values() if isinstance(each, Finding)]
    yield from wrong
    arrays = {} if wrong else {kind: each for kind, each in found.items() if not isinstance(each, Finding)}
    description = _description(str(root))
    picture = CheckedPicture(where=where, record=record, description=description or {}, arrays=arrays)
    for rule in PICTURE_RULES if description else ():  # numbers mean nothing without their targets
        try:
            with reading(where):
                yield from rule(picture)
        except SpinError as e:
            yield _finding("numbers", where, e)


def _finding(code: str, where: str, error: SpinError) -> Finding:
    return Finding(code=code, where=where, message=f"{error.found}; {MAKE_AGAIN}")


@cache
def _description(root: str) -> Mapping[str, Any] | None:
    """Return dataset.json; None where that cannot be used, which has a finding of its own."""
    with suppress(InputError):
        return read_json(Folder(Path(root)), DESCRIPTION, "dataset-1")
    return None
