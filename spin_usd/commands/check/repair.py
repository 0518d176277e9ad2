"""`spin-usd check --repair`: makes again what is missing or damaged in a dataset, from its own stage."""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from spin_usd.basics.progress import Note, Progress, no_note
from spin_usd.commands.check.damage import altered_layer, damaged_pictures, listed_again, obstacle
from spin_usd.commands.check.dataset import dataset_findings
from spin_usd.commands.check.recorded_requests import of_variants, requests, valid_records
from spin_usd.commands.check.report import CheckReport
from spin_usd.commands.render.report import RenderReport
from spin_usd.commands.render.run import render_dataset
from spin_usd.errors import InputError, SpinError
from spin_usd.files.changes import remove_file, write_bytes
from spin_usd.files.folder import Folder
from spin_usd.files.node import Node, NodeType
from spin_usd.files.size_limits import MAX_DOCUMENT
from spin_usd.options import RunOptions
from spin_usd.planning.request import RenderRequest
from spin_usd.records.record import Record
from spin_usd.scene.finding import ERROR
from spin_usd.store.dataset_folder import LOCK, OWN, Store, special_file_error
from spin_usd.store.names import DESCRIPTION, EVENTS, STAGE, record_of
from spin_usd.store.read_documents import read_dataset_json, read_record
from spin_usd.store.stage_layers import STAGE_SUMS

OTHER_BYTES = ", with other bytes than it had: the software or the stage is another now"


def repair(root: Path, *, progress: Progress, note: Note = no_note) -> CheckReport:
    """Make again what is missing or damaged in the dataset `root`, and check it then.

    Renders each damaged picture by its record, or if that is lost like most others. Files that are not the dataset's
    stay unchanged, and so do links, with the pictures whose files they replace, and events, which a render makes
    together. Raises InputError if there is no dataset, or another run is writing it.
    """
    store = Store(root=root.absolute())
    if not store.is_dataset():
        raise InputError("is not a dataset, which --repair needs", where=root, do="give a dataset's folder")
    with store.locked():
        pass  # remains of a killed run are gone now
    repairing = _Repair(store, progress, note)
    repairing.run()
    findings = list(dataset_findings(store.root, progress=progress))
    lost = [each for each in findings if each.where.startswith(f"{EVENTS}/") and each.severity == ERROR]
    made, failed = repairing.repaired, [*repairing.unrepaired, *(f"{each.where}: {each.message}" for each in lost)]
    return CheckReport(kind="dataset", findings=findings, repaired=made, unrepaired=failed)


class _Repair:
    """The repair of one dataset.

    Attributes:
        records: Records that were valid before.
        special: Links and the like in place of its files.
        repaired: As in the report.
        unrepaired: As in the report.
    """

    def __init__(self, store: Store, progress: Progress, note: Note) -> None:
        self.store, self.progress, self.note = store, progress, note
        self.records = valid_records(store)
        self.special = list(store.folder.special_files(OWN))
        self.repaired: list[str] = []
        self.unrepaired: list[str] = []

    def run(self) -> None:
        """Repair what the rest needs first."""
        self._try(DESCRIPTION, self._description)
        self._pictures()
        if not any(node.name.partition("/")[0] == STAGE for node in self.special):
            self._try(STAGE_SUMS, partial(listed_again, self.store, self.records))

    def _try(self, what: str, fix: Callable[[], Iterator[str]]) -> None:
        """Report the results of `fix`, or why it failed."""
        try:
            self.repaired.extend(fix())
        except SpinError as e:
            self.unrepaired.append(f"{what}: {e}")

    def _description(self) -> Iterator[str]:
        """Write dataset.json again if it is missing or damaged: its contents are all in the stage and the records."""
        try:
            read_dataset_json(self.store.folder)
        except InputError:
            self._refuse_unsure()
            variants = tuple(dict.fromkeys(record.variant for record in self.records.values()))
            with removed(self.store.folder, DESCRIPTION):
                for request in requests(self._root, self.records, self.records):
                    self._render(of_variants(request, variants), frozenset())
            yield DESCRIPTION

    def _refuse_unsure(self) -> None:
        """Raise InputError where a link is in the way, or it is not sure that the folder is a dataset's alone."""
        for node in self.special:
            if node.name.partition("/")[0] in (DESCRIPTION, STAGE):
                raise special_file_error(self.store.folder, node)
        others = sorted(set(self.store.contents()) - {*OWN, LOCK})
        if others:
            raise InputError(f"cannot be written again beside {others[0]}", do="move that elsewhere")
        if not self.records:
            do = "run spin-usd render again with the stage that made the pictures"
            raise InputError("cannot be written again without records", do=do)

    @property
    def _root(self) -> Path:
        """The root layer of the dataset's own stage, as most records name it."""
        named = Counter[str](record.provenance.stage.root for record in self.records.values())
        return self.store.root / named.most_common(1)[0][0]

    def _render(self, request: RenderRequest, only: frozenset[str]) -> RenderReport:
        return render_dataset(request, self.store.root, RunOptions(), only=only, progress=self.progress, note=self.note)

    def _pictures(self) -> None:
        """Make damaged and lost pictures again."""
        findings = list(dataset_findings(self.store.root, progress=self.progress))
        names = self._reached(damaged_pictures(self.store, findings, self.records))
        if names and not self.records:
            do = "run spin-usd render again with the stage that made them"
            self.unrepaired.append(f"{', '.join(sorted(names))}: no record states how pictures were made; {do}")
        elif names and (altered := altered_layer(self.store, self.records)):
            do = "restore it, or run spin-usd render again with the stage that made them"
            self.unrepaired.append(f"{', '.join(sorted(names))}: {altered} is not the layer that made them; {do}")
        elif names:
            for request, group in requests(self._root, sorted(names), self.records).items():
                self._try(", ".join(sorted(group)), partial(self._made, request, group))

    def _reached(self, names: set[str]) -> set[str]:
        """Return the pictures whose files can be replaced, and report the obstacles of the others."""
        left = defaultdict[Node, list[str]](list)
        for name in sorted(names):
            if node := obstacle(name, self.special):
                left[node].append(name)
        for node, pictures in left.items():
            self.unrepaired.append(f"{', '.join(pictures)}: {special_file_error(self.store.folder, node)}")
        return names - {name for pictures in left.values() for name in pictures}

    def _made(self, request: RenderRequest, names: set[str]) -> Iterator[str]:
        """Make the pictures of these names; yield those that exist then."""
        variants = tuple(sorted({name.partition("/")[0] for name in names}))
        report = self._render(of_variants(request, variants), frozenset(names))
        failed = {each.picture: each.reason for each in report.failed}
        self.unrepaired.extend(f"{name}: {reason}" for name, reason in failed.items())
        for name in sorted(names - failed.keys()):
            variant, _, frame = name.partition("/")
            record = record_of(variant, frame)
            # A stray file need not be of a frame that the stage has.
            if self.store.folder.type_of(record) is NodeType.FILE:
                before = _digests(self.records.get(name))
                after = _digests(read_record(self.store.folder, record))
                yield name + (OTHER_BYTES if before and before != after else "")


def _digests(record: Record | None) -> dict[str, str]:
    return {kind: file.sha256 for kind, file in record.files.items()} if record else {}


@contextmanager
def removed(folder: Folder, name: str) -> Iterator[None]:
    """Remove the file `name`, if it exists, for the block to make it again; if that fails, it is restored. Raises
    InputError if it is not a file, and OutputError."""
    before = folder.read(name, MAX_DOCUMENT) if folder.type_of(name) else None
    remove_file(folder, name)
    try:
        yield
    except BaseException:
        if before is not None and folder.type_of(name) is None:
            write_bytes(folder, name, before)
        raise
