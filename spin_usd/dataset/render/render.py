"""A stage to a dataset: plan, skip what is finished, supervise the workers. Run again, it resumes."""

import time
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from dataclasses import replace as changed
from functools import partial
from pathlib import Path

from spin_usd.dataset.picture.brightness import faults
from spin_usd.dataset.plan.cost import read_measured, write_measured
from spin_usd.dataset.plan.effort_choice import doubts
from spin_usd.dataset.plan.make_plan import Plan
from spin_usd.dataset.plan.time_limit import TimeLimits, refuse_time_limit
from spin_usd.dataset.plan.wall_time import one_core
from spin_usd.dataset.process.open_renderer import require_renderer
from spin_usd.dataset.process.processors import MAX_WORKERS, refuse_workers, usable_cpus
from spin_usd.dataset.render import orphans, same_stage
from spin_usd.dataset.render.command import command_of
from spin_usd.dataset.render.dataset_json import describe
from spin_usd.dataset.render.destination import Destination, opened
from spin_usd.dataset.render.report import RenderReport, RunListener
from spin_usd.dataset.render.request import RenderRequest, plan, run_options, wanted_kinds
from spin_usd.dataset.render.task_queue import RenderTask
from spin_usd.dataset.render.worker_options import WorkerOptions
from spin_usd.dataset.render.workers import default_workers, make_pictures
from spin_usd.dataset.shards.manifest import Manifest, remove_finished_manifest, share_manifest
from spin_usd.dataset.shards.plan_of_shard import plan_of_shard
from spin_usd.dataset.shards.shard import Shard
from spin_usd.dataset.store.atomic import write_json
from spin_usd.dataset.store.cache import MEASURED, remove_entries, used
from spin_usd.dataset.store.dataset_folder import Lease, Store
from spin_usd.dataset.store.file_digests import CHANGED, same_files, same_names, write_sums
from spin_usd.dataset.store.names import DESCRIPTION, STAGE
from spin_usd.dataset.store.stage_layers import refuse_changed_stage
from spin_usd.dataset.store.unfinished import WantedFiles, kinds_left
from spin_usd.errors import InputError, OutputError
from spin_usd.files.changes import put
from spin_usd.files.folder import Folder
from spin_usd.files.url import is_url
from spin_usd.progress import Note, Progress, unsaid
from spin_usd.stop_signals import postponed


def render(
    request: RenderRequest,
    out: str | Path,
    *,
    cluster: str | None = None,
    workers: int | None = None,
    keep_cache: bool = True,
    prune: bool = False,
    replace: bool = False,
    verify: bool = False,
    shard: Shard | None = None,
    picture_timeout: float | None = None,
    only: frozenset[str] | None = None,
    progress: Progress,
    note: Note = unsaid,
) -> RenderReport:
    """Make the dataset in the folder or at the URL `out`, or what is missing of it, here or on the Ray cluster at that
    address; of a `shard` its own pictures alone.

    Once nothing is missing, the cache loses what no record uses any more; without `keep_cache` it loses everything, and
    renders that only one picture needs are not kept in the first place. Pictures that the stage does not have raise
    InputError, or are removed with `prune`; those of another stage raise it too, or are all removed with `replace`,
    whatever part of this one is wanted. With `verify` pictures whose files are not as their records say are made again.
    A worker that takes longer than `picture_timeout` seconds for a picture is replaced; that follows the picture's
    expected time where it is not given. The first signal that asks to stop lets running pictures be finished, as `note`
    is told; a second stops the run at once. With `only` nothing but the pictures of these names is made, and those are
    made whatever their records say.
    """
    began = time.monotonic()
    refuse_time_limit(picture_timeout)
    if shard and cluster is not None:
        do = "give one of them: a cluster shares out all pictures by itself"
        raise InputError("--shard and --cluster are given together", do=do)
    if workers is not None:
        refuse_workers(workers)
    require_renderer(request.renderer)
    options = _DatasetOptions(
        workers=workers,
        keep_cache=keep_cache and not is_url(out),
        prune=prune,
        replace=replace,
        verify=verify,
        shard=shard,
        picture_timeout=picture_timeout,
        only=only,
    )
    if is_url(out) and (verify or shard):
        option, do = ("--verify", "fetch it") if verify else ("--shard", "make the shards in folders, and merge them")
        raise InputError(f"is a URL, where {option} is not possible", where=out, do=do)
    with opened(out, cluster) as destination:
        store = destination.store
        store.prepare(strange_stays=only is not None)  # a repair leaves it where it is
        with store.locked(shard.name if shard else None) as lease:
            report = _render(destination, lease, request, options, progress, note)
            if not report.failed and shard is None and not destination.mirror:  # others may be using the cache
                _tidy(store, report, keep_cache)
                remove_finished_manifest(store)
    report.seconds = time.monotonic() - began
    return report


@dataclass(frozen=True, kw_only=True)
class _DatasetOptions:
    """The options of `render` that do not decide pictures, by its own names."""

    workers: int | None
    keep_cache: bool
    prune: bool
    replace: bool
    verify: bool
    shard: Shard | None
    picture_timeout: float | None
    only: frozenset[str] | None


def _render(
    destination: Destination,
    lease: Lease,
    request: RenderRequest,
    options: _DatasetOptions,
    progress: Progress,
    note: Note,
) -> RenderReport:
    """Bring the destination, whose folder is held by `lease`, to what the request asks for."""
    store = destination.store
    own = request.stage.resolve().is_relative_to(store.stage.resolve())  # the dataset's own copy, perhaps edited
    copied = store.stage.resolve() if own else lease.work / STAGE
    planned = plan(request, progress=progress, copy_to=None if own else copied, had=store.kinds)
    kinds = wanted_kinds(request, planned)
    root = (Path(STAGE) / planned.root.relative_to(copied)).as_posix()
    if options.only is not None:
        planned = changed(planned, pictures=tuple(each for each in planned.pictures if each.name in options.only))
    manifest: Manifest | None = None
    if options.shard:
        planned, manifest = plan_of_shard(
            planned, options.shard, run_options(request, planned), image_suffix=request.image_suffix, stage=copied
        )
    with postponed(), store.turn():
        if not own:
            refuse_changed_stage(store, CHANGED, do="move stage/ elsewhere", new=copied)
        removed = _remove_unwanted(store, planned, options)
        if manifest:
            share_manifest(store, manifest, work=lease.work)
        write_json(store.folder, DESCRIPTION, describe(store, planned, root, kinds), work=lease.work)
        if not own:
            _adopt_stage(store, lease.work)
    chosen = doubts(request.chosen, planned.stages)
    report = RenderReport(pictures=len(planned.pictures), pruned=removed, doubts=chosen)
    wanted = WantedFiles(kinds=kinds, image_suffix=request.image_suffix, verify=options.verify, again=options.only)
    tasks = _unfinished(store, lease, planned, root, wanted, report)
    destination.publish()
    if tasks:
        for_workers = WorkerOptions(
            root=str(store.root),
            work=str(lease.work),
            stage=root,
            image_suffix=request.image_suffix,
            settings=planned.settings,
            chosen=request.chosen,
        )
        count, cores = _workers(destination, options, tasks)
        shared = run_options(request, planned)
        again = partial(command_of, request, store.root)
        alone = partial(one_core, workers=count, cores=cores)
        listener = RunListener(report, progress, note, shared, alone, again)
        limits = TimeLimits(
            options=shared,
            workers=count,
            cores=cores,
            measured=(read_measured(store.folder, MEASURED), listener.measured),
            given=options.picture_timeout,
        )
        if not options.keep_cache:
            _keep_only_shared_renders(tasks)
        if destination.mirror:
            _keep_only_shared_labels(tasks)
        with postponed() as stop:
            try:
                make_pictures(for_workers, tasks, count, lease, listener, limits, destination, stop)
            finally:
                if stop.number is not None:
                    listener.stopped()
            if report.made:
                with store.turn():
                    write_measured(store.folder, MEASURED, listener.measured, work=lease.work)
    return report


def _workers(destination: Destination, options: _DatasetOptions, tasks: list[RenderTask]) -> tuple[int, int]:
    """Return how many workers there are at the most, and how many processors these share: in a cluster each has its
    own."""
    if destination.cluster:
        count = min(options.workers or MAX_WORKERS, len(tasks))
        return count, count
    return min(options.workers or default_workers(), len(tasks)), len(usable_cpus())


def _unfinished(
    store: Store, lease: Lease, planned: Plan, root: str, wanted: WantedFiles, report: RenderReport
) -> list[RenderTask]:
    """Return what is left to make of the planned pictures; the report counts the others."""
    stages = {variant: {"root": root, **stage} for variant, stage in planned.stages.items()}
    left = partial(
        kinds_left,
        store,
        wanted=wanted,
        names={target["id"]: target["name"] for target in planned.description["targets"]},
        finished=lambda record: report.add(faults(record)),
        work=lease.work,
    )
    kinds = ((picture, left(picture, stage=stages[picture.variant])) for picture in planned.pictures)
    tasks = [RenderTask(picture=picture, kinds=missing) for picture, missing in kinds if missing]
    report.reused = len(planned.pictures) - len(tasks)
    return tasks


def _remove_unwanted(store: Store, planned: Plan, options: _DatasetOptions) -> int:
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


def _tidy(store: Store, report: RenderReport, keep_cache: bool) -> None:
    """Remove from the cache what no record uses; where no picture was made or removed, none has ceased to be
    used."""
    if not keep_cache:
        remove_entries(store, but=set())
    elif report.made or report.pruned:
        remove_entries(store, but=used(store))


def _adopt_stage(store: Store, work: Path) -> None:
    """Put the copied stage in its place, unless the same is there, which others may be reading; what was there goes
    with the work folder."""
    try:
        write_sums(work / STAGE)
        if same_files(work / STAGE, store.stage) and same_names(work / STAGE, store.stage):
            return
        with suppress(FileNotFoundError):
            put(Folder(work), store.stage, "old")
        put(store.folder, work / STAGE, STAGE)
    except OSError as e:
        raise OutputError(f"cannot be written ({e.strerror})", where=store.stage, do="free some space") from e
