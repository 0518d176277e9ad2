"""Findings on a dataset's pictures: records, digests, provenance, and whether the labels agree."""

from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from spin_usd.dataset.picture.brightness import tone_findings
from spin_usd.dataset.store.cache import Purpose, uses
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.dataset.store.json_schema import read_json
from spin_usd.errors import InputError
from spin_usd.formats.image_file import read_image
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.transform import Transform
from spin_usd.labels.labelled_picture import LabelledPicture
from spin_usd.labels.table import LABELS
from spin_usd.scene.finding import WARNING, Finding
from spin_usd.sha256 import sha256_of

AGAIN = "run spin-usd render again with the stage that did"
MEND = "remove its record and run spin-usd render again"


@dataclass(kw_only=True)
class Inventory:
    """The dataset's description, the names of the files that are there, and what the records seen so far speak of:
    files listed, what they use of the cache, the inodes (device, number) of files that were verified, and layers that
    were."""

    description: Mapping[str, Any]
    present: Set[str]
    files: set[str] = field(default_factory=set)
    uses: set[Purpose] = field(default_factory=set)
    inodes: set[tuple[int, int]] = field(default_factory=set)
    layers: set[tuple[str, str]] = field(default_factory=set)


def picture_findings(store: Store, path: Path, inventory: Inventory) -> Iterator[Finding]:
    """All that is wrong with the picture whose record is at `path`."""
    name = store.relative(path)
    try:
        record = read_json(path, "record-1")
    except InputError as e:
        yield Finding(code="record", where=name, message=f"{e.found}; {MEND}")
        return
    if (record["variant"], record["frame"]) != (path.parent.name, path.stem):
        yield Finding(code="record", where=name, message=f"its frame and variant differ from its own path; {MEND}")
    files = list(record["files"].values())
    inventory.files.update(entry["path"] for entry in files)
    inventory.uses |= uses(record)
    inventory.inodes.update(_inode(store.root / entry["path"]) for entry in files if entry["path"] in inventory.present)
    spoilt = [finding for entry in files for finding in _digest(store, entry["path"], entry["sha256"], inventory)]
    yield from spoilt
    yield from _provenance(store, record, name, inventory)
    yield from tone_findings(record, name)
    if not spoilt:
        yield from _labels(store, record, name, len(inventory.description["parts"]))


def _inode(path: Path) -> tuple[int, int]:
    return path.stat().st_dev, path.stat().st_ino


def _digest(store: Store, name: str, sha256: str, inventory: Inventory) -> Iterator[Finding]:
    if name not in inventory.present:
        yield Finding(code="missing", where=name, message=f"the file is missing; {MEND}")
    elif sha256_of(store.root / name) != sha256:
        yield Finding(code="sha256", where=name, message=f"differs from its record; {MEND}")


def _provenance(store: Store, record: dict[str, Any], name: str, inventory: Inventory) -> Iterator[Finding]:
    """Is the stage here the one that made the picture?"""
    stage = record["provenance"]["stage"]
    if inventory.description["stage"]["hashes"].get(record["variant"]) != stage["hash"]:
        message = "was made from another state of the stage; run spin-usd render again"
        yield Finding(code="outdated", where=name, message=message, severity=WARNING)
        return
    folder = Path(stage["root"]).parent
    for layer, sha256 in stage["files"].items():
        if (layer, sha256) not in inventory.layers:
            inventory.layers.add((layer, sha256))
            for finding in _digest(store, (folder / layer).as_posix(), sha256, inventory):
                message = f"is not the layer that made the pictures; {AGAIN}"
                yield Finding(code="layer", where=finding.where, message=message)


def _labels(store: Store, record: dict[str, Any], name: str, parts: int) -> Iterator[Finding]:
    """Is every array of the camera's size, and does each label agree with the others, as it says itself?"""
    arrays = {kind: read_image(store.root / entry["path"])[0] for kind, entry in record["files"].items()}
    shape = (record["camera"]["height"], record["camera"]["width"])
    for kind, array in arrays.items():
        if array.shape[:2] != shape:
            message = f"is {array.shape[:2]}, the camera is {shape}; {MEND}"
            yield Finding(code="size", where=record["files"][kind]["path"], message=message)
            return
    q, t = record["pose"]["q_cam_body"], record["pose"]["t_cam_body"]
    picture = LabelledPicture(
        camera=Camera(**{**record["camera"], "distortion": tuple(record["camera"]["distortion"])}),
        T_cam_body=Transform.from_quaternion(to="cam", of="body", q=q, t=t),
        parts=parts,
        arrays={kind: array for kind, array in arrays.items() if kind in LABELS},
    )
    for label in LABELS.values():
        for fault in label.faults(picture) if label.name in picture.arrays else ():
            yield Finding(code=fault.code, where=name, message=f"{fault.message}; {MEND}")
