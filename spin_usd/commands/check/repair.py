"""`spin-usd check --repair`: makes again what is missing or damaged in a dataset, from its own stage."""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path, PurePosixPath

from msgspec import UNSET

from spin_usd.commands.check.dataset import dataset_findings
from spin_usd.commands.check.digests import RENDER_AGAIN
from spin_usd.commands.check.report import CheckReport
from spin_usd.commands.check.strays import STRAY
from spin_usd.commands.render.report import RenderReport
from spin_usd.commands.render.run import render_dataset
from spin_usd.errors import InputError, SpinError
from spin_usd.files.changes import remove_file, write_bytes
from spin_usd.files.folder import Folder
from spin_usd.files.node import Node, NodeType
from spin_usd.files.size_limits import MAX_DOCUMENT
from spin_usd.labels.table import LABELS
from spin_usd.options import PictureOptions, RunOptions
from spin_usd.picture.kinds import IMAGE, KINDS, RADIANCE
from spin_usd.planning.effort_choice import Basis, Chosen
from spin_usd.planning.request import RenderRequest
from spin_usd.progress import Note, Progress, no_note
from spin_usd.records.record import EffortChoice, Record
from spin_usd.scene.finding import ERROR, Finding
from spin_usd.store.atomic import write_text
from spin_usd.store.cache import Purpose, entries, uses
from spin_usd.store.dataset_folder import LOCK, OWN, Store, special_file_error
from spin_usd.store.file_digests import has_list, sums, unlisted
from spin_usd.store.names import CACHE, DESCRIPTION, RECORDS, STAGE, picture_of, record_of
from spin_usd.store.read_documents import read_dataset_json, read_record
from spin_usd.store.stage_layers import STAGE_SUMS

OTHER_BYTES = ", with other bytes than it had: the software or the stage is another now"
Records = Mapping[str, Record]
"""Valid records by their pictures' names, "variant/frame"."""


def repair(root: Path, *, progress: Progress, note: Note = no_note) -> CheckReport:
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
    return CheckReport(kind="dataset", findings=findings, repaired=made, unrepaired=failed)


class _Repair:
    """The repair of one dataset.

    Attributes:
        records: Those that were valid before.
        special: Links and the like in its own places.
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
        """Put down what `fix` yields, or why it failed."""
        try:
            self.repaired.extend(fix())
        except SpinError as e:
            self.unrepaired.append(f"{what}: {e}")

    def _description(self) -> Iterator[str]:
        """Write dataset.json again where it is missing or damaged: all that it says is in the stage and the records."""
        try:
            read_dataset_json(self.store.folder)
        except InputError:
            self._refuse_unsure()
            variants = tuple(dict.fromkeys(record.variant for record in self.records.values()))
            with removed(self.store.folder, DESCRIPTION):
                for request in requests(self._root, self.records, self.records):
                    self._render(_of_variants(request, variants), frozenset())
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
            if node := obstacle(name, self.special):
                left[node].append(name)
        for node, pictures in left.items():
            self.unrepaired.append(f"{', '.join(pictures)}: {special_file_error(self.store.folder, node)}")
        return names - {name for pictures in left.values() for name in pictures}

    def _made(self, request: RenderRequest, names: set[str]) -> Iterator[str]:
        """Make the pictures of these names; yield those that are there then."""
        variants = tuple(sorted({name.partition("/")[0] for name in names}))
        report = self._render(_of_variants(request, variants), frozenset(names))
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
    """Remove the file `name`, if there is one, for the block to make it again; where that fails it comes back. Raises
    InputError where it is not a file, and OutputError."""
    before = folder.read(name, MAX_DOCUMENT) if folder.type_of(name) else None
    remove_file(folder, name)
    try:
        yield
    except BaseException:
        if before is not None and folder.type_of(name) is None:
            write_bytes(folder, name, before)
        raise


def altered_layer(store: Store, records: Records) -> str | None:
    """Return the name of a layer that no record knows as it is; None where there is none. Pictures made of it would be
    others, and their new records would vouch for it."""
    known, folder = _known(records), store.folder
    there = {name for name in known if folder.type_of(name) is NodeType.FILE}
    return next((name for name in sorted(known) if name not in there or folder.sha256(name) not in known[name]), None)


def listed_again(store: Store, records: Records) -> Iterator[str]:
    """Write SHA256SUMS again where it is lost or damaged, and yield its name. Raises InputError, which leaves the
    list's name to who calls, where no record says of a file that the list lacks that this is as it was."""
    known, folder = _known(records), store.folder
    if folder.type_of(STAGE) is not NodeType.FOLDER:
        return
    names = [path.relative_to(store.root).as_posix() for path in unlisted(store.stage)]
    unsure = [name for name in names if folder.sha256(name) not in known[name]]
    if has_list(store.stage) and unsure == names:  # the files are wrong, if any
        return
    if unsure:
        found = f"cannot be written again: no record says that {unsure[0]} is as it was"
        raise InputError(found, do=RENDER_AGAIN)
    with store.locked() as lease:
        write_text(folder, STAGE_SUMS, sums(store.stage), work=lease.work)
    yield STAGE_SUMS


def _known(records: Records) -> defaultdict[str, set[str]]:
    """Return the digests that each layer had when pictures were made of it."""
    known = defaultdict[str, set[str]](set)
    for record in records.values():
        for name, sha256 in record.provenance.stage.layers:
            known[name].add(sha256)
    return known


def requests(stage: Path, names: Iterable[str], records: Records) -> dict[RenderRequest, set[str]]:
    """Return the pictures of these names by the request that makes them as they were: what their own record says, and
    where that is lost, what most records of their variant say, or most of all. None where there is no record."""
    recorded = {name: _request(stage, record) for name, record in records.items()}
    by_variant = defaultdict[str, Counter[RenderRequest]](Counter)
    for name, request in recorded.items():
        by_variant[_variant(name)][request] += 1
    of_all = sum(by_variant.values(), Counter[RenderRequest]())
    found = defaultdict[RenderRequest, set[str]](set)
    for name in names if of_all else ():
        usual = by_variant.get(_variant(name)) or of_all
        found[recorded.get(name) or usual.most_common(1)[0][0]].add(name)
    return dict(found)


def _of_variants(request: RenderRequest, variants: tuple[str, ...]) -> RenderRequest:
    return replace(request, options=replace(request.options, variants=variants))


def _variant(name: str) -> str:
    return name.partition("/")[0]


def _request(stage: Path, record: Record) -> RenderRequest:
    """Return the request for all pictures that were made as this one; it names no variant and no frame."""
    kinds, settings, chosen = record.files, record.settings, record.provenance.render.chosen
    options = PictureOptions(
        stage,
        seed=settings.seed,
        renderer=settings.renderer,
        device=settings.device,
        labels=tuple(kind for kind in LABELS if kind in kinds) or "none",
        labels_only=IMAGE not in kinds,
        radiance=RADIANCE in kinds,
        **record.options,
    )
    return RenderRequest(options=options, effort=settings.effort, chosen=None if chosen is UNSET else _chosen(chosen))


def _chosen(recorded: EffortChoice) -> Chosen:
    """Make the reason of an effort again; what was expected of it is not recorded."""
    measured = recorded.measurement
    basis = None if measured is UNSET else Basis(sha256=measured, variant="", stage="")
    return Chosen(by=recorded.by, asked=recorded.asked, reason=recorded.reason, basis=basis)


def valid_records(store: Store) -> Records:
    """Read the dataset's records, but those that are damaged."""
    found: dict[str, Record] = {}
    for name in store.records():
        with suppress(InputError):
            frame, variant = picture_of(name)
            found[f"{variant}/{frame}"] = read_record(store.folder, name)
    return found


def damaged_pictures(store: Store, findings: Iterable[Finding], records: Records) -> set[str]:
    """Return the names of pictures that something is wrong with: of their record, of a file, or of what they use of the
    cache; and of those whose files no record lists."""
    listed = list(findings)
    wrong = (finding.where for finding in listed if finding.severity == ERROR or finding.code == STRAY)
    found = {name for where in wrong for name in _of_file(where)}
    damaged = {finding.where for finding in listed if finding.where.startswith(f"{CACHE}/")}
    return found | set(_users(store, damaged, records))


def obstacle(name: str, strange: Iterable[Node]) -> Node | None:
    """Return what keeps the picture of that name from being made again: a link or the like in place of one of its own
    files, of a folder of the dataset, or in the stage. None where nothing does."""
    return next((node for node in strange if _is_shared(node.name) or name in _of_file(node.name)), None)


def _is_shared(name: str) -> bool:
    """Return whether what has that name serves many pictures: a file of one alone lies below two folders, and in the
    cache below three."""
    first, depth = name.partition("/")[0], name.count("/")
    return first == STAGE or depth < (3 if first == CACHE else 2)


def _of_file(name: str) -> Iterator[str]:
    """Yield the picture that has this file, where one of a dataset's pictures could have it."""
    match PurePosixPath(name).parts:
        case [kind, variant, file] if kind in (*KINDS, RECORDS):
            yield f"{variant}/{PurePosixPath(file).stem}"


def _users(store: Store, damaged: set[str], records: Records) -> Iterator[str]:
    """Yield one picture for each damaged file of the cache that some picture uses: that makes it again."""
    user: dict[Purpose, str] = {purpose: name for name, record in records.items() for purpose in uses(record)}
    for entry in entries(store):
        if entry.file.name in damaged and entry.purpose in user and not entry.whole:
            yield user[entry.purpose]
