"""One run of `render` in a folder that it holds: plan, put the stage there, find missing pictures, and make them."""

from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path

from spin_usd.commands.render.picture_making import PictureMaking
from spin_usd.commands.render.put_stage import put_stage
from spin_usd.commands.render.render_run import RenderRun
from spin_usd.commands.render.report import RenderReport
from spin_usd.commands.render.unfinished_tasks import unfinished_tasks, wanted_files
from spin_usd.commands.render.workers import WorkerProcesses
from spin_usd.errors import OutputError
from spin_usd.events.event_limits import refuse_without_events
from spin_usd.planning.effort_choice import doubts
from spin_usd.planning.make_plan import Plan
from spin_usd.planning.render_plan import foretold, plan, wanted_kinds
from spin_usd.processes.devices import AUTO
from spin_usd.scene.effort import CPU
from spin_usd.store.names import DESCRIPTION, STAGE


class DatasetRun:
    """Makes the pictures of a run that its dataset lacks."""

    def __init__(self, run: RenderRun) -> None:
        self._run, self._request = run, run.request
        self._processes = WorkerProcesses(run)
        self._new = run.store.folder.type_of(DESCRIPTION) is None
        self._making = PictureMaking(run, self._processes, names_first=self._new)
        self._foretold = self._new and not run.destination.cluster  # whose costs are unknown

    def complete(self) -> RenderReport:
        """Make all missing pictures, and return the report."""
        with self._worker_ahead():
            return self._completed()

    def _worker_ahead(self) -> AbstractContextManager[None]:
        """Start a worker before the plan is made if it will be needed here: in a new dataset there is something to
        make."""
        elsewhere = self._run.destination.mirror or self._run.destination.cluster
        return self._processes.one_ahead() if self._new and not elsewhere else nullcontext()

    def _planned(self) -> Plan:
        """Plan the pictures of the run, and print notes on devices."""
        run, request = self._run, self._request
        try:
            planned = plan(
                request,
                progress=run.progress,
                shard=run.shard,
                copy_to=None if run.owns_stage else run.copied,
                had=run.store.kinds,
                timed=self._foretold,
            )
        except OutputError as e:  # about a file of the copy, whose folder is removed by now
            raise OutputError(f"the stage's copy {e.found}", where=run.store.root, do=e.do) from e
        if request.device == AUTO:
            run.note(f"--device auto: light is rendered on {planned.settings.device}")
        if planned.settings.device != CPU:
            run.note("a driver may compile for minutes before the first picture on a device, and keeps the result")
        if (only := run.only) is not None:
            planned = replace(planned, pictures=tuple(each for each in planned.pictures if each.name in only))
        for variant in planned.variants if run.event_labels is not None else ():
            times = [each.stated.get("time_s") for each in planned.pictures if each.variant == variant]
            refuse_without_events(times, event_camera=planned.content.event_camera, where=request.stage)
        return planned

    def _completed(self) -> RenderReport:
        run, request = self._run, self._request
        planned = self._planned()
        kinds = wanted_kinds(request, planned)
        root = (Path(STAGE) / planned.root.relative_to(run.copied)).as_posix()
        removed = put_stage(run, planned, root, kinds)
        chosen = doubts(request.chosen, planned.stages)
        report = RenderReport(pictures=len(planned.pictures), pruned=removed, doubts=chosen)
        wanted = wanted_files(run, kinds)
        tasks = unfinished_tasks(run, planned, root, wanted, report)
        if self._foretold:
            workers, cores = self._making.workers(len(planned.pictures))
            run.note(foretold(request, planned, wanted, run.store.root, workers, cores))
        run.destination.publish()
        if tasks:
            self._making.make(planned, root, tasks, report)
        if run.event_labels is not None and not report.failed:
            self._making.make_events(planned, root, report, labelled=run.event_labels)
        return report
