"""The child's part of `reproduce`: one recorded picture rendered again, without the dataset's cache."""

from pathlib import Path
from typing import Any

from spin_usd.dataset.render.worker import Worker
from spin_usd.dataset.render.worker_options import WorkerOptions
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.dataset.store.json_schema import read_json
from spin_usd.dataset.store.tree import NodeType, file_at, type_of
from spin_usd.errors import InputError
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.effort import Effort
from spin_usd.sha256 import sha256_of


def make_again(*, dataset: str, record: dict[str, Any], folder: str) -> dict[str, Any]:
    """Render into `folder` from the dataset's stage with the record's settings, and compare digests."""
    provenance = record["provenance"]
    render, kinds = provenance["render"], tuple(record["files"])
    options = WorkerOptions(
        root=folder,
        work=folder,
        stage=str(file_at(Path(dataset), provenance["stage"]["root"])),
        image_suffix=Path(record["files"]["image"]["path"]).suffix if "image" in kinds else ".png",
        settings=RenderSettings(
            renderer=render["renderer"], effort=Effort(**render["effort"]), seed=provenance["seed"]["dataset"]
        ),
    )
    worker = Worker(options=options.as_json())
    reader = worker.reader(record["variant"])
    if record["index"] >= len(reader.frames) or reader.frames[record["index"]].name != record["frame"]:
        raise InputError(
            f"the stage no longer holds picture {record['frame']!r} at place {record['index']}", where=dataset
        )
    worker.picture(variant=record["variant"], index=record["index"], kinds=kinds, keep_render=False)
    again = read_json(worker.store.record(record["variant"], record["frame"]), "record-1")
    recorded, now = provenance["versions"], worker.versions
    return {
        "files": [_compared(Store(root=Path(dataset)), kind, record, again) for kind in kinds],
        "versions": {
            k: [recorded.get(k, ""), now.get(k, "")] for k in sorted({*recorded, *now}) if recorded.get(k) != now.get(k)
        },
    }


def _compared(store: Store, kind: str, record: dict[str, Any], again: dict[str, Any]) -> dict[str, Any]:
    entry = record["files"][kind]
    path = store.root / entry["path"]
    return {
        "kind": kind,
        "path": entry["path"],
        "recorded": entry["sha256"],
        "found": sha256_of(path) if type_of(path) is NodeType.FILE else None,
        "again": again["files"][kind]["sha256"],
    }
