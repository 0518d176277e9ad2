"""Find the files to make of a picture that an earlier run may have made."""

import os
import stat
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from msgspec import to_builtins

from spin_usd.basics.nesting import finite_json
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_RECORD
from spin_usd.labels.table import NEEDS
from spin_usd.picture.kinds import FILE_KINDS, IMAGE, LAYOUTS, RENDERED
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.records.record import Record, StageProvenance
from spin_usd.scene.derived.content_keys import KEYS
from spin_usd.scene.scene import STATED
from spin_usd.store.atomic import write_json
from spin_usd.store.dataset_folder import Store
from spin_usd.store.names import record_of
from spin_usd.store.read_documents import read_record, recorded_files


@dataclass(frozen=True, kw_only=True)
class WantedFiles:
    """The requested kinds of file, the options that change the image (`PictureOptions.recorded`), the image's file name
    extension, whether every byte of existing files is verified before use, and the names of pictures to make again in
    any case."""

    kinds: tuple[str, ...]
    options: Mapping[str, Any]
    image_suffix: str
    verify: bool = False
    again: Collection[str] | None = None


def kinds_left(
    store: Store,
    picture: PlannedPicture,
    wanted: WantedFiles,
    stage: StageProvenance,
    *,
    names: Mapping[int, str],
    finished: Callable[[Record], None],
    outdated: Callable[[Record, StageProvenance], None],
    work: Path,
) -> tuple[str, ...]:
    """Return the kinds of file to make of the picture, and bring the record of a finished one up to date.

    A picture is finished if its record has the same keys, and all its files exist in today's channels; then nothing is
    left to make, and `finished` is called with the record. `outdated` is called with the record of a picture that has
    other keys or channels, and with `stage`, its entry in the record. A picture made again keeps the kinds of file it
    had. The record of a picture made from another state of the stage is updated to list `stage` too, with its names of
    the targets (`names` by id) and its source. `work` is for temporary files.
    """
    record = _record(store, picture)
    had = recorded_files(record, picture.variant, picture.frame)
    if record is None or not _is_finished(store, record, had, picture, wanted):
        if record and had and not _is_current(record, had, picture):
            outdated(record, stage)
        return tuple(kind for kind in FILE_KINDS if kind in had or kind in wanted.kinds if _can_have(picture, kind))
    finished(record)
    provenance = record.provenance
    if (record.index, provenance.time_code, provenance.stage) != (picture.index, picture.time_code, stage):
        name = record_of(picture.variant, picture.frame)
        # Not through its type: that would write 0 as 0.0, and drop fields of a later version.
        before = finite_json(store.folder.read(name, MAX_RECORD))
        write_json(store.folder, name, _renamed(before, stage, picture, names), work=work)
    return ()


def _renamed(
    record: dict[str, Any], stage: StageProvenance, picture: PlannedPicture, names: Mapping[int, str]
) -> dict[str, Any]:
    """Return the record with the stage's values that do not change the picture's files."""
    record["provenance"] |= {"stage": to_builtins(stage), "time_code": picture.time_code, "keys": picture.keys}
    targets = [{**target, "name": names.get(target["id"], target["name"])} for target in record["targets"]]
    changed = {"index": picture.index, "targets": targets}
    renamed: dict[str, Any] = {}
    for name, value in record.items():
        if name not in STATED:
            renamed[name] = changed.get(name, value)
        if name == "variant":  # where a new record has them
            renamed |= picture.stated
    return renamed


def is_finished(store: Store, picture: PlannedPicture, wanted: WantedFiles) -> bool:
    """Return whether nothing is left to make of the picture; write nothing."""
    record = _record(store, picture)
    had = recorded_files(record, picture.variant, picture.frame)
    return record is not None and _is_finished(store, record, had, picture, wanted)


def _is_finished(
    store: Store, record: Record, had: Mapping[str, str], picture: PlannedPicture, wanted: WantedFiles
) -> bool:
    """Return whether `record`, whose files are `had`, is the picture's, with all requested files in the requested
    form."""
    return (
        bool(had)
        and picture.name not in (wanted.again or ())
        and _is_current(record, had, picture)
        and (IMAGE not in wanted.kinds or record.options == wanted.options)
        and _complete(store, picture, had, wanted)
        and (not wanted.verify or _as_recorded(store, record))
    )


def _is_current(record: Record, had: Mapping[str, str], picture: PlannedPicture) -> bool:
    """Return whether the files of the `record` equal the picture's files as they would be written today."""
    return _same_content(record, picture, had) and _same_channels(record)


def _record(store: Store, picture: PlannedPicture) -> Record | None:
    """Read the picture's record; None if there is no usable one."""
    with suppress(InputError):
        return read_record(store.folder, record_of(picture.variant, picture.frame))
    return None


def _same_content(record: Record, picture: PlannedPicture, had: Mapping[str, str]) -> bool:
    decisive = KEYS if RENDERED & had.keys() else ("geometry",)
    if not all(_can_have(picture, kind) for kind in had):
        return False
    own = had.keys() & picture.label_keys.keys()
    return all(record.provenance.keys.get(key) == picture.keys[key] for key in (*decisive, "targets", *own))


def _same_channels(record: Record) -> bool:
    """Return whether the files are in the channels that they would be written in today."""
    return all(file.channels in LAYOUTS[kind] for kind, file in record.files.items())


def _can_have(picture: PlannedPicture, kind: str) -> bool:
    """Return whether the picture has the input for files of that kind."""
    return kind not in NEEDS or kind in picture.label_keys


def _complete(store: Store, picture: PlannedPicture, had: Mapping[str, str], wanted: WantedFiles) -> bool:
    if IMAGE in wanted.kinds and not had.get(IMAGE, "").endswith(wanted.image_suffix):
        return False
    # As text: paths as objects take most of the time of a resumed run's 240,000 records.
    missing = (kind for kind in wanted.kinds if kind not in had)
    return not any(_can_have(picture, kind) for kind in missing) and all(
        _holds_something(f"{store.root}/{path}") for path in had.values()
    )


def _holds_something(path: str) -> bool:
    """Return whether there is a file that is not empty: a power cut may leave one that is."""
    try:
        status = os.stat(path)
    except OSError:
        return False
    return stat.S_ISREG(status.st_mode) and status.st_size > 0


def _as_recorded(store: Store, record: Record) -> bool:
    """Return whether all files of the record have the recorded bytes."""
    return all(store.folder.sha256(file.path) == file.sha256 for file in record.files.values())
