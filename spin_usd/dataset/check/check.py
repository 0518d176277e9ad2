"""Findings on a stage or a dataset."""

from collections.abc import Iterator, Set
from dataclasses import dataclass
from pathlib import Path

from spin_usd.dataset.check.cache import cache_findings
from spin_usd.dataset.check.checked_picture import Inventory
from spin_usd.dataset.check.pictures import picture_findings
from spin_usd.dataset.check.provenance import RENDER_AGAIN
from spin_usd.dataset.picture.make_picture import KINDS
from spin_usd.dataset.process.child import Child, ChildDiedError
from spin_usd.dataset.store.dataset_folder import LOCK, OWN, Store
from spin_usd.dataset.store.json_schema import read_json
from spin_usd.dataset.store.names import DESCRIPTION, RECORDS, STAGE
from spin_usd.dataset.store.stage_path import root_layer
from spin_usd.dataset.store.tree import STRANGE, Node, NodeType, file_at, type_of, walk
from spin_usd.errors import InputError, SpinError
from spin_usd.progress import Progress
from spin_usd.scene.derived.views import Views
from spin_usd.scene.finding import ERROR, WARNING, Finding


@dataclass(frozen=True, kw_only=True)
class CheckReport:
    """The findings of a check.

    kind: "stage" or "dataset" · findings: what is wrong with it · views: what a stage's own pictures show, where they
    can be read.
    """

    kind: str
    findings: list[Finding]
    views: Views | None = None


def check(path: Path, *, progress: Progress) -> CheckReport:
    """Check the stage or dataset at `path`. Raises InputError when it is neither."""
    if type_of(path / DESCRIPTION) not in (None, NodeType.FOLDER):
        return CheckReport(kind="dataset", findings=list(dataset_findings(path.absolute(), progress=progress)))
    root = root_layer(path)
    if root.is_file() and root.suffix.lower().startswith(".usd"):
        return check_stage(root, progress=progress)
    if not path.exists():
        raise InputError("does not exist", where=path, do="check the path")
    do = "give a stage's root layer, the folder of its dataset.usda, or a dataset's folder"
    raise InputError("is neither a stage nor a dataset", where=path, do=do)


def check_stage(root: Path, *, progress: Progress) -> CheckReport:
    """Check the stage whose root layer is `root`."""
    try:
        with Child() as child:
            found = child.call("check_stage", stage=str(root.absolute()), progress=progress)
    except ChildDiedError as died:
        unreadable = Finding(code="unreadable", where=str(root), message=f"cannot be read: {died.found}")
        return CheckReport(kind="stage", findings=[unreadable])
    views = Views.from_json(found["views"]) if found["views"] else None
    return CheckReport(kind="stage", findings=[Finding(**finding) for finding in found["findings"]], views=views)


def dataset_findings(root: Path, *, progress: Progress) -> Iterator[Finding]:
    """Find all that is wrong with the dataset in the folder `root`: links, its stage, its pictures, and stray files."""
    store = Store(root=root)
    nodes = list(walk(root))
    yield from map(_strange, (node for node in nodes if node.type in STRANGE))
    present = frozenset(node.name for node in nodes if node.type is NodeType.FILE)
    try:
        description = read_json(file_at(root, DESCRIPTION), "dataset-1")
    except InputError as e:
        yield Finding(code="description", where=DESCRIPTION, message=f"{e.found}; {e.do}")
        return
    if not any(node.type in STRANGE and node.name.startswith(f"{STAGE}/") for node in nodes):
        yield from _stage_of(store, description["stage"]["root"], present, progress)
    records = list(store.records())
    if not records:
        yield Finding(code="empty", where=RECORDS, message="the dataset holds no picture; run spin-usd render")
    inventory = Inventory(description=description, present=present)
    for done, path in enumerate(records):
        progress("checking: picture", done, len(records))
        yield from picture_findings(store, path, inventory)
    progress("checking: picture", len(records), len(records))
    yield from cache_findings(store, inventory)
    yield from _strays(inventory)


def _strange(node: Node) -> Finding:
    """Return a finding on a node that is neither file nor folder: a render refuses it where the dataset's own should
    be."""
    severity = ERROR if node.name.partition("/")[0] in (*OWN, LOCK) else WARNING
    message = f"is a {node.type}, and those are not followed; put what it stands for in its place, or remove it"
    return Finding(
        code="link" if node.type is NodeType.LINK else "special", where=node.name, message=message, severity=severity
    )


def _stage_of(store: Store, root: str, present: Set[str], progress: Progress) -> Iterator[Finding]:
    if root not in present:
        yield Finding(code="stage", where=root, message=f"the stage's root layer is missing; {RENDER_AGAIN}")
        return
    try:
        yield from check_stage(store.root / root, progress=progress).findings
    except SpinError as e:
        message = f"{e.found}; {e.do}" if e.do else e.found
        yield Finding(code="stage", where=str(e.where or root), message=message)


def _strays(inventory: Inventory) -> Iterator[Finding]:
    """Find files among the pictures that no record lists. Outside the kinds' own folders all else is the user's."""
    for name in sorted(inventory.present - inventory.files):
        if name.partition("/")[0] in KINDS:
            message = "is not in any record; move it elsewhere, or remove it"
            yield Finding(code="stray", where=name, message=message, severity=WARNING)
