"""The missing pictures of a run, and the order in which workers take them."""

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from spin_usd.commands.render.calls import MAKE_PICTURE, MadePicture, MakePicture
from spin_usd.labels.table import LABELS
from spin_usd.picture.kinds import RENDERED
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.processes.call import Call
from spin_usd.processes.child_limits import PATIENCE_S
from spin_usd.processes.task import Task, Worker


@dataclass(kw_only=True, eq=False)
class RenderTask(Task[MadePicture]):
    """A picture to make."""

    call: Call[Any, MadePicture] = MAKE_PICTURE
    request: Any = None
    picture: PlannedPicture
    kinds: tuple[str, ...]
    """Wanted kinds of file."""
    keep_render: bool = True
    """Whether the cache stores the render for other pictures."""
    keep_labels: bool = True
    """Whether the cache stores the labels for other pictures."""

    @property
    def needs(self) -> set[str]:
        """Keys of the passes that it may share with other pictures."""
        return self.label_keys | ({self.picture.radiance} if self.renders else set())

    @property
    def label_keys(self) -> set[str]:
        return {self.picture.label_key(kind) for kind in self.kinds if kind in LABELS}

    @property
    def renders(self) -> bool:
        return not RENDERED.isdisjoint(self.kinds)


class TaskQueue:
    """Tasks in order. Two tasks that need the same pass are not in work at once unless the pass is made: the second
    waits for the first, and others go before it."""

    def __init__(self, tasks: Iterable[RenderTask], limit_s: Callable[[RenderTask], float]) -> None:
        """`limit_s`: returns the seconds that a picture may take once its stage is open."""
        self._tasks, self._limit_s = deque(tasks), limit_s
        self.closed = False
        self._out: list[RenderTask] = []
        self._made: set[str] = set()

    def __len__(self) -> int:
        return len(self._tasks)

    def close(self) -> None:
        """Drop the tasks that are not in work, and tasks that are put back."""
        self.closed = True
        self._tasks.clear()

    def take(self, worker: Worker[RenderTask]) -> RenderTask | None:
        """Take the next task that need not wait; None if all must."""
        being_made = {key for task in self._out for key in task.needs} - self._made
        for place, task in enumerate(self._tasks):
            if not task.needs & being_made:
                del self._tasks[place]
                self._out.append(task)
                return self._prepared(task, worker)
        return None

    def finish(self, task: RenderTask) -> None:
        """Note that `task` was done: its passes are in the cache now."""
        self._out.remove(task)
        self._made |= task.needs

    def give_up(self, task: RenderTask) -> None:
        """Note that `task` has failed: others make its passes."""
        self._out.remove(task)

    def put_back(self, task: RenderTask) -> None:
        """Put the unfinished `task` back, as the next."""
        self._out.remove(task)
        if not self.closed:
            self._tasks.appendleft(task)

    def opened(self, worker: Worker[RenderTask], task: RenderTask) -> float:
        """Note that the worker has opened the stage of the task; return the timeout of the task, seconds."""
        worker.holds, task.within_s = task.picture.variant, self._limit_s(task)
        return task.within_s

    def _prepared(self, task: RenderTask, worker: Worker[RenderTask]) -> RenderTask:
        picture = task.picture
        task.within_s = self._limit_s(task) if worker.holds == picture.variant else PATIENCE_S
        task.request = MakePicture(
            variant=picture.variant,
            index=picture.index,
            kinds=task.kinds,
            keep_render=task.keep_render,
            keep_labels=task.keep_labels,
        )
        return task
