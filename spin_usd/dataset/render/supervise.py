"""Feeds workers picture by picture, outlives their crashes, and bounds their memory."""

import selectors
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Protocol

from spin_usd.dataset.picture.planned_picture import PlannedPicture
from spin_usd.dataset.process.child import HANG_S, Child, ChildDiedError, ChildInternalError
from spin_usd.dataset.render.task_queue import RenderTask, TaskQueue
from spin_usd.errors import OutputError, RenderError, SpinError

TRIES = 2  # a picture whose worker died is tried once more: the next worker may have more luck
STARTS_PER_SLOT = 3  # a worker that dies this often in a row before its first picture is not a picture's fault


class Listener(Protocol):
    """Told of each worker that is ready for its first picture, and of each picture as it ends."""

    def ready(self) -> None: ...

    def done(self, picture: PlannedPicture, result: Mapping[str, Any]) -> None: ...

    def failed(self, picture: PlannedPicture, reason: str) -> None: ...


@dataclass(kw_only=True, eq=False)
class Slot:
    """One worker's place: its child process now, and what that is doing: a task, or waiting for one, else starting."""

    number: int
    child: Child
    task: RenderTask | None = None
    waiting: bool = False
    starts: int = 1
    since: float = field(default_factory=time.monotonic)


def supervise(
    tasks: Iterable[RenderTask],
    *,
    workers: int,
    start: Callable[[int], Child],
    listener: Listener,
    memory_limit: int,
    hang_s: float = HANG_S,
) -> None:
    """Make all pictures with `workers` children; returns when each is done or has failed twice.

    `start(number)` starts a child that was already sent its "open_worker". `memory_limit` in bytes: a worker above it
    is replaced after its picture. Raises OutputError when results cannot be written, RenderError when no worker starts.
    """
    queue = TaskQueue(tasks)
    with selectors.DefaultSelector() as selector:
        slots = []
        try:
            for number in range(min(workers, len(queue))):
                slots.append(Slot(number=number, child=start(number)))
                selector.register(slots[-1].child, selectors.EVENT_READ, slots[-1])
            while selector.get_map():
                for key, _ in selector.select(timeout=1.0):
                    _advance(key.data, queue, selector, start, listener, memory_limit)
                for slot in slots:
                    if slot.waiting:
                        _occupy(slot, queue, selector)
                    elif time.monotonic() - slot.since > hang_s and slot.child.process.poll() is None:
                        slot.child.process.kill()
        finally:
            for slot in slots:
                slot.child.kill()


def _advance(
    slot: Slot,
    queue: TaskQueue,
    selector: selectors.BaseSelector,
    start: Callable[[int], Child],
    listener: Listener,
    memory_limit: int,
) -> None:
    """Take one slot's answer and tell of it; the slot then waits for its next picture, or for a new child."""
    task, slot.task, slot.waiting = slot.task, None, False
    memory = 0
    try:
        answer = slot.child.receive()
        if task is None:
            listener.ready()
        else:
            memory = answer["result"]["memory"]
            slot.starts = 0
            queue.finish(task)
            listener.done(task.picture, answer["result"])
    except ChildDiedError as died:
        _after_death(slot, task, queue, died, listener)
        if queue:
            _replace(slot, selector, start)
        else:
            _retire(slot, selector)
        return
    except OutputError:
        raise
    except (SpinError, ChildInternalError) as reason:
        if task is None:
            raise
        queue.give_up(task)
        listener.failed(task.picture, str(reason))
    if queue and memory > memory_limit:
        _replace(slot, selector, start)
    else:
        slot.waiting = True


def _occupy(slot: Slot, queue: TaskQueue, selector: selectors.BaseSelector) -> None:
    """Give a waiting slot the next picture that it can make now, if there is one; end it when there are no more."""
    if not queue:
        _retire(slot, selector)
    elif task := queue.take():
        slot.task, slot.since, slot.waiting = task, time.monotonic(), False
        picture, kinds = task.picture, task.kinds
        with suppress(ChildDiedError):  # its end is readable too, and is dealt with there
            slot.child.send(
                "picture", variant=picture.variant, index=picture.index, kinds=kinds, keep_render=task.keep_render
            )


def _after_death(
    slot: Slot, task: RenderTask | None, queue: TaskQueue, died: ChildDiedError, listener: Listener
) -> None:
    if task is None:
        if slot.starts >= STARTS_PER_SLOT:
            raise RenderError(f"no worker can be started: {died.found}", do="run spin-usd doctor") from died
    elif task.tries + 1 >= TRIES:
        queue.give_up(task)
        listener.failed(task.picture, f"{died.found}, {TRIES} times")
    else:
        task.tries += 1
        queue.put_back(task)


def _retire(slot: Slot, selector: selectors.BaseSelector) -> None:
    slot.waiting = False
    selector.unregister(slot.child)
    slot.child.close()


def _replace(slot: Slot, selector: selectors.BaseSelector, start: Callable[[int], Child]) -> None:
    selector.unregister(slot.child)
    slot.child.kill()
    slot.child, slot.since = start(slot.number), time.monotonic()
    slot.starts += 1
    selector.register(slot.child, selectors.EVENT_READ, slot)
