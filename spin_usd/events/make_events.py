"""The events of a variant: chunks of time steps are shared out among workers, and their events made in order.

The light of chunks is made in any order, by all workers; the events need the chunks in order: a worker that has made
the light of a chunk keeps it until the events before are there. Chunks are stored in the dataset's cache until the
whole is there, so that a killed run goes on with the next chunk.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import PurePosixPath

from msgspec import to_builtins
from msgspec.structs import replace

from spin_usd.basics.arrays import digest
from spin_usd.basics.progress import Progress
from spin_usd.basics.stop_signals import StopRequest
from spin_usd.errors import InputError
from spin_usd.events.calls import (
    FINISH_EVENTS,
    MAKE_EVENTS,
    MAKE_LIGHT,
    OPEN_EVENTS,
    ChunkMade,
    OpenedEvents,
    OpenEvents,
)
from spin_usd.planning.worker_options import WorkerOptions
from spin_usd.processes.call import Call
from spin_usd.processes.child import Child
from spin_usd.processes.child_limits import RENDER_PATIENCE_S, rendering_memory
from spin_usd.processes.crew import Crew
from spin_usd.processes.deaths import ChildDiedError
from spin_usd.processes.processors import share_of
from spin_usd.processes.task import Done, Event, GivenUp, Opened, Task, Worker, WorkerReport
from spin_usd.records.record import StageProvenance
from spin_usd.scene.effort import CPU
from spin_usd.store.dataset_folder import Lease, Store
from spin_usd.store.json_schema import read_json
from spin_usd.store.names import STATE, event_chunks, event_record_of, events_of

VERSION = "events 2"  # of the method: its number grows with each change of the events


@dataclass(kw_only=True, eq=False)
class _ChunkTask(Task[ChunkMade]):
    """A call on a chunk; its number is the request."""

    request: int
    within_s: float = RENDER_PATIENCE_S


class EventRun:
    """The making of the events of a `variant` between the first and the last of its `pictures`, places in the stage. It
    is the source of its crew's tasks; a worker holds the chunk whose light it has made.

    provenance: of the stage. labelled: whether each event contains the ids of its pixel.
    """

    def __init__(
        self,
        store: Store,
        lease: Lease,
        options: WorkerOptions,
        *,
        variant: str,
        pictures: Sequence[int],
        provenance: StageProvenance,
        labelled: bool,
        workers: int,
        progress: Progress,
    ) -> None:
        self._store, self._lease, self._workers, self._progress = store, lease, workers, progress
        settings, stage = to_builtins(options.settings), provenance
        of_stage = {"hash": stage.hash, "files": stage.files, "variants": stage.variants}
        key = digest([VERSION, variant, of_stage, list(pictures), labelled, settings])
        self._opening = OpenEvents(
            options=options, variant=variant, pictures=list(pictures), labelled=labelled, key=key
        )
        self._opened: OpenedEvents | None = None
        self._tasks: dict[tuple[object, int], _ChunkTask] = {}  # all that were started
        self._finished = self._stopping = False
        self._crew = Crew[_ChunkTask](self._start, self, slots=lambda: workers, opening=OPEN_EVENTS, lasting=True)

    def make(self, stop: StopRequest) -> bool:
        """Make the missing events; return whether they are complete, which they are not if `stop` is requested. Raises
        the errors of opening the stage, ChildDiedError if workers die again and again, OutputError."""
        if self._is_whole():
            return True
        with self._crew as crew:
            while not self._finished:
                for event in crew.step():
                    self._handle(event)
                self._stopping = stop.number is not None
                if self._stopping and all(task.call is not MAKE_EVENTS for task in crew.tasks):
                    return False
                self._report()
        return True

    def __len__(self) -> int:
        """Return the number of chunks that no worker has, and of workers that wait with one."""
        if self._opened is None or self._done() == self._opened.chunks:
            return 1
        return len(self._ahead()) + sum(worker.holds is not None for worker in self._crew.idle)

    def take(self, worker: Worker[_ChunkTask]) -> _ChunkTask | None:
        """Return the worker's next task: events of the chunk that it has, as soon as those before are there."""
        if self._opened is None or self._stopping:
            return None
        done = self._done()
        if done == self._opened.chunks:
            return None if self._crew.tasks else self._task(FINISH_EVENTS, done)
        if worker.holds == done:
            return self._task(MAKE_EVENTS, done)
        if worker.holds is None and (ahead := self._ahead()):
            worker.holds = ahead[0]
            return self._task(MAKE_LIGHT, ahead[0])
        return None

    def put_back(self, task: _ChunkTask) -> None:
        """Do nothing: the chunk has no worker now."""

    def _task(self, call: Call[int, ChunkMade], chunk: int) -> _ChunkTask:
        return self._tasks.setdefault((call.place, chunk), _ChunkTask(call=call, request=chunk))

    def _ahead(self) -> list[int]:
        """Return the chunks that no worker has."""
        assert self._opened
        held = {worker.holds for worker in self._crew.workers}
        return [chunk for chunk in range(self._done(), self._opened.chunks) if chunk not in held]

    def _handle(self, event: Event[_ChunkTask]) -> None:
        match event:
            case Opened(answer=opened):
                self._opened = self._opened or opened
                self._opening = replace(self._opening, times=opened.times, exposure=opened.exposure)
            case WorkerReport(message=message) if self._opened is None:
                self._progress(*message)
            case Done(worker=worker, task=task):
                if task.call is not MAKE_LIGHT:
                    worker.holds = None
                self._finished = task.call is FINISH_EVENTS and not task.result.lost
            case GivenUp(reason=reason):
                raise reason

    def _report(self) -> None:
        if self._opened:
            steps, chunks = len(self._opened.times), self._opened.chunks
            self._progress(f"events of {self._opening.variant}: step", self._done() * steps // chunks, steps)

    def _done(self) -> int:
        """Return how many chunks of events are made."""
        assert self._opened
        names = self._store.folder.files(event_chunks(self._opened.chunk_key))
        states = [int(PurePosixPath(name).stem.removeprefix(f"{STATE}-")) for name in names if f"/{STATE}-" in name]
        return max(states, default=-1) + 1

    def _is_whole(self) -> bool:
        folder, name = self._store.folder, event_record_of(self._opening.variant)
        if folder.type_of(name) is None or folder.type_of(events_of(self._opening.variant)) is None:
            return False
        try:
            record = read_json(folder, name, "events-1")
        except InputError:  # damaged: it is made again
            return False
        return bool(
            record["key"] == self._opening.key and record["sha256"] == folder.sha256(events_of(self._opening.variant))
        )

    def _start(self, number: int) -> Child:
        graphics = self._opening.options.settings.device != CPU
        child = Child(
            keep_open=(self._lease.descriptor,),
            scratch=self._lease.work,
            memory=rendering_memory(graphics=graphics),
            modules=(OPEN_EVENTS.module,),
            writes=None if graphics else (self._store.root,),
        )
        with suppress(ChildDiedError):  # the end of its answers reports it too
            child.send(OPEN_EVENTS, replace(self._opening, cpus=share_of(number, self._workers)))
        return child
