"""Findings on a dataset: schemas, digests, that the labels agree with one another and with the camera, strays."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from spin_usd.dataset.child import Child
from spin_usd.dataset.schema import read_json
from spin_usd.dataset.store import LOCK, TEMPORARY, WORK, Store, sha256_of
from spin_usd.errors import InputError, SpinError
from spin_usd.formats.image_file import read_image
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.transform import Transform

REPROJECTION_PX = 1e-3  # float32 body coordinates of a metre-sized target: 1e-4 px at SPEED+'s closest range
DEPTH_RELATIVE = 1e-6  # float32 rounds to 6e-8; body coordinates and pose each add as much

MEND = "remove its record and run spin-usd render again"


@dataclass(frozen=True, kw_only=True)
class Finding:
    """Something wrong: `code` for programs, `where` a file or prim, `message` for people; a "warning" fails nothing."""

    code: str
    where: str
    message: str
    severity: str = "error"


def check(path: Path, *, progress: Callable[[str, int, int], None]) -> tuple[str, list[Finding]]:
    """What `path` is ("stage" or "dataset") and the findings on it. InputError when it is neither."""
    if path.is_dir() and (path / "dataset.json").is_file():
        return "dataset", list(dataset_findings(path.absolute(), progress=progress))
    if path.is_file():
        return "stage", _stage_findings(path)
    if (path / "dataset.usda").is_file():
        return "stage", _stage_findings(path / "dataset.usda")
    raise InputError(
        "is neither a stage nor a dataset", where=path, do="give a .usda file, or a folder with dataset.json"
    )


def _stage_findings(path: Path) -> list[Finding]:
    with Child() as child:
        found = child.call("check_stage", stage=str(path.absolute()))
    return [Finding(**finding) for finding in found]


def dataset_findings(root: Path, *, progress: Callable[[str, int, int], None]) -> Iterator[Finding]:
    """All that is wrong with the dataset in `root`."""
    store = Store(root=root)
    try:
        description = read_json(store.description, "dataset-1")
    except InputError as e:
        yield Finding(code="description", where="dataset.json", message=e.found)
        return
    yield from _stage_of(store, description)
    records = list(store.records())
    listed: set[str] = set()
    if not records:
        yield Finding(code="empty", where="records", message="the dataset holds no picture")
    for done, path in enumerate(records):
        progress("checking", done, len(records))
        yield from _record_findings(store, path, description, listed)
    progress("checking", len(records), len(records))
    yield from _strays(store, listed)


def _stage_of(store: Store, description: dict[str, Any]) -> Iterator[Finding]:
    stage = store.root / description["stage"]["root"]
    if not stage.is_file():
        yield Finding(code="stage", where=description["stage"]["root"], message="the stage's root layer is missing")
        return
    try:
        yield from _stage_findings(stage)
    except SpinError as e:
        yield Finding(code="stage", where=str(e.where or stage), message=e.found)


def _record_findings(store: Store, path: Path, description: dict[str, Any], listed: set[str]) -> Iterator[Finding]:
    name = store.relative(path)
    try:
        record = read_json(path, "record-1")
    except InputError as e:
        yield Finding(code="record", where=name, message=f"{e.found}; {MEND}")
        return
    if (record["variant"], record["frame"]) != (path.parent.name, path.stem):
        yield Finding(code="record", where=name, message="its frame and variant differ from its own path")
    whole = True
    for entry in record["files"].values():
        listed.add(entry["path"])
        for finding in _file_findings(store, entry):
            whole = False
            yield finding
    stage = record["provenance"]["stage"]
    if description["stage"]["hashes"].get(record["variant"]) != stage["hash"]:
        message = "was made from another state of the stage; run spin-usd render again"
        yield Finding(code="outdated", where=name, message=message, severity="warning")
    if whole:
        yield from _label_findings(store, record, name, len(description["parts"]))


def _file_findings(store: Store, entry: dict[str, str]) -> Iterator[Finding]:
    path = store.root / entry["path"]
    if not path.is_file():
        yield Finding(code="missing", where=entry["path"], message=f"the file is missing; {MEND}")
    elif sha256_of(path) != entry["sha256"]:
        yield Finding(code="sha256", where=entry["path"], message=f"differs from its record; {MEND}")


def _label_findings(store: Store, record: dict[str, Any], name: str, parts: int) -> Iterator[Finding]:
    """Do the labels cover the same pixels, and does each body point project onto its own pixel at its own depth?"""
    arrays = {kind: read_image(store.root / entry["path"])[0] for kind, entry in record["files"].items()}
    shape = (record["camera"]["height"], record["camera"]["width"])
    for kind, array in arrays.items():
        if array.shape[:2] != shape:
            yield Finding(
                code="size", where=record["files"][kind]["path"], message=f"is {array.shape[:2]}, not {shape}"
            )
            return
    ids, depth, dense = (arrays.get(kind) for kind in ("segmentation", "depth", "dense_pose"))
    if ids is not None and int(ids.max(initial=0)) > parts:
        yield Finding(
            code="parts", where=name, message=f"segmentation holds id {ids.max()}, dataset.json lists {parts}"
        )
    if ids is not None and depth is not None and ((ids > 0) != (depth > 0)).any():
        yield Finding(code="support", where=name, message="segmentation and depth cover different pixels")
    if ids is None or dense is None:
        return
    if dense[ids == 0].any():
        yield Finding(code="support", where=name, message="dense pose reaches beyond the segmentation")
    rows, columns = np.nonzero(ids)
    camera = Camera(**{**record["camera"], "distortion": tuple(record["camera"]["distortion"])})
    pose = record["pose"]
    pose = Transform.from_quaternion(to="cam", of="body", q=pose["q_cam_body"], t=pose["t_cam_body"])
    points = pose.points(dense[rows, columns])
    off = np.abs(camera.project(points) - np.stack([columns + 0.5, rows + 0.5], -1)).max(initial=0)
    if not off <= REPROJECTION_PX:
        yield Finding(code="reprojection", where=name, message=f"dense pose projects {off:.3g} px beside its pixels")
    if depth is not None and len(rows):
        off = (np.abs(depth[rows, columns] - points[:, 2]) / points[:, 2]).max()
        if not off <= DEPTH_RELATIVE:
            yield Finding(code="depth", where=name, message=f"depth and dense pose differ by {off:.3g} of the range")


def _strays(store: Store, listed: set[str]) -> Iterator[Finding]:
    """Files that no record lists."""
    for path in sorted(store.root.rglob("*")):
        name = store.relative(path)
        if path.is_dir() or name.startswith(("records/", "stage/", f"{WORK}/")) or name in ("dataset.json", LOCK):
            continue
        if TEMPORARY in name:
            yield Finding(code="temporary", where=name, message="was left by an interrupted run; run render again")
        elif name not in listed and path.parent.parent.parent == store.root:
            yield Finding(code="stray", where=name, message="is in no record", severity="warning")
