"""Findings on a dataset: links, its stage, its pictures, and stray files."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from spin_usd.dataset.check.cache import cache_findings
from spin_usd.dataset.check.inventory import Inventory
from spin_usd.dataset.check.pictures import answered_findings, picture_call
from spin_usd.dataset.check.provenance import RENDER_AGAIN
from spin_usd.dataset.check.stage import StageAnswer, stage_call
from spin_usd.dataset.picture.make_picture import KINDS
from spin_usd.dataset.process.processors import usable_cpus
from spin_usd.dataset.process.shared_calls import results_of
from spin_usd.dataset.store.dataset_folder import LOCK, OWN, Store
from spin_usd.dataset.store.json_schema import read_json
from spin_usd.dataset.store.names import DESCRIPTION, RECORDS, STAGE
from spin_usd.errors import InputError, SpinError
from spin_usd.files.folder import Folder
from spin_usd.files.node import STRANGE, Node, NodeType
from spin_usd.progress import Progress
from spin_usd.scene.finding import ERROR, WARNING, Finding

PICTURES_PER_CHILD = 4  # starting one takes as long as checking so many


def dataset_findings(root: Path, *, progress: Progress) -> Iterator[Finding]:
    """Find all that is wrong with the dataset in the folder `root`, in the order of its records."""
    store, nodes = Store(root=root), list(Folder(root).walk())
    yield from map(_strange, (node for node in nodes if node.type in STRANGE))
    present = frozenset(node.name for node in nodes if node.type is NodeType.FILE)
    try:
        description = read_json(store.folder, DESCRIPTION, "dataset-1")
    except InputError as e:
        yield Finding(code="description", where=DESCRIPTION, message=f"{e.found}; {e.do}")
        return
    inventory = Inventory(root=root, description=description, present=present)
    own_stage = not any(node.type in STRANGE and node.name.startswith(f"{STAGE}/") for node in nodes)
    yield from _answered(store, description["stage"]["root"] if own_stage else None, inventory, progress)
    yield from cache_findings(store, inventory)
    yield from _strays(inventory)


def _answered(store: Store, stage: str | None, inventory: Inventory, progress: Progress) -> Iterator[Finding]:
    """Yield what children find on the `stage`, a root layer's name where it is looked at, and on the pictures."""
    if stage is not None and stage not in inventory.present:
        yield Finding(code="stage", where=stage, message=f"the stage's root layer is missing; {RENDER_AGAIN}")
        stage = None
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


def _strange(node: Node) -> Finding:
    """Return a finding on a node that is neither file nor folder: a render refuses it where the dataset's own should
    be."""
    severity = ERROR if node.name.partition("/")[0] in (*OWN, LOCK) else WARNING
    message = f"is a {node.type}, and those are not followed; put what it stands for in its place, or remove it"
    code = "link" if node.type is NodeType.LINK else "special"
    return Finding(code=code, where=node.name, message=message, severity=severity)


def _strays(inventory: Inventory) -> Iterator[Finding]:
    """Find files among the pictures that no record lists. Outside the kinds' own folders all else is the user's."""
    for name in sorted(inventory.present - inventory.files):
        if name.partition("/")[0] in KINDS:
            message = "is not in any record; move it elsewhere, or remove it"
            yield Finding(code="stray", where=name, message=message, severity=WARNING)
