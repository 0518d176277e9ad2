"""The pictures that a run still has to make, and the order in which workers take them."""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field

from spin_usd.labels.table import LABELS
from spin_usd.picture.kinds import RENDERED
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.processes.deaths import Retries


@dataclass(kw_only=True)
class RenderTask:
    """A picture to make, the kinds of file wanted, whether its render and its labels are kept for others, and its
    retries."""

    picture: PlannedPicture
    kinds: tuple[str, ...]
    keep_render: bool = True
    keep_labels: bool = True
    retries: Retries = field(default_factory=Retries)

    @property
    def needs(self) -> set[str]:
        """The keys of the passes that it needs, which other pictures may need too."""
        return self.label_keys | ({self.picture.radiance} if self.renders else set())

    @property
    def label_keys(self) -> set[str]:
        return {self.picture.label_key(kind) for kind in self.kinds if kind in LABELS}

    @property
    def renders(self) -> bool:
        return not RENDERED.isdisjoint(self.kinds)


class TaskQueue:
    """Tasks in order, of which no two that need the same pass are out at once unless it was made: the second waits
    for the first one's, others go before it."""

    def __init__(self, tasks: Iterable[RenderTask]) -> None:
        self._tasks = deque(tasks)
        self._out: list[RenderTask] = []
        self._made: set[str] = set()

    def __len__(self) -> int:
        return len(self._tasks)

    def clear(self) -> None:
        """Forget the tasks that are not out."""
        self._tasks.clear()

    def take(self) -> RenderTask | None:
        """Take the next task that need not wait; None where all must."""
        being_made = {key for task in self._out for key in task.needs} - self._made
        for place, task in enumerate(self._tasks):
            if not task.needs & being_made:
                del self._tasks[place]
                self._out.append(task)
                return task
        return None

    def finish(self, task: RenderTask) -> None:
        """Note that `task` was done: what it needed is there now."""
        self._out.remove(task)
        self._made |= task.needs

    def give_up(self, task: RenderTask) -> None:
        """Note that `task` has failed: others make what it needed."""
        self._out.remove(task)

    def put_back(self, task: RenderTask) -> None:
        """Put `task` back, which was not done, as the next."""
        self._out.remove(task)
        self._tasks.appendleft(task)
