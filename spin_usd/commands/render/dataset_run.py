"""One run of `render` in a folder that it holds: plan, put the stage there, find what is left, and have it made."""

import shlex
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import fields
from dataclasses import replace as changed
from functools import partial
from pathlib import Path
from typing import Any

from msgspec import to_builtins

from spin_usd.commands.render import orphans, same_stage
from spin_usd.commands.render.destination import Destination
from spin_usd.commands.render.report import RenderReport, RunListener
from spin_usd.commands.render.request import common_work, plan, wanted_kinds
from spin_usd.commands.render.same_stage import differences
from spin_usd.commands.render.task_queue import RenderTask
from spin_usd.commands.render.worker_options import WorkerOptions
from spin_usd.commands.render.workers import WorkerProcesses, default_workers, make_pictures
from spin_usd.errors import OutputError
from spin_usd.files.changes import put
from spin_usd.files.folder import Folder
from spin_usd.labels.table import LABELS
from spin_usd.options import MAX_WORKERS, EffortOptions, PictureOptions, RunOptions, flag_of
from spin_usd.picture.brightness import faults
from spin_usd.picture.kinds import IMAGE, IMAGE_MEANING, KINDS, RADIANCE, RADIANCE_CHANNELS, RENDERED
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.planning.cost import read_measured, write_measured
from spin_usd.planning.effort_choice import doubts
from spin_usd.planning.make_plan import Plan
from spin_usd.planning.request import RenderRequest
from spin_usd.planning.shard import Manifest, Shard, write_manifest
from spin_usd.planning.time_limit import GRAPHICS_S, MIN_S, TimeLimits
from spin_usd.planning.variant_table import variant_table
from spin_usd.planning.wall_time import one_core
from spin_usd.pluralise import duration, pluralise
from spin_usd.processes.child import in_process
from spin_usd.processes.devices import AUTO
from spin_usd.processes.open_renderer import ANOTHER_RENDERER, require_renderer
from spin_usd.processes.processors import usable_cpus
from spin_usd.progress import Note, Progress
from spin_usd.records.descriptions import DatasetDescription, StageEntry
from spin_usd.records.record import Record, StageProvenance
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.derived.part_classes import class_ids
from spin_usd.scene.effort import CPU
from spin_usd.stop_signals import postponed
from spin_usd.store.atomic import force_folder, write_json
from spin_usd.store.cache import MEASURED
from spin_usd.store.dataset_folder import Lease, Store
from spin_usd.store.file_digests import CHANGED, same_files, same_names, write_sums
from spin_usd.store.names import DESCRIPTION, STAGE, record_of
from spin_usd.store.pictures_left import WantedFiles, kinds_left
from spin_usd.store.read_documents import read_dataset_json
from spin_usd.store.stage_layers import refuse_changed_stage

MEANINGS = {
    IMAGE: IMAGE_MEANING,
    RADIANCE: RADIANCE_CHANNELS.meaning,
    **{name: label.channels.meaning for name, label in LABELS.items()},
}
OTHER_OPTIONS = "made with other options"
OTHER_STAGE = "made from another state of the stage"
OTHER_SOFTWARE = "made by another version of spin_usd"


class DatasetRun:
    """A run into the destination, whose folder is held by `lease`, that brings it to what the request asks for; of a
    `shard` its own pictures alone, and with `only` nothing but the pictures of these names."""

    def __init__(
        self,
        destination: Destination,
        lease: Lease,
        request: RenderRequest,
        options: RunOptions,
        shard: Shard | None,
        only: frozenset[str] | None,
        progress: Progress,
        note: Note,
    ) -> None:
        self._destination, self._lease, self._options = destination, lease, options
        self._shard, self._only = shard, only
        self._store, self._request = destination.store, request
        self._progress, self._note = progress, note
        there = self._store.stage.resolve()
        self._own = request.stage.resolve().is_relative_to(there)  # the dataset's own copy, perhaps edited
        self._copied = there if self._own else lease.work / STAGE
        self._processes = WorkerProcesses(destination, lease, request)
        self._new = self._store.folder.type_of(DESCRIPTION) is None
        self._foretold = self._new and not destination.cluster  # of which no cost is known

    def complete(self) -> RenderReport:
        """Make all that is missing, and return what was made."""
        with self._worker_ahead():
            return self._completed()

    def _worker_ahead(self) -> AbstractContextManager[None]:
        """Start a worker before the plan is made where it will be wanted here: in a new dataset there is something to
        make."""
        elsewhere = self._destination.mirror or self._destination.cluster
        return self._processes.one_ahead() if self._new and not elsewhere else nullcontext()

    def _completed(self) -> RenderReport:
        copy_to = None if self._own else self._copied
        try:
            planned = plan(
                self._request,
                progress=self._progress,
                shard=self._shard,
                copy_to=copy_to,
                had=self._store.kinds,
                timed=self._foretold,
            )
        except OutputError as e:  # about a file of the copy, in a folder that is gone by now
            raise OutputError(f"the stage's copy {e.found}", where=self._store.root, do=e.do) from e
        if self._request.device == AUTO:
            self._note(f"--device auto: light is rendered on {planned.settings.device}")
        if planned.settings.device != CPU:
            self._note("before its first picture on a device a driver may compile for minutes, and keeps what it made")
        if (only := self._only) is not None:
            planned = changed(planned, pictures=tuple(each for each in planned.pictures if each.name in only))
        kinds = wanted_kinds(self._request, planned)
        root = (Path(STAGE) / planned.root.relative_to(self._copied)).as_posix()
        removed = self._describe(planned, root, kinds)
        chosen = doubts(self._request.chosen, planned.stages)
        report = RenderReport(pictures=len(planned.pictures), pruned=removed, doubts=chosen)
        wanted = self._wanted(kinds)
        tasks = self._unfinished(planned, root, wanted, report)
        if self._foretold:
            self._foretell(planned, wanted)
        self._destination.publish()
        if tasks:
            self._make(planned, root, tasks, report)
        return report

    def _describe(self, planned: Plan, root: str, kinds: tuple[str, ...]) -> int:
        """Put the stage, whose root layer is `root` then, and dataset.json into the folder, and return how many
        pictures of another stage were removed from it."""
        store, work = self._store, self._lease.work
        with postponed():
            if not self._own:
                refuse_changed_stage(store, CHANGED, do="move stage/ elsewhere", new=self._copied)
            removed = _remove_unwanted(store, planned, self._options)
            if self._shard:
                manifest = Manifest(count=self._shard.count, variants=planned.variants, frames=planned.frames)
                write_manifest(store, manifest, work=work)
            write_json(store.folder, DESCRIPTION, describe(store, planned, root, kinds), work=work)
            if not self._own:
                _adopt_stage(store, work)
        return removed

    def _wanted(self, kinds: tuple[str, ...]) -> WantedFiles:
        return WantedFiles(
            kinds=kinds,
            options=self._request.options.recorded,
            image_suffix=self._request.image_suffix,
            verify=self._options.verify,
            again=self._only,
        )

    def _foretell(self, planned: Plan, wanted: WantedFiles) -> None:
        """Say about how long it takes, which progress knows only once there are pictures."""
        table = variant_table(planned, common_work(self._request, planned), wanted, self._store.root)
        count, cores = self._workers(len(planned.pictures))
        pictures, workers = pluralise(len(planned.pictures), "picture"), pluralise(count, "worker")
        self._note(f"{pictures} with {workers}: about {duration(table.seconds(count, cores))}")

    def _unfinished(self, planned: Plan, root: str, wanted: WantedFiles, report: RenderReport) -> list[RenderTask]:
        return unfinished_tasks(
            self._store, planned, root, wanted, report=report, note=self._note, work=self._lease.work
        )

    def _make(self, planned: Plan, root: str, tasks: list[RenderTask], report: RenderReport) -> None:
        """Have the pictures made, and write down what they took."""
        count, cores = self._workers(len(tasks))
        shared = common_work(self._request, planned)
        again = partial(command_of, self._request, self._store.root, self._options.picture_timeout)
        first = self._first if self._new else None
        alone = partial(one_core, workers=count, cores=cores)
        listener = RunListener(report, self._progress, self._note, shared, alone, again, first)
        limits = TimeLimits(
            options=shared,
            workers=count,
            cores=cores,
            measured=(read_measured(self._store.folder, MEASURED), listener.measured),
            min_s=MIN_S if planned.settings.device == CPU else GRAPHICS_S,
            given=self._options.picture_timeout,
        )
        if self._options.no_cache or self._destination.mirror:
            _keep_only_shared_renders(tasks)
        if self._destination.mirror:
            _keep_only_shared_labels(tasks)
        for_workers = self._worker_options(planned, root, renders=any(task.renders for task in tasks))
        with postponed() as stop:
            try:
                make_pictures(for_workers, tasks, count, self._processes, listener, limits, stop)
            finally:
                if stop.number is not None:
                    listener.stopped()
            if report.made:
                write_measured(self._store.folder, MEASURED, listener.measured, work=self._lease.work)

    def _first(self, picture: PlannedPicture) -> str:
        """Return the path of the picture's image, or of its record where it has none."""
        image = f"{IMAGE}/{picture.variant}/{picture.frame}{self._request.image_suffix}"
        return str(self._store.root / (image if self._request.image else record_of(picture.variant, picture.frame)))

    def _workers(self, tasks: int) -> tuple[int, int]:
        """Return how many workers there are at most, and how many processors these share: in a cluster each has
        its own."""
        if self._destination.cluster:
            count = min(self._options.workers or MAX_WORKERS, tasks)
            return count, count
        if in_process():  # Blender's state is the process's
            return 1, len(usable_cpus())
        return min(self._options.workers or default_workers(), tasks), len(usable_cpus())

    def _worker_options(self, planned: Plan, root: str, *, renders: bool) -> WorkerOptions:
        if renders:  # a picture made again keeps the image that it had, whatever is asked for
            require_renderer(self._request.renderer, instead=ANOTHER_RENDERER)
        return WorkerOptions(
            root=str(self._store.root),
            work=str(self._lease.work),
            stage=root,
            options=self._request.options.recorded,
            settings=planned.settings,
            renders=renders,
            chosen=self._request.chosen,
        )


def _remove_unwanted(store: Store, planned: Plan, options: RunOptions) -> int:
    """Remove pictures that are not of this stage, and return how many.

    With `replace` all pictures of another stage go; with `prune` those that the stage does not have. Raises InputError
    where there are some and the option is not given.
    """
    other = same_stage.other_origin(store, planned)
    if other:
        if not options.replace:
            same_stage.refuse(store, other)
        unwanted = list(store.records())
    else:
        unwanted = orphans.orphaned_pictures(store, planned)
        if not options.prune:
            orphans.refuse(store, unwanted)
    orphans.remove(store, unwanted)
    return len(unwanted)


def _keep_only_shared_renders(tasks: list[RenderTask]) -> None:
    wanted = Counter(task.picture.radiance for task in tasks if task.renders)
    for task in tasks:
        task.keep_render = wanted[task.picture.radiance] > 1


def _keep_only_shared_labels(tasks: list[RenderTask]) -> None:
    """The pictures' own files leave this machine; what the cache keeps stays on its disk as long as the run goes on."""
    wanted = Counter(key for task in tasks for key in task.label_keys)
    for task in tasks:
        task.keep_labels = any(wanted[key] > 1 for key in task.label_keys)


def _adopt_stage(store: Store, work: Path) -> None:
    """Put the copied stage in its place, unless the same is there, which others may be reading; what was there goes
    with the work folder."""
    try:
        write_sums(work / STAGE)
        if same_files(work / STAGE, store.stage) and same_names(work / STAGE, store.stage):
            return
        force_folder(work / STAGE)
        with suppress(FileNotFoundError):
            put(Folder(work), store.stage, "old")
        put(store.folder, work / STAGE, STAGE)
    except OSError as e:
        raise OutputError(f"cannot be written ({e.strerror})", where=store.stage, do="free some space") from e


def command_of(request: RenderRequest, out: Path, picture_timeout: float | None, picture: PlannedPicture) -> str:
    """Return the `spin-usd render` command that makes this one picture of the request in the dataset `out`, within the
    same time."""
    place = ("--frames", f"{picture.index}:{picture.index + 1}", "--variants", picture.variant)
    where = (str(request.stage), "--out", str(out))
    limit = () if picture_timeout is None else ("--picture-timeout", f"{picture_timeout:g}")
    return shlex.join(("spin-usd", "render", *where, *place, *_options(request), *limit))


def _options(request: RenderRequest) -> Iterator[str]:
    """Yield the options that decide the picture, where they are not as usual: what an effort was chosen by is that
    effort by now."""
    said = {"renderer": request.renderer, "effort": request.effort.text}
    left_out = {"stage", "frames", "variants", *(field.name for field in fields(EffortOptions)), "error", "measured"}
    for field in fields(PictureOptions):
        value = said.get(field.name) or getattr(request.options, field.name)
        if field.name in said or (field.name not in left_out and value != field.default):
            flag = flag_of(field.name)
            yield from (
                (flag,) if value is True else (flag, ",".join(value) if isinstance(value, tuple | list) else str(value))
            )


def describe(store: Store, plan: Plan, root: str, kinds: Sequence[str]) -> dict[str, Any]:
    """Return dataset.json by schema dataset-1; what earlier runs made of the same stage's other variants and kinds
    stays listed."""
    before = read_dataset_json(store.folder) if store.folder.type_of(DESCRIPTION) else None
    if before and differences(before, plan):
        before = None
    hashes = dict(before.stage.hashes) if before else {}
    hashes = {name: hash for name, hash in hashes.items() if name in plan.known_variants}
    hashes |= {name: stage["hash"] for name, stage in plan.stages.items()}
    classes = class_ids(part.class_ for part in plan.content.parts.values())
    description = DatasetDescription(
        stage=StageEntry(root=root, origin=plan.origin, hashes=hashes),
        targets=plan.content.targets,
        parts=plan.content.parts,
        classes={str(number): name for name, number in classes.items()},
        variants=list(hashes),
        frames=len(plan.names),
        files={kind: MEANINGS[kind] for kind in KINDS if kind in kinds or (before and kind in before.files)},
    )
    described: dict[str, Any] = to_builtins(description)
    return described


def unfinished_tasks(
    store: Store, planned: Plan, root: str, wanted: WantedFiles, *, report: RenderReport, note: Note, work: Path
) -> list[RenderTask]:
    """Return what is left to make of the planned pictures, whose root layer is `root` in the dataset; the report counts
    the others. `note` is given a sentence on pictures that are made again; `work` is for temporary files."""
    stages = {variant: StageProvenance(root=root, **stage) for variant, stage in planned.stages.items()}
    again = Counter[str]()
    left = partial(
        kinds_left,
        store,
        wanted=wanted,
        names={target.id: target.name for target in planned.content.targets},
        finished=lambda record: report.add(faults(record)),
        outdated=lambda record, stage: again.update([why_outdated(record, planned.settings, stage)]),
        work=work,
    )
    missing = ((picture, left(picture, stage=stages[picture.variant])) for picture in planned.pictures)
    tasks = [RenderTask(picture=picture, kinds=kinds) for picture, kinds in missing if kinds]
    report.reused = len(planned.pictures) - len(tasks)
    for why, count in again.items():
        note(f"{pluralise(count, 'picture')} of the dataset, {why}, will be made again")
    return tasks


def why_outdated(record: Record, settings: RenderSettings, stage: StageProvenance) -> str:
    """Say which of options, stage and software is another for the picture of a `record` than for one with other keys,
    of these settings and this `stage`: the first that is."""
    if RENDERED & record.files.keys() and record.settings != settings:
        return OTHER_OPTIONS
    return OTHER_SOFTWARE if record.provenance.stage == stage else OTHER_STAGE
