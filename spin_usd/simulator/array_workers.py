"""Workers whose answers are arrays, which they put into memory that they share with this process."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

from spin_usd.processes.call import Answer, Call
from spin_usd.processes.child import Child
from spin_usd.processes.executor import Executor
from spin_usd.processes.task import Task, Worker
from spin_usd.simulator.live_picture import Arrays
from spin_usd.simulator.shared_arrays import SharedArrays, new_memory

Content = TypeVar("Content")


@dataclass(kw_only=True, eq=False)
class ArrayTask(Task[Answer]):
    """A task whose answer has entries of SharedArrays, named `arrays`."""

    arrays: Arrays = field(default_factory=dict)
    """Arrays by kind, once it is done."""


class ArrayWorkers(Executor[Content]):
    """Does tasks in at most `workers` processes, each with memory of its own for arrays.

    `request`: returns the request of the `opening` call for a worker's number and the descriptor of its memory;
    `limits`: `memory` and `writes` of each, as for Child.
    """

    def __init__(
        self,
        opening: Call[Any, Content],
        request: Callable[[int, int], Any],
        *,
        workers: int = 1,
        **limits: Any,
    ) -> None:
        super().__init__(self._start, workers=workers, opening=opening)
        self._opening, self._request, self._limits = opening, request, limits
        self._memories: dict[int, SharedArrays] = {}

    def close(self) -> None:
        """End the workers at once, and give their memory back."""
        super().close()
        for memory in self._memories.values():
            memory.close()
        self._memories.clear()

    def _start(self, number: int) -> Child:
        if number in self._memories:
            self._memories.pop(number).close()
        memory = new_memory()
        self._memories[number] = SharedArrays(memory)
        child = Child(keep_open=(memory,), modules=(self._opening.module,), **self._limits)
        child.send(self._opening, self._request(number, memory))
        return child

    def _done(self, worker: Worker[Task[Any]], task: Task[Any]) -> None:
        if isinstance(task, ArrayTask):
            task.arrays = dict(self._memories[worker.number].taken(task.result.arrays))
