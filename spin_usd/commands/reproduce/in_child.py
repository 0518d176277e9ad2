"""The child's part of `reproduce`: one recorded picture rendered again, without the dataset's cache."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from msgspec import to_builtins

from spin_usd.commands.render.worker import Worker
from spin_usd.commands.render.worker_options import WorkerOptions
from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.files.node import NodeType
from spin_usd.files.size_limits import MAX_RECORD
from spin_usd.nesting import finite_json
from spin_usd.picture.kinds import RENDERED
from spin_usd.store.names import record_of
from spin_usd.store.recorded_settings import recorded_options, recorded_settings


def make_again(*, dataset: str, record: dict[str, Any], folder: str, device: str) -> dict[str, Any]:
    """Render into `folder` from the dataset's stage with the record's settings, light on the `device`, and compare
    digests."""
    provenance = record["provenance"]
    kinds = tuple(record["files"])
    options = WorkerOptions(
        root=folder,
        work=folder,
        stage=str(Folder(Path(dataset)).path(provenance["stage"]["root"])),
        options=recorded_options(record),
        settings=replace(recorded_settings(record), device=device),
        renders=not RENDERED.isdisjoint(kinds),
    )
    worker = Worker(options=to_builtins(options))
    reader = worker.reader(record["variant"])
    if record["index"] >= len(reader.frames) or reader.frames[record["index"]].name != record["frame"]:
        raise InputError(
            f"the stage no longer holds picture {record['frame']!r} at place {record['index']}", where=dataset
        )
    worker.picture(variant=record["variant"], index=record["index"], kinds=kinds, keep_render=False)
    # Not held against the schema: it names a stage that lies elsewhere.
    again = finite_json(worker.store.folder.read(record_of(record["variant"], record["frame"]), MAX_RECORD))
    if unknown := [kind for kind in kinds if kind not in again["files"]]:
        raise InputError(f"the record lists {unknown[0]}, which this version does not make", where=dataset)
    recorded, now = provenance["versions"], worker.versions
    return {
        "files": [_compared(Folder(Path(dataset)), kind, record, again) for kind in kinds],
        "versions": {
            k: [recorded.get(k, ""), now.get(k, "")] for k in sorted({*recorded, *now}) if recorded.get(k) != now.get(k)
        },
    }


def _compared(folder: Folder, kind: str, record: dict[str, Any], again: dict[str, Any]) -> dict[str, Any]:
    entry = record["files"][kind]
    return {
        "kind": kind,
        "path": entry["path"],
        "recorded": entry["sha256"],
        "found": folder.sha256(entry["path"]) if folder.type_of(entry["path"]) is NodeType.FILE else None,
        "again": again["files"][kind]["sha256"],
    }
