"""The events of a variant: chunks of time steps are shared out among workers, and their events made in order.

The light of chunks is made in any order, by as many workers as there are; the pixels go through them one after the
other: a worker that has made the light of a chunk keeps it until the events before are there. What was made lies in the
dataset's cache until it is whole, so that a run that was killed goes on with the next chunk.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from itertools import count
from pathlib import PurePosixPath
from typing import Any

from msgspec import to_builtins

from spin_usd.basics.arrays import digest
from spin_usd.basics.progress import Progress
from spin_usd.basics.stop_signals import StopRequest
from spin_usd.errors import InputError
from spin_usd.planning.worker_options import WorkerOptions
from spin_usd.processes.child import Child
from spin_usd.processes.child_calls import modules_of
from spin_usd.processes.child_limits import RENDER_PATIENCE_S, START_PATIENCE_S, rendering_memory
from spin_usd.processes.deaths import ChildDiedError, Retries
from spin_usd.processes.pool import Answered, Failed, Pool, Reported
from spin_usd.processes.processors import share_of
from spin_usd.scene.effort import CPU
from spin_usd.store.dataset_folder import Lease, Store
from spin_usd.store.json_schema import read_json
from spin_usd.store.names import STATE, event_chunks, event_record_of, events_of

VERSION = "events 2"  # of how events are made: its number grows where they may be others
OPEN, LIGHT, MAKE, FINISH = "open_events", "event_light", "make_events", "finish_events"


@dataclass(kw_only=True)
class _Worker:
    """What a worker is at: its call, "" for none, and the chunk that it has, whose light may be there."""

    call: str = OPEN
    chunk: int | None = None
    lit: bool = False


@dataclass(kw_only=True)
class EventRun:
    """The making of the events of a `variant` between the first and the last of its `pictures`, places in the stage.

    provenance: the stage's hash, files and variants, as records have them. labelled: whether each event gets the ids of
    what its pixel shows.
    """

    store: Store
    lease: Lease
    options: WorkerOptions
    variant: str
    pictures: Sequence[int]
    provenance: Mapping[str, Any]
    labelled: bool
    workers: int
    progress: Progress
    _opened: dict[str, Any] = field(default_factory=dict)
    _at: dict[int, _Worker] = field(default_factory=dict)
    _retries: Retries = field(default_factory=Retries)
    _finished: bool = False

    def make(self, stop: StopRequest) -> bool:
        """Make what is missing; return whether they are whole: they are not where `stop` was asked for. Raises what
        opening the stage does, ChildDiedError where workers die again and again, OutputError."""
        if self._is_whole():
            return True
        with Pool[int]() as pool:
            self._start(pool)
            while not self._opened:
                self._hear(pool)
            steps, chunks = len(self._opened["times"]), int(self._opened["chunks"])
            while not self._finished:
                done = self._done()
                self.progress(f"events of {self.variant}: step", done * steps // chunks, steps)
                if stop.number is None:
                    self._share_out(pool, done, chunks)
                elif all(worker.call != MAKE for worker in self._at.values()):
                    return False
                self._hear(pool)
        return True

    @cached_property
    def key(self) -> str:
        """Of all that decides the events."""
        settings = to_builtins(self.options.settings)
        return digest([VERSION, self.variant, self.provenance, list(self.pictures), self.labelled, settings])

    def _share_out(self, pool: Pool[int], done: int, chunks: int) -> None:
        """Give idle workers what is next, and start workers while there is more."""
        taken = {worker.chunk for worker in self._at.values()}
        ahead = [chunk for chunk in range(done, chunks) if chunk not in taken]
        for number in pool.idle():
            worker = self._at[number]
            if done == chunks:
                self._send(pool, number, FINISH)
                return
            if worker.lit and worker.chunk == done:
                self._send(pool, number, MAKE, chunk=done)
            elif worker.chunk is None and ahead:
                worker.chunk = ahead.pop(0)
                self._send(pool, number, LIGHT, chunk=worker.chunk)
        if len(pool) < min(self.workers, len(ahead) + len(pool)) or not len(pool):
            self._start(pool)

    def _send(self, pool: Pool[int], number: int, call: str, **arguments: Any) -> None:
        self._at[number].call = call
        pool.send(number, call, within_s=RENDER_PATIENCE_S, **arguments)

    def _hear(self, pool: Pool[int]) -> None:
        """Take what workers say. Raises what one does."""
        for event in pool.wait():
            match event:
                case Answered(key=number, result=result):
                    worker = self._at[number]
                    if worker.call == OPEN:
                        self._opened = self._opened or result
                    self._finished |= worker.call == FINISH and result is not None
                    worker.lit = worker.call == LIGHT
                    worker.chunk = worker.chunk if worker.lit else None
                    worker.call = ""
                case Reported(message=said) if not self._opened:
                    self.progress(*said)
                case Failed(key=number, reason=ChildDiedError() as died):
                    del self._at[number]
                    if not self._retries.may_try_again(died):
                        raise died
                    if not len(pool):
                        self._start(pool)
                case Failed(reason=reason):
                    raise reason

    def _done(self) -> int:
        """Return how many chunks of events are made."""
        names = self.store.folder.files(event_chunks(self._opened["chunk_key"]))
        states = [int(PurePosixPath(name).stem.removeprefix(f"{STATE}-")) for name in names if f"/{STATE}-" in name]
        return max(states, default=-1) + 1

    def _is_whole(self) -> bool:
        folder, name = self.store.folder, event_record_of(self.variant)
        if folder.type_of(name) is None or folder.type_of(events_of(self.variant)) is None:
            return False
        try:
            said = read_json(folder, name, "events-1")
        except InputError:  # damaged, which making it again mends
            return False
        return bool(said["key"] == self.key and said["sha256"] == folder.sha256(events_of(self.variant)))

    def _start(self, pool: Pool[int]) -> None:
        number = next(number for number in count() if number not in pool)
        child = Child(
            keep_open=(self.lease.descriptor,),
            scratch=self.lease.work,
            memory=rendering_memory(graphics=self.options.settings.device != CPU),
            modules=modules_of(OPEN),
        )
        with suppress(ChildDiedError):  # the end of its answers says so too
            child.send(
                OPEN,
                options=to_builtins(self.options),
                variant=self.variant,
                pictures=list(self.pictures),
                labelled=self.labelled,
                key=self.key,
                times=self._opened.get("times"),
                cpus=share_of(number, self.workers),
            )
        self._at[number] = _Worker()
        pool.add(number, child, within_s=START_PATIENCE_S)
