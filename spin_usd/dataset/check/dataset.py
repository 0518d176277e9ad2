"""Findings on a dataset: links, its stage, its pictures, and stray files."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from spin_usd.dataset.check.cache import cache_findings
from spin_usd.dataset.check.digests import MAKE_AGAIN
from spin_usd.dataset.check.inventory import Inventory
from spin_usd.dataset.check.pictures import answered_findings, picture_call
from spin_usd.dataset.check.provenance import RENDER_AGAIN
from spin_usd.dataset.check.shards import shard_findings
from spin_usd.dataset.check.stage import StageAnswer, stage_call
from spin_usd.dataset.check.strange import strange_finding
from spin_usd.dataset.check.strays import stray_findings
from spin_usd.dataset.check.sums import sums_findings
from spin_usd.dataset.process.processors import usable_cpus
from spin_usd.dataset.process.shared_calls import results_of
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.dataset.store.json_schema import read_json
from spin_usd.dataset.store.names import DESCRIPTION, RECORDS, STAGE
from spin_usd.errors import InputError, SpinError
from spin_usd.files.folder import Folder
from spin_usd.files.node import STRANGE, NodeType
from spin_usd.progress import Progress
from spin_usd.scene.finding import Finding

PICTURES_PER_CHILD = 4  # starting one takes as long as checking so many


def dataset_findings(root: Path, *, progress: Progress) -> Iterator[Finding]:
    """Find all that is wrong with the dataset in the folder `root`, each once, in the order of its records."""
    told: set[Finding] = set()
    for finding in _findings(root, progress):
        if finding not in told:
            told.add(finding)
            yield finding


def _findings(root: Path, progress: Progress) -> Iterator[Finding]:
    store, nodes = Store(root=root), list(Folder(root).walk())
    yield from (strange_finding(node) for node in nodes if node.type in STRANGE)
    present = frozenset(node.name for node in nodes if node.type is NodeType.FILE)
    inventory = Inventory(root=root, description=None, present=present)
    try:
        inventory.description = read_json(store.folder, DESCRIPTION, "dataset-1")
    except InputError as e:
        if not store.folder.in_the_way(DESCRIPTION):
            yield Finding(code="description", where=DESCRIPTION, message=f"{e.found}; {MAKE_AGAIN}")
    stage = None
    if not any(node.type in STRANGE and node.name.partition("/")[0] == STAGE for node in nodes):
        stage = _root_layer(store, inventory.description)
        yield from _lost_stage(stage, inventory)
    yield from _answered(store, stage if stage in present else None, inventory, progress)
    yield from sums_findings(store, inventory)
    yield from cache_findings(store, inventory)
    yield from stray_findings(inventory)
    yield from shard_findings(store)


def _root_layer(store: Store, description: Mapping[str, Any] | None) -> str | None:
    """Return the name of the stage's root layer: as dataset.json says, or else the first record that can be used."""
    if description:
        return str(description["stage"]["root"])
    for record in store.records():
        with suppress(InputError):
            return str(read_json(store.folder, record, "record-1")["provenance"]["stage"]["root"])
    return None


def _lost_stage(root: str | None, inventory: Inventory) -> Iterator[Finding]:
    """Find whether the whole stage, or its `root` layer, is missing."""
    if not any(name.startswith(f"{STAGE}/") for name in inventory.present):
        where, message = STAGE, "the stage is missing"
    elif root and root not in inventory.present:
        where, message = root, "the stage's root layer is missing"
    else:
        return
    inventory.missing.add(where)
    yield Finding(code="stage", where=where, message=f"{message}; {RENDER_AGAIN}")


def _answered(store: Store, stage: str | None, inventory: Inventory, progress: Progress) -> Iterator[Finding]:
    """Yield what children find on the `stage`, a root layer's name where it is looked at, and on the pictures."""
    records = list(store.records())
    stages = [] if stage is None else [stage_call(store.root / stage)]
    pictures = [picture_call(store, record) for record in records]
    children = max(1, min(len(usable_cpus()), len(pictures) // PICTURES_PER_CHILD))
    results = results_of([*stages, *pictures], children, progress=progress)
    if stage is not None:
        yield from _stage_findings(store.root / stage, next(results))
    if not records:
        yield Finding(code="empty", where=RECORDS, message="the dataset holds no picture; run spin-usd render")
    for done, (picture, result) in enumerate(zip(pictures, results, strict=True)):
        progress("checking: picture", done, len(records))
        yield from answered_findings(picture, result, inventory)
    progress("checking: picture", len(records), len(records))


def _stage_findings(root: Path, result: Any) -> Iterator[Finding]:
    try:
        yield from StageAnswer.of(result, root).findings
    except SpinError as e:
        message = f"{e.found}; {e.do}" if e.do else e.found
        yield Finding(code="stage", where=str(e.where or root), message=message)
