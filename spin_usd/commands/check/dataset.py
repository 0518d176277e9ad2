"""Findings on a dataset: links, its stage, its pictures, and stray files."""

from collections import Counter
from collections.abc import Iterator, Set
from contextlib import suppress
from pathlib import Path, PurePosixPath
from typing import Any

from spin_usd.basics.progress import Progress
from spin_usd.commands.check.calls import (
    CHECK_EVENTS,
    CHECK_PICTURE,
    CheckEvents,
    CheckPicture,
    PictureAnswer,
    StageAnswer,
)
from spin_usd.commands.check.digests import (
    EVENTS_AGAIN,
    MAKE_AGAIN,
    RENDER_AGAIN,
    provenance_findings,
    special_file_finding,
)
from spin_usd.commands.check.inventory import Inventory
from spin_usd.commands.check.stage import stage_answer, stage_task
from spin_usd.commands.check.strays import stray_findings
from spin_usd.errors import InputError, SpinError
from spin_usd.files.folder import Folder
from spin_usd.files.node import STRANGE, NodeType
from spin_usd.planning.shard import missing_in_words, missing_pictures
from spin_usd.processes.deaths import READING_TRIES, ChildDiedError
from spin_usd.processes.executor import done_in_order
from spin_usd.processes.processors import usable_cpus
from spin_usd.processes.task import Task
from spin_usd.records.descriptions import DatasetDescription
from spin_usd.scene.finding import WARNING, Finding
from spin_usd.store.cache import CACHED, MEASURED, CacheEntry, Purpose, entries
from spin_usd.store.dataset_folder import Store
from spin_usd.store.file_digests import has_list, unlisted
from spin_usd.store.names import CACHE, DESCRIPTION, EVENTS, RECORDS, SHARDS, STAGE, event_record_of, events_of
from spin_usd.store.read_documents import read_dataset_json, read_record
from spin_usd.store.stage_layers import STAGE_SUMS

PICTURES_PER_CHILD = 4  # starting one takes as long as checking so many
RESTORE = f"restore it, or move stage/ elsewhere and {RENDER_AGAIN}"


def dataset_findings(root: Path, *, progress: Progress) -> Iterator[Finding]:
    """Find all that is wrong with the dataset in the folder `root`, each once, in the order of its records."""
    told: set[Finding] = set()
    for finding in _findings(root, progress):
        if finding not in told:
            told.add(finding)
            yield finding


def _findings(root: Path, progress: Progress) -> Iterator[Finding]:
    store, nodes = Store(root=root), list(Folder(root).walk())
    yield from (special_file_finding(node) for node in nodes if node.type in STRANGE)
    present = frozenset(node.name for node in nodes if node.type is NodeType.FILE)
    inventory = Inventory(root=root, description=None, present=present)
    try:
        inventory.description = read_dataset_json(store.folder)
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


def _root_layer(store: Store, description: DatasetDescription | None) -> str | None:
    """Return the name of the stage's root layer from dataset.json, or else from the first usable record."""
    if description:
        return description.stage.root
    for record in store.records():
        with suppress(InputError):
            return read_record(store.folder, record).provenance.stage.root
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
    """Yield the children's findings on the `stage`, a root layer's name if it is checked, and on the pictures."""
    records = list(store.records())
    dataset = str(store.root)
    stages = [] if stage is None else [stage_task(store.root / stage, progress)]
    of_events = [CheckEvents(dataset=dataset, variant=variant) for variant in recorded_events(inventory)]
    of_pictures = [CheckPicture(dataset=dataset, record=record) for record in records]
    events = [Task(call=CHECK_EVENTS, request=each, tries=READING_TRIES, progress=progress) for each in of_events]
    pictures = [Task(call=CHECK_PICTURE, request=each, tries=READING_TRIES, progress=progress) for each in of_pictures]
    children = max(1, min(len(usable_cpus()), len(pictures) // PICTURES_PER_CHILD))
    tasks: list[Task[Any]] = [*stages, *events, *pictures]
    ended = done_in_order(tasks, children)
    for checked in stages:
        next(ended)
        yield from _stage_findings(Path(checked.request.stage), checked)
    for of_variant in events:
        next(ended)
        yield from event_answer(of_variant)
    if not records:
        yield Finding(code="empty", where=RECORDS, message="the dataset holds no picture; run spin-usd render")
    for done, (picture, _) in enumerate(zip(pictures, ended, strict=True)):
        progress("checking: picture", done, len(records))
        yield from answered_findings(picture, inventory)
    progress("checking: picture", len(records), len(records))


def _stage_findings(root: Path, task: Task[StageAnswer]) -> Iterator[Finding]:
    try:
        yield from stage_answer(task, root).findings
    except SpinError as e:
        message = f"{e.found}; {e.do}" if e.do else e.found
        yield Finding(code="stage", where=str(e.where or root), message=message)


def recorded_events(inventory: Inventory) -> list[str]:
    """Return the variants whose events have a record, in alphabetic order."""
    stems = ((name, PurePosixPath(name).stem) for name in sorted(inventory.present))
    return [stem for name, stem in stems if name == event_record_of(stem)]


def event_answer(task: Task[list[Finding]]) -> Iterator[Finding]:
    """Yield the findings on a variant's events. Events that kill a child have one; another SpinError is raised."""
    if isinstance(task.failure, ChildDiedError):
        message = f"cannot be checked: {task.failure.found}; {EVENTS_AGAIN}"
        yield Finding(code="unreadable", where=events_of(task.request.variant), message=message)
    else:
        yield from task.result


def shard_findings(store: Store) -> Iterator[Finding]:
    """Yield a warning for each shard whose pictures are not all there."""
    for shard, count in Counter(map(str, missing_pictures(store).values())).items():
        yield Finding(code="shards", where=SHARDS, message=missing_in_words(count, shard), severity=WARNING)


def sums_findings(store: Store, inventory: Inventory) -> Iterator[Finding]:
    """Find whether the list is damaged or lost, and which files, of those in no record, differ from it."""
    if STAGE in inventory.missing or store.folder.in_the_way(STAGE_SUMS):
        return
    wrong = {path.relative_to(store.root).as_posix() for path in unlisted(store.stage)}
    vouched = wrong & {name for (name, _), whole in inventory.layers.items() if whole}
    told = {name for (name, _), whole in inventory.layers.items() if not whole} - vouched
    listing = has_list(store.stage)
    if vouched or not listing:
        do = MAKE_AGAIN if wrong == vouched else RENDER_AGAIN
        yield Finding(code="sums", where=STAGE_SUMS, message=f"does not match the files of stage/; {do}")
    for name in sorted(wrong - vouched - told) if listing else ():
        yield Finding(code="sums", where=name, message=f"is not as {STAGE_SUMS} lists it; {RESTORE}")


def cache_findings(store: Store, inventory: Inventory) -> Iterator[Finding]:
    """Yield a finding on each file of the cache that is damaged, that no picture uses, or that is not the cache's."""
    known = {entry.file.name: entry for entry in entries(store)}
    in_use = inventory.uses if not inventory.unread else {entry.purpose for entry in known.values()}  # unknown
    for name in store.folder.files(CACHE):
        message = _wrong(known[name], inventory, in_use) if name in known else _foreign(name)
        if message:
            yield Finding(code="cache", where=name, message=message, severity=WARNING)


def _wrong(entry: CacheEntry, inventory: Inventory, in_use: Set[Purpose]) -> str | None:
    used, inode = entry.purpose in in_use, entry.file.folder.inode(entry.file.name)
    if inode not in inventory.inodes and not entry.whole:  # a label's file was verified already
        return f"is damaged; {MAKE_AGAIN}" if used else "is damaged, and no picture uses it; remove it"
    return None if used else "no picture uses it; the next full render that makes a picture removes it"


def _foreign(name: str) -> str | None:
    if name == MEASURED:
        return None
    if name.startswith(f"{CACHE}/{EVENTS}/"):
        return "is of events that are not whole; run spin-usd render again with --events, or remove it"
    return f"is not part of the cache, which contains {', '.join(CACHED)}"


def answered_findings(task: Task[PictureAnswer], inventory: Inventory) -> Iterator[Finding]:
    """Yield all that is wrong with a picture, and add the files that its record lists to the inventory.

    A picture that kills a child has a finding; any other SpinError is raised.
    """
    where = task.request.record
    if isinstance(task.failure, ChildDiedError):
        inventory.unread.add(where)
        message = f"cannot be checked: {task.failure.found}; {MAKE_AGAIN}"
        yield Finding(code="unreadable", where=where, message=message)
        return
    found = task.result
    yield from found.findings
    if listed := found.listed:
        inventory.add(listed.files, listed.uses)
        yield from provenance_findings(where, listed.variant, listed.stage, inventory)
    else:
        inventory.unread.add(where)
