"""The stage in a dataset: which layers records vouch for, and whether all files are as they were written."""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.files.node import NodeType
from spin_usd.store.dataset_folder import Store
from spin_usd.store.file_digests import SUMS, changed, unlisted
from spin_usd.store.names import STAGE
from spin_usd.store.read_documents import read_record

STAGE_SUMS = f"{STAGE}/{SUMS}"


def refuse_changed_stage(store: Store, found: str, *, do: str, new: Path | None = None) -> None:
    """Raise InputError with that text if a file of the dataset's stage was changed, and one that names SHA256SUMS if
    that is damaged. Files that the `new` stage in that folder, if any, has too are not lost when it replaces this one,
    and may be changed."""
    for file in changed(store.stage) if new is None else _lost(store, new):
        name = file.relative_to(store.root).as_posix()
        if name == STAGE_SUMS or store.folder.type_of(STAGE_SUMS) is not NodeType.FILE or _vouched(store, name):
            raise InputError(
                "does not match the files of stage/",
                where=store.root / STAGE_SUMS,
                do="run spin-usd check --repair on the dataset",
            )
        raise InputError(found, where=file, do=do)


def _lost(store: Store, new: Path) -> Iterator[Path]:
    """Yield the files that are not as they were written, nor as in the new stage."""
    for file in unlisted(store.stage):
        name = file.relative_to(store.stage).as_posix()
        there = Folder(new).type_of(name) is NodeType.FILE
        if not there or Folder(new).sha256(name) != Folder(store.stage).sha256(name):
            yield file


def _vouched(store: Store, name: str) -> bool:
    """Return whether a record lists the file `name`, unchanged, as a source of a picture."""
    layer = (name, store.folder.sha256(name))
    for record in store.records():
        with suppress(InputError):
            if layer in read_record(store.folder, record).provenance.stage.layers:
                return True
    return False
