"""A dataset to merge with others, and the conditions on all of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from msgspec.structs import replace

from spin_usd.commands.merge.file_transfer import repair_of
from spin_usd.errors import InputError
from spin_usd.records.descriptions import DatasetDescription
from spin_usd.records.event_record import EventRecord
from spin_usd.store.dataset_folder import Store
from spin_usd.store.file_digests import same_files
from spin_usd.store.names import DESCRIPTION, EVENTS
from spin_usd.store.read_documents import read_dataset_json, read_event_record
from spin_usd.store.stage_layers import refuse_changed_stage

COMMON = {
    "targets": "other targets",
    "parts": "other parts",
    "classes": "other classes",
    "frames": "another number of frames",
    "files": "other kinds of file",
}


@dataclass(frozen=True, kw_only=True)
class MergedDataset:
    """A dataset, and its dataset.json."""

    store: Store
    description: DatasetDescription


def read_dataset(root: Path) -> MergedDataset:
    """Read the dataset in the folder `root`. Raises InputError if there is none, something in it is a link, or its
    stage was changed."""
    store = Store(root=root.absolute())
    if store.folder.type_of(DESCRIPTION) is None:
        raise InputError(
            f"is not a dataset: it has no {DESCRIPTION}", where=root, do="give a folder of spin-usd render"
        )
    store.refuse_special_files()
    refuse_changed_stage(store, "is not as spin-usd wrote it", do="restore it, or render that shard again")
    try:
        return MergedDataset(store=store, description=read_dataset_json(store.folder))
    except InputError as e:
        raise InputError(e.found, where=e.where, do=repair_of(root)) from e


def refuse_different(sources: Sequence[MergedDataset]) -> None:
    """Raise InputError unless all are of one stage, with the same kinds of file."""
    first, *others = sources
    for other in others:
        if words := _difference(first, other):
            found = f"has {words} than {first.store.root}"
            raise InputError(found, where=other.store.root, do="merge shards of one stage, rendered alike")


def _difference(first: MergedDataset, other: MergedDataset) -> str | None:
    """Return a difference that prevents merging two datasets; None if they can be merged."""
    a, b = first.description, other.description
    hashes = a.stage.hashes, b.stage.hashes
    alike = all(hashes[0][name] == hashes[1][name] for name in hashes[0].keys() & hashes[1].keys())
    if (
        not alike
        or a.stage.origin != b.stage.origin
        or a.stage.root != b.stage.root
        or not same_files(first.store.stage, other.store.stage)
    ):
        return "another stage"
    return next((words for name, words in COMMON.items() if getattr(a, name) != getattr(b, name)), None)


def collect_events(sources: Sequence[MergedDataset]) -> list[tuple[EventRecord, MergedDataset]]:
    """Return the records of events, each variant's once, with the first dataset that has it. Raises InputError where
    one is damaged, or the events of a variant are not the same in two."""
    found: dict[str, tuple[EventRecord, MergedDataset]] = {}
    for source in sources:
        records = [PurePosixPath(name) for name in source.store.folder.files(EVENTS) if name.endswith(".json")]
        for record in (read_event_record(source.store.folder, each.stem) for each in records):
            known, first = found.setdefault(record.variant, (record, source))
            if known.sha256 != record.sha256:
                contradicted = f"contradicts {first.store.root / record.file}"
                where, do = source.store.root / record.file, "remove one of them, with its record"
                raise InputError(contradicted, where=where, do=do)
    return list(found.values())


def merged_description(sources: Sequence[MergedDataset]) -> DatasetDescription:
    """Return the common dataset.json: the first's, with the variants of all."""
    first = sources[0].description
    hashes = {name: value for each in sources for name, value in each.description.stage.hashes.items()}
    return replace(first, stage=replace(first.stage, hashes=hashes), variants=list(hashes))
