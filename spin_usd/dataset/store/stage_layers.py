"""The stage in a dataset: which layers records vouch for, and whether all files are as they were written."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.dataset.store.file_digests import SUMS, changed
from spin_usd.dataset.store.names import STAGE
from spin_usd.errors import InputError
from spin_usd.files.node import NodeType
from spin_usd.files.size_limits import MAX_RECORD
from spin_usd.nesting import parsed_json

STAGE_SUMS = f"{STAGE}/{SUMS}"


def layers_of(stage: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield the name in the dataset and the sha256 of each layer that made a picture, by the `stage` of its record's
    provenance."""
    folder = Path(stage["root"]).parent
    return (((folder / layer).as_posix(), sha256) for layer, sha256 in stage["files"].items())


def refuse_changed_stage(store: Store, found: str, *, do: str) -> None:
    """Raise InputError with those words where a file of the dataset's stage is not as it was written, and one that
    names SHA256SUMS where that is what is wrong."""
    for file in changed(store.stage):
        name = file.relative_to(store.root).as_posix()
        if name == STAGE_SUMS or store.folder.type_of(STAGE_SUMS) is not NodeType.FILE or _vouched(store, name):
            raise InputError(
                "does not list the files of stage/ as they are",
                where=store.root / STAGE_SUMS,
                do="run spin-usd check --repair on the dataset",
            )
        raise InputError(found, where=file, do=do)


def _vouched(store: Store, name: str) -> bool:
    """Return whether some record says that the file `name` made a picture as it is. Records are not validated."""
    layer = (name, store.folder.sha256(name))
    for record in store.records():
        with suppress(InputError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
            if layer in layers_of(parsed_json(store.folder.read(record, MAX_RECORD))["provenance"]["stage"]):
                return True
    return False
