"""The making of the missing pictures: the workers' options, their number, the pictures' times."""

import shlex
from collections import Counter
from collections.abc import Iterator
from dataclasses import fields
from functools import partial
from pathlib import Path

from spin_usd.basics.stop_signals import postponed
from spin_usd.commands.render.render_run import RenderRun
from spin_usd.commands.render.report import RenderReport, RunListener
from spin_usd.commands.render.task_queue import RenderTask
from spin_usd.commands.render.workers import WorkerProcesses, make_pictures, workers_and_cores
from spin_usd.events.make_events import EventRun
from spin_usd.files.changes import remove_tree
from spin_usd.options import MAX_WORKERS, EffortOptions, PictureOptions, flag_of
from spin_usd.picture.kinds import IMAGE
from spin_usd.picture.planned_picture import PlannedPicture, places_of
from spin_usd.planning.cost import read_measured, write_measured
from spin_usd.planning.make_plan import Plan
from spin_usd.planning.render_plan import common_work
from spin_usd.planning.request import RenderRequest
from spin_usd.planning.time_limit import GRAPHICS_S, MIN_S, TimeLimits
from spin_usd.planning.wall_time import one_core
from spin_usd.planning.worker_options import WorkerOptions
from spin_usd.processes.open_renderer import ANOTHER_RENDERER, require_renderer
from spin_usd.scene.effort import CPU
from spin_usd.store.cache import MEASURED
from spin_usd.store.names import EVENT_CHUNKS, record_of


class PictureMaking:
    """The making of pictures of a run by the `processes`. `names_first`: whether a note names the first file."""

    def __init__(self, run: RenderRun, processes: WorkerProcesses, *, names_first: bool) -> None:
        self._run, self._processes, self._names_first = run, processes, names_first
        self._store, self._request, self._options = run.store, run.request, run.options

    def workers(self, tasks: int) -> tuple[int, int]:
        """Return how many workers there are at most, and how many processors these share."""
        return workers_and_cores(tasks, self._options.workers, cluster=self._run.destination.cluster is not None)

    def make(self, planned: Plan, root: str, tasks: list[RenderTask], report: RenderReport) -> None:
        """Make the pictures, and write down their times."""
        count, cores = self.workers(len(tasks))
        shared = common_work(self._request, planned)
        again = partial(command_of, self._request, self._store.root, self._options.picture_timeout)
        first = self._first if self._names_first else None
        alone = partial(one_core, workers=count, cores=cores)
        listener = RunListener(report, self._run.progress, self._run.note, shared, alone, again, first)
        limits = TimeLimits(
            options=shared,
            workers=count,
            cores=cores,
            measured=(read_measured(self._store.folder, MEASURED), listener.measured),
            min_s=MIN_S if planned.settings.device == CPU else GRAPHICS_S,
            given=self._options.picture_timeout,
        )
        if self._options.no_cache or self._run.destination.mirror:
            _keep_only_shared_renders(tasks)
        if self._run.destination.mirror:
            _keep_only_shared_labels(tasks)
        for_workers = self._worker_options(planned, root, renders=any(task.renders for task in tasks))
        with postponed() as stop:
            try:
                make_pictures(for_workers, tasks, count, self._processes, listener, limits, stop)
            finally:
                if stop.number is not None:
                    listener.stopped()
            if report.made:
                write_measured(self._store.folder, MEASURED, listener.measured, work=self._run.lease.work)

    def make_events(self, planned: Plan, root: str, report: RenderReport, *, labelled: bool) -> None:
        """Make the events of each variant, between the first and the last of its pictures."""
        workers, _ = workers_and_cores(MAX_WORKERS, self._options.workers, cluster=False)
        options = self._worker_options(planned, root, renders=True)
        with postponed() as stop:
            for variant, places in places_of(planned.pictures).items():
                run = EventRun(
                    self._store,
                    self._run.lease,
                    options,
                    variant=variant,
                    pictures=places,
                    provenance=planned.stages[variant],
                    labelled=labelled,
                    workers=workers,
                    progress=self._run.progress,
                )
                if not run.make(stop):
                    self._run.note(f"the events of {variant} are not complete")
                    return
                report.events += 1
        remove_tree(self._store.folder, EVENT_CHUNKS)  # also chunks of an earlier stage or of earlier settings

    def _first(self, picture: PlannedPicture) -> str:
        """Return the path of the picture's image, or of its record if it has none."""
        image = f"{IMAGE}/{picture.variant}/{picture.frame}{self._request.image_suffix}"
        return str(self._store.root / (image if self._request.image else record_of(picture.variant, picture.frame)))

    def _worker_options(self, planned: Plan, root: str, *, renders: bool) -> WorkerOptions:
        if renders:  # a picture made again keeps its image, whatever is requested
            require_renderer(self._request.renderer, instead=ANOTHER_RENDERER)
        return WorkerOptions(
            root=str(self._store.root),
            work=str(self._run.lease.work),
            stage=root,
            options=self._request.options.recorded,
            settings=planned.settings,
            renders=renders,
            chosen=self._request.chosen,
        )


def _keep_only_shared_renders(tasks: list[RenderTask]) -> None:
    wanted = Counter(task.picture.radiance for task in tasks if task.renders)
    for task in tasks:
        task.keep_render = wanted[task.picture.radiance] > 1


def _keep_only_shared_labels(tasks: list[RenderTask]) -> None:
    """The pictures' own files leave this machine; the cache stays on its disk as long as the run goes on."""
    wanted = Counter(key for task in tasks for key in task.label_keys)
    for task in tasks:
        task.keep_labels = any(wanted[key] > 1 for key in task.label_keys)


def command_of(request: RenderRequest, out: Path, picture_timeout: float | None, picture: PlannedPicture) -> str:
    """Return the `spin-usd render` command that makes this one picture of the request in the dataset `out`, within the
    same time."""
    place = ("--frames", f"{picture.index}:{picture.index + 1}", "--variants", picture.variant)
    where = (str(request.stage), "--out", str(out))
    limit = () if picture_timeout is None else ("--picture-timeout", f"{picture_timeout:g}")
    return shlex.join(("spin-usd", "render", *where, *place, *_options(request), *limit))


def _options(request: RenderRequest) -> Iterator[str]:
    """Yield the options that decide the picture and differ from the defaults: a chosen quality or error appears as its
    effort."""
    said = {"renderer": request.renderer, "effort": request.effort.text}
    left_out = {"stage", "frames", "variants", *(field.name for field in fields(EffortOptions)), "error", "measured"}
    for field in fields(PictureOptions):
        value = said.get(field.name) or getattr(request.options, field.name)
        if field.name in said or (field.name not in left_out and value != field.default):
            flag = flag_of(field.name)
            yield from (
                (flag,) if value is True else (flag, ",".join(value) if isinstance(value, tuple | list) else str(value))
            )
