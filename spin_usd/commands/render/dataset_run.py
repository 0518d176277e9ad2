"""One run of `render` in a folder that it holds: plan, put the stage there, find what is left, and have it made."""

from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace as changed
from pathlib import Path

from spin_usd.basics.progress import Note, Progress
from spin_usd.commands.render.destination import Destination
from spin_usd.commands.render.picture_making import PictureMaking
from spin_usd.commands.render.put_stage import put_stage
from spin_usd.commands.render.report import RenderReport
from spin_usd.commands.render.request import foretold, plan, wanted_kinds
from spin_usd.commands.render.unfinished_tasks import unfinished_tasks, wanted_files
from spin_usd.commands.render.workers import WorkerProcesses
from spin_usd.errors import OutputError
from spin_usd.events.event_limits import refuse_without_events
from spin_usd.options import RunOptions
from spin_usd.planning.effort_choice import doubts
from spin_usd.planning.request import RenderRequest
from spin_usd.planning.shard import Shard
from spin_usd.processes.devices import AUTO
from spin_usd.scene.effort import CPU
from spin_usd.store.dataset_folder import Lease
from spin_usd.store.names import DESCRIPTION, STAGE


class DatasetRun:
    """A run into the destination, whose folder is held by `lease`, that brings it to what the request asks for; of a
    `shard` its own pictures alone, and with `only` nothing but the pictures of these names.

    event_labels: whether events have the ids of what they show; None where no events are asked for.
    """

    def __init__(
        self,
        destination: Destination,
        lease: Lease,
        request: RenderRequest,
        options: RunOptions,
        shard: Shard | None,
        only: frozenset[str] | None,
        event_labels: bool | None,
        progress: Progress,
        note: Note,
    ) -> None:
        self._destination, self._lease, self._options = destination, lease, options
        self._shard, self._only, self._event_labels = shard, only, event_labels
        self._store, self._request = destination.store, request
        self._progress, self._note = progress, note
        there = self._store.stage.resolve()
        self._own = request.stage.resolve().is_relative_to(there)  # the dataset's own copy, perhaps edited
        self._copied = there if self._own else lease.work / STAGE
        self._processes = WorkerProcesses(destination, lease, request)
        self._new = self._store.folder.type_of(DESCRIPTION) is None
        self._making = PictureMaking(self._processes, request, options, progress, note, tells_first=self._new)
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
        if self._event_labels is not None:
            for variant in planned.variants:
                times = [each.stated.get("time_s") for each in planned.pictures if each.variant == variant]
                camera, where = planned.content.event_camera, self._request.stage
                refuse_without_events(times, event_camera=camera, where=where)
        kinds = wanted_kinds(self._request, planned)
        root = (Path(STAGE) / planned.root.relative_to(self._copied)).as_posix()
        removed = put_stage(self._store, self._lease, planned, root, kinds, self._options, self._shard, copied=copy_to)
        chosen = doubts(self._request.chosen, planned.stages)
        report = RenderReport(pictures=len(planned.pictures), pruned=removed, doubts=chosen)
        wanted = wanted_files(self._request, self._options, kinds, self._only)
        tasks = unfinished_tasks(
            self._store, planned, root, wanted, report=report, note=self._note, work=self._lease.work
        )
        if self._foretold:
            workers, cores = self._making.workers(len(planned.pictures))
            self._note(foretold(self._request, planned, wanted, self._store.root, workers, cores))
        self._destination.publish()
        if tasks:
            self._making.make(planned, root, tasks, report)
        if self._event_labels is not None and not report.failed:
            self._making.make_events(planned, root, report, labelled=self._event_labels)
        return report
