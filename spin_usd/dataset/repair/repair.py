"""`spin-usd check --repair`: makes again what is missing or damaged in a dataset, from its own stage."""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from spin_usd.dataset.check.check import CheckReport
from spin_usd.dataset.check.dataset import dataset_findings
from spin_usd.dataset.render.render import render
from spin_usd.dataset.render.report import RenderReport
from spin_usd.dataset.render.request import RenderRequest
from spin_usd.dataset.repair.damage import damaged_pictures, obstacle, valid_records
from spin_usd.dataset.repair.recorded_request import requests
from spin_usd.dataset.repair.removed import removed
from spin_usd.dataset.repair.stage_files import altered_layer, listed_again
from spin_usd.dataset.store.dataset_folder import LOCK, OWN, Store, strange_error
from spin_usd.dataset.store.json_schema import read_json
from spin_usd.dataset.store.names import DESCRIPTION, STAGE, record_of
from spin_usd.dataset.store.stage_layers import STAGE_SUMS
from spin_usd.errors import InputError, SpinError
from spin_usd.files.node import Node, NodeType
from spin_usd.progress import Note, Progress, unsaid

OTHER_BYTES = ", with other bytes than it had: the software or the stage is another now"


@dataclass(frozen=True, kw_only=True)
class RepairReport(CheckReport):
    """The findings after a repair. repaired: what was made again · unrepaired: what could not be, and why."""

    repaired: list[str] = field(default_factory=list)
    unrepaired: list[str] = field(default_factory=list)

    def as_json(self) -> dict[str, Any]:
        return super().as_json() | {"repaired": self.repaired, "unrepaired": self.unrepaired}


def repair(root: Path, *, progress: Progress, note: Note = unsaid) -> RepairReport:
    """Make again what is missing or damaged in the dataset `root`, and check it then.

    Renders each damaged picture as its record says, and where that is lost as most others were. What is not the
    dataset's own stays as it is, and so do links, with the pictures whose files they stand for. Raises InputError where
    there is no dataset, or another run is writing it.
    """
    store = Store(root=root.absolute())
    if not store.is_dataset():
        raise InputError("is not a dataset, and --repair is for those", where=root, do="give a dataset's folder")
    with store.locked():
        pass  # what a killed run left is gone now
    repairing = _Repair(store, progress, note)
    repairing.run()
    findings = list(dataset_findings(store.root, progress=progress))
    made, failed = repairing.repaired, repairing.unrepaired
    return RepairReport(kind="dataset", findings=findings, repaired=made, unrepaired=failed)


class _Repair:
    """The repair of one dataset. records: those that were valid before · strange: links and the like in its own places
    · repaired, unrepaired: as in the report."""

    def __init__(self, store: Store, progress: Progress, note: Note) -> None:
        self.store, self.progress, self.note = store, progress, note
        self.records = valid_records(store)
        self.strange = list(store.folder.strange(OWN))
        self.repaired: list[str] = []
        self.unrepaired: list[str] = []

    def run(self) -> None:
        """Repair what the rest needs first."""
        self._try(DESCRIPTION, self._description)
        self._pictures()
        if not any(node.name.partition("/")[0] == STAGE for node in self.strange):
            self._try(STAGE_SUMS, partial(listed_again, self.store, self.records))

    def _try(self, what: str, fix: Callable[[], Iterator[str]]) -> None:
        """Put down what `fix` yields, or why it failed."""
        try:
            self.repaired.extend(fix())
        except SpinError as e:
            self.unrepaired.append(f"{what}: {e}")

    def _description(self) -> Iterator[str]:
        """Write dataset.json again where it is missing or damaged: all that it says is in the stage and the records."""
        try:
            read_json(self.store.folder, DESCRIPTION, "dataset-1")
        except InputError:
            self._refuse_unsure()
            variants = tuple(dict.fromkeys(record["variant"] for record in self.records.values()))
            with removed(self.store.folder, DESCRIPTION):
                for request in requests(self._root, self.records, self.records):
                    self._render(replace(request, variants=variants), frozenset())
            yield DESCRIPTION

    def _refuse_unsure(self) -> None:
        """Raise InputError where a link is in the way, or it is not sure that the folder is a dataset's alone."""
        for node in self.strange:
            if node.name.partition("/")[0] in (DESCRIPTION, STAGE):
                raise strange_error(self.store.folder, node)
        strange = sorted(set(self.store.held()) - {*OWN, LOCK})
        if strange:
            raise InputError(f"cannot be written again beside {strange[0]}", do="move that elsewhere")
        if not self.records:
            do = "run spin-usd render again with the stage that made the pictures"
            raise InputError("cannot be written again without records", do=do)

    @property
    def _root(self) -> Path:
        """The root layer of the dataset's own stage, as most records name it."""
        named = Counter[str](record["provenance"]["stage"]["root"] for record in self.records.values())
        return self.store.root / named.most_common(1)[0][0]

    def _render(self, request: RenderRequest, only: frozenset[str]) -> RenderReport:
        return render(request, self.store.root, only=only, progress=self.progress, note=self.note)

    def _pictures(self) -> None:
        """Make damaged and lost pictures again."""
        findings = list(dataset_findings(self.store.root, progress=self.progress))
        names = self._reached(damaged_pictures(self.store, findings, self.records))
        if names and not self.records:
            do = "run spin-usd render again with the stage that made them"
            self.unrepaired.append(f"{', '.join(sorted(names))}: no record says how pictures were made; {do}")
        elif names and (altered := altered_layer(self.store, self.records)):
            do = "restore it, or run spin-usd render again with the stage that made them"
            self.unrepaired.append(f"{', '.join(sorted(names))}: {altered} is not the layer that made them; {do}")
        elif names:
            for request, group in requests(self._root, sorted(names), self.records).items():
                self._try(", ".join(sorted(group)), partial(self._made, request, group))

    def _reached(self, names: set[str]) -> set[str]:
        """Return those of the pictures whose files can be replaced, and put down what is in the way of the others."""
        left = defaultdict[Node, list[str]](list)
        for name in sorted(names):
            if node := obstacle(name, self.strange):
                left[node].append(name)
        for node, pictures in left.items():
            self.unrepaired.append(f"{', '.join(pictures)}: {strange_error(self.store.folder, node)}")
        return names - {name for pictures in left.values() for name in pictures}

    def _made(self, request: RenderRequest, names: set[str]) -> Iterator[str]:
        """Make the pictures of these names; yield those that are there then."""
        variants = tuple(sorted({name.partition("/")[0] for name in names}))
        failed = dict(self._render(replace(request, variants=variants), frozenset(names)).failed)
        self.unrepaired.extend(f"{name}: {reason}" for name, reason in failed.items())
        for name in sorted(names - failed.keys()):
            variant, _, frame = name.partition("/")
            record = record_of(variant, frame)
            # A stray file need not be of a frame that the stage has.
            if self.store.folder.type_of(record) is NodeType.FILE:
                before = _digests(self.records.get(name))
                after = _digests(read_json(self.store.folder, record, "record-1"))
                yield name + (OTHER_BYTES if before and before != after else "")


def _digests(record: Mapping[str, Any] | None) -> dict[str, str]:
    return {kind: entry["sha256"] for kind, entry in record["files"].items()} if record else {}
