"""Merge datasets of one stage, such as the shards of a run, into one folder.

Run again, it goes on.
"""

import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from msgspec import to_builtins

from spin_usd.basics.progress import Progress
from spin_usd.commands.merge.file_transfer import FileTransfer, repair_of
from spin_usd.commands.merge.merged_dataset import (
    MergedDataset,
    collect_events,
    merged_description,
    read_dataset,
    refuse_different,
)
from spin_usd.commands.merge.options import MergeOptions
from spin_usd.errors import InputError, OutputError
from spin_usd.files.changes import put
from spin_usd.files.folder import FileIn, Folder
from spin_usd.files.size_limits import MAX_RECORD
from spin_usd.options import takes
from spin_usd.planning.cost import Timings, read_measured, write_measured
from spin_usd.planning.shard import Shard, missing_pictures, read_manifest, remove_manifest, write_manifest
from spin_usd.records.record import Record
from spin_usd.store.atomic import link_atomically, write_json
from spin_usd.store.cache import MEASURED, entries
from spin_usd.store.dataset_folder import Lease, Store
from spin_usd.store.names import DESCRIPTION, STAGE, event_record_of, picture_of, record_of
from spin_usd.store.read_documents import read_record, recorded_files
from spin_usd.store.tags import SCHEMA, TAGS, joined

CHECKING, MERGING = "checking: record", "merging: picture"
AGAIN = "render that picture again, or leave that dataset out"


@dataclass(frozen=True, kw_only=True)
class MergedPicture:
    """A picture: its variant, its frame, and the dataset that it is taken from."""

    variant: str
    frame: str
    source: MergedDataset

    @property
    def name(self) -> str:
        """The name of its record in that dataset."""
        return record_of(self.variant, self.frame)

    @property
    def path(self) -> Path:
        """Where its record lies, for messages."""
        return self.source.store.root / self.name

    @property
    def data(self) -> bytes:
        """The bytes of its record. Raises InputError."""
        return self.source.store.folder.read(self.name, MAX_RECORD)

    def record(self) -> Record:
        """Read the record. Raises InputError where it is damaged, or not of this picture."""
        with suppress(InputError):
            record = read_record(self.source.store.folder, self.name)
            if recorded_files(record, self.variant, self.frame):
                return record
        raise InputError("is not this picture's record", where=self.path, do=repair_of(self.source.store.root))


@dataclass(kw_only=True)
class _Collected:
    """Findings so far: pictures by variant and frame, and how each variant's were rendered."""

    pictures: dict[tuple[str, str], MergedPicture] = field(default_factory=dict)
    settings: dict[str, tuple[Mapping[str, Any], Path]] = field(default_factory=dict)

    def add(self, picture: MergedPicture) -> None:
        record = picture.record()
        known = self.pictures.setdefault((picture.variant, picture.frame), picture)
        if known is not picture and known.data != picture.data:
            raise InputError(f"contradicts {known.path}", where=picture.path, do=AGAIN)
        settings = vars(record.settings) | record.options
        usual, where = self.settings.setdefault(picture.variant, (settings, picture.path))
        if differing := [name for name in {**settings, **usual} if settings.get(name) != usual.get(name)]:
            found = f"was rendered with another {' and another '.join(differing)} than {where}"
            raise InputError(found, where=picture.path, do=AGAIN)


def collect(sources: Sequence[MergedDataset], progress: Callable[[int, int], None]) -> list[MergedPicture]:
    """Return all pictures, each once, in the order of the datasets. Raises InputError where the same picture is not the
    same in two, or pictures of a variant were not rendered alike."""
    found = _Collected()
    records = [(source, picture_of(name)) for source in sources for name in source.store.records()]
    for done, (source, (frame, variant)) in enumerate(records):
        progress(done, len(records))
        found.add(MergedPicture(variant=variant, frame=frame, source=source))
    progress(len(records), len(records))
    return list(found.pictures.values())


@dataclass(frozen=True, kw_only=True)
class MergeReport:
    """The report of a merge."""

    out: str
    """Its folder."""
    pictures: int
    """How many it holds."""
    added: int
    """How many of the shards' pictures were added."""
    kept: int
    """How many of them were there already."""
    missing: Mapping[str, int]
    """Number of missing pictures, by shard ("1/3"), if known."""
    seconds: float
    """Wall-clock time."""


@takes(MergeOptions)
def merge(options: MergeOptions) -> MergeReport:
    """Put datasets of one stage, such as the shards of a run, into one. Run again, it goes on.

    The result has the bytes of a single run, the events of all variants, and the tags of all. Pictures that are still
    to come do not raise: the report's `missing` counts them by shard.

    Raises InputError for datasets of different stages, rendered otherwise, damaged, or with another picture of the same
    name; and OutputError.
    """
    given = [options.shards] if isinstance(options.shards, str | Path) else options.shards
    shards = [Path(shard) for shard in given]
    return merge_datasets(shards, Path(options.out), copy=options.copy, progress=options.progress)


def merge_datasets(shards: Sequence[Path], out: Path, *, copy: bool = False, progress: Progress) -> MergeReport:
    """Put the pictures of all `shards` into the dataset `out`, which is made if missing.

    Its files are linked, or copied with `copy` and between file systems. Raises InputError if the datasets are not of
    one stage and rendered alike, a picture differs between two, or a file is damaged; and OutputError.
    """
    began = time.monotonic()
    _refuse_folders(shards, out)
    sources, store = [read_dataset(shard) for shard in shards], Store(root=out.absolute())
    store.prepare()
    with store.locked() as lease:
        there = [read_dataset(out)] if store.folder.type_of(STAGE) else []
        refuse_different([*there, *sources])
        pictures = collect([*there, *sources], partial(progress, CHECKING))
        events = [each for each in collect_events([*there, *sources]) if each[1] not in there]
        new = [picture for picture in pictures if picture.source not in there]
        tags = joined([each.store.root / TAGS for each in (*there, *sources) if each.store.folder.type_of(TAGS)])
        _begin(store, [*there, *sources], lease)
        transfer = FileTransfer(out=store.root, work=lease.work, copy=copy)
        _put_pictures(new, transfer, progress)
        for record, source in events:
            transfer.put(source.store.root, record.file, record.sha256)
            transfer.put_record(source.store.root, event_record_of(record.variant))
        _put_cache(sources, transfer, progress)
        if tags:
            write_json(store.folder, TAGS, {"schema": SCHEMA, "dataset": out.name, "tags": tags}, work=lease.work)
        _add_measured(store, {id(picture.source): picture.source for picture in new}.values(), lease)
        missing = _missing([*there, *sources], pictures, store, lease)
    return MergeReport(
        out=str(out),
        pictures=len(pictures),
        added=len(new),
        kept=len(pictures) - len(new),
        missing=missing,
        seconds=time.monotonic() - began,
    )


def _refuse_folders(shards: Sequence[Path], out: Path) -> None:
    """Raise InputError if there is no shard, one is given twice, or one and `out` contain each other."""
    if not shards:
        raise InputError("there is nothing to merge", do="give the folders of shards")
    given, b = set[Path](), out.resolve()
    for shard in shards:
        a, do = shard.resolve(), "choose another folder; existing contents of --out are kept"
        if a == b:
            raise InputError("is the folder to merge into", where=shard, do=do)
        if a.is_relative_to(b) or b.is_relative_to(a):
            raise InputError("one lies inside the other", where=f"{shard} and {out}", do=do)
        if a in given:
            raise InputError("is given twice", where=shard, do="give each shard once")
        given.add(a)


def _begin(store: Store, sources: Sequence[MergedDataset], lease: Lease) -> None:
    """Write the common dataset.json, and the stage if missing."""
    write_json(store.folder, DESCRIPTION, to_builtins(merged_description(sources)), work=lease.work)
    if store.folder.type_of(STAGE) is None:
        stage, copied = Folder(sources[0].store.stage), lease.work / STAGE
        for name in stage.files():
            link_atomically(Folder(copied), name, FileIn(stage, name), work=lease.work, copy=True)
        try:
            put(store.folder, copied, STAGE)
        except OSError as e:
            raise OutputError(f"cannot be written ({e.strerror})", where=store.stage, do="free some space") from e


def _put_pictures(pictures: Sequence[MergedPicture], transfer: FileTransfer, progress: Progress) -> None:
    """Put all files of each picture, and then its record, so that an interruption leaves complete pictures."""
    for done, picture in enumerate(pictures):
        progress(MERGING, done, len(pictures))
        try:
            _put_picture(picture, transfer)
        except (InputError, OutputError) as e:
            do = repair_of(picture.source.store.root) if isinstance(e, InputError) else e.do
            rest = f"{done} of {len(pictures)} pictures are merged and stay; another run merges the others"
            raise type(e)(e.found, where=e.where, do=f"{do}, and merge again: {rest}") from e
    progress(MERGING, len(pictures), len(pictures))


def _put_picture(picture: MergedPicture, transfer: FileTransfer) -> None:
    root, record = picture.source.store.root, picture.record()
    for kind, name in recorded_files(record, picture.variant, picture.frame).items():
        transfer.put(root, name, record.files[kind].sha256)
    transfer.put_record(root, picture.name)


def _put_cache(sources: Sequence[MergedDataset], transfer: FileTransfer, progress: Progress) -> None:
    """Add cache entries that the merged cache lacks, so that later runs make nothing again, except damaged ones."""
    for done, source in enumerate(sources):
        progress("merging: cache", done, len(sources))
        for entry in entries(source.store):
            name = entry.file.name
            if Folder(transfer.out).type_of(name) is None:
                with suppress(InputError):
                    transfer.put(source.store.root, name, entry.sha256)
    progress("merging: cache", len(sources), len(sources))


def _add_measured(store: Store, sources: Iterable[MergedDataset], lease: Lease) -> None:
    """Add the measured costs of these datasets' runs."""
    total = Timings()
    for source in sources:
        measured = read_measured(source.store.folder, MEASURED)
        total.add(measured.expected, measured.taken)
    if total.expected:
        write_measured(store.folder, MEASURED, total, work=lease.work)


def _missing(
    sources: Sequence[MergedDataset], pictures: Sequence[MergedPicture], store: Store, lease: Lease
) -> dict[str, int]:
    """Return how many pictures are still to come, by shard, and keep the run's manifest for the next merge."""
    there = {(picture.frame, picture.variant) for picture in pictures}
    manifests = {each for each in (read_manifest(source.store) for source in sources) if each}
    if len(manifests) == 1:
        write_manifest(store, *manifests, work=lease.work)
    if not missing_pictures(store):
        remove_manifest(store)
    missing: dict[tuple[str, str], Shard] = {}
    for manifest in sorted(manifests, key=lambda each: each.count):
        missing = manifest.missing(there) | missing  # of other numbers of shards: each is of one shard here
    return dict(sorted(Counter(map(str, missing.values())).items()))
