"""Findings on a stage or a dataset."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from spin_usd.dataset.check_cache import cache_findings
from spin_usd.dataset.check_pictures import Inventory, picture_findings
from spin_usd.dataset.child import STAGE_PATIENCE_S, Child, ChildDiedError, stage_memory
from spin_usd.dataset.schema import read_json
from spin_usd.dataset.stage_path import root_layer
from spin_usd.dataset.store import LOCK, TEMPORARY, WORK, Store
from spin_usd.errors import InputError, SpinError
from spin_usd.scene.finding import WARNING, Finding

Progress = Callable[[str, int, int], None]


def check(path: Path, *, progress: Progress) -> tuple[str, list[Finding]]:
    """What `path` is ("stage" or "dataset") and the findings on it. InputError when it is neither."""
    if path.is_dir() and (path / "dataset.json").is_file():
        return "dataset", list(dataset_findings(path.absolute(), progress=progress))
    if (root := root_layer(path)).is_file():
        return "stage", stage_findings(root, progress=progress)
    do = "give a .usda file, or a folder with dataset.json"
    raise InputError("is neither a stage nor a dataset", where=path, do=do)


def stage_findings(root: Path, *, progress: Progress) -> list[Finding]:
    """Findings on the stage whose root layer is `root`."""
    try:
        with Child(memory=stage_memory()) as child:
            found = child.call(
                "check_stage",
                stage=str(root.absolute()),
                progress=lambda counts: progress("reading: picture", *counts),
                within_s=STAGE_PATIENCE_S,
            )
    except ChildDiedError as died:
        return [Finding(code="unreadable", where=str(root), message=f"cannot be read: {died.found}")]
    return [Finding(**finding) for finding in found]


def dataset_findings(root: Path, *, progress: Progress) -> Iterator[Finding]:
    """All that is wrong with the dataset in the folder `root`: its stage, its pictures, and stray files."""
    store = Store(root=root)
    try:
        description = read_json(store.description, "dataset-1")
    except InputError as e:
        yield Finding(code="description", where="dataset.json", message=e.found)
        return
    yield from _stage_of(store, description, progress)
    records = list(store.records())
    if not records:
        yield Finding(code="empty", where="records", message="the dataset holds no picture")
    inventory = Inventory(description=description)
    for done, path in enumerate(records):
        progress("checking: picture", done, len(records))
        yield from picture_findings(store, path, inventory)
    progress("checking: picture", len(records), len(records))
    yield from cache_findings(store, inventory)
    yield from _strays(store, inventory.files)


def _stage_of(store: Store, description: dict[str, Any], progress: Progress) -> Iterator[Finding]:
    stage = store.root / description["stage"]["root"]
    if not stage.is_file():
        yield Finding(code="stage", where=description["stage"]["root"], message="the stage's root layer is missing")
        return
    try:
        yield from stage_findings(stage, progress=progress)
    except SpinError as e:
        yield Finding(code="stage", where=str(e.where or stage), message=e.found)


def _strays(store: Store, listed: set[str]) -> Iterator[Finding]:
    """Files that no record lists."""
    for path in sorted(store.root.rglob("*")):
        name = store.relative(path)
        if path.is_dir() or name.startswith(("records/", "stage/", f"{WORK}/")) or name in ("dataset.json", LOCK):
            continue
        if TEMPORARY in name:
            yield Finding(code="temporary", where=name, message="was left by an interrupted run; run render again")
        elif name not in listed and path.parent.parent.parent == store.root:
            yield Finding(code="stray", where=name, message="is in no record", severity=WARNING)
