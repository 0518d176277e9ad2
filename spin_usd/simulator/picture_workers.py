"""The processes that make pictures on request, and the contents of their log."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from msgspec import structs

from spin_usd.errors import InputError
from spin_usd.processes.call import Call
from spin_usd.processes.child_limits import RENDER_PATIENCE_S, rendering_memory
from spin_usd.processes.deaths import READING_TRIES
from spin_usd.processes.patience import LOOK_S
from spin_usd.processes.processors import share_of
from spin_usd.processes.task import Task, Worker
from spin_usd.scene.effort import CPU
from spin_usd.simulator.array_workers import ArrayTask, ArrayWorkers
from spin_usd.simulator.calls import (
    OPEN_SIMULATOR,
    SAVE_LOG,
    SIMULATE_PICTURE,
    MadeInMemory,
    OpenedSimulator,
    OpenSimulator,
    SimulatePicture,
)
from spin_usd.studio.picture_request import PictureRequest


@dataclass(kw_only=True, eq=False)
class SimulatorTask(ArrayTask[MadeInMemory]):
    """A requested picture; it gets its place in the log when a worker first gets it."""

    call: Call[Any, MadeInMemory] = SIMULATE_PICTURE
    request: SimulatePicture
    within_s: float = RENDER_PATIENCE_S

    @property
    def logged(self) -> int | None:
        """Place in the log; None where there is none."""
        return self.request.number


class PictureWorkers(ArrayWorkers[OpenedSimulator]):
    """Processes with a stage open; one with a log. `opening`: the request that opens it, without the values that differ
    between workers."""

    def __init__(self, opening: OpenSimulator, *, workers: int) -> None:
        """Start the first. Raises the errors of opening the stage."""
        graphics = opening.options.settings.device != CPU
        log = [Path(opening.log.folder)] if opening.log else []
        limit, writes = rendering_memory(graphics=graphics), None if graphics else log
        super().__init__(OPEN_SIMULATOR, self._opening_of, workers=workers, memory=limit, writes=writes)
        self._of, self._log, self._number = opening, opening.log, 0
        self._unsaved: list[tuple[int, PictureRequest]] = []
        self._process: int | None = os.getpid()
        try:
            self.opened = self.opened_content()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """End the workers, and write a log to its end; a second call, or one in another process, does nothing."""
        if self._process != os.getpid():
            return
        try:
            if self._log and self._unsaved:
                self.forget_all()
                self.call(SAVE_LOG, None)
        finally:
            super().close()
            self._process = None

    def ask(
        self,
        request: PictureRequest,
        kinds: tuple[str, ...],
        *,
        first: bool = False,
        recorded: bool = False,
        logged: int | None = None,
    ) -> SimulatorTask:
        """Request a picture, `first` before all others that wait. `recorded`: whether its record is made too;
        `logged`: its place in the log, where it was made before."""
        asked = SimulatePicture(picture=request, kinds=kinds, recorded=recorded, number=logged)
        task = SimulatorTask(request=asked, tries=READING_TRIES)
        self.submit(task, first=first)
        return task

    def step(self, *, within_s: float = LOOK_S) -> None:
        """Give waiting tasks to idle workers, and take results, waiting that long at most. Raises InputError if the
        simulator is closed or belongs to another process."""
        if self._process is None:
            raise InputError("the simulator is closed", do="request pictures while it is open")
        if self._process != os.getpid():
            raise InputError("the simulator belongs to another process", do="open one in each process")
        super().step(within_s=within_s)

    def _opening_of(self, number: int, memory: int) -> OpenSimulator:
        log = structs.replace(self._log, redo=tuple(self._unsaved)) if self._log else None
        return structs.replace(self._of, memory=memory, cpus=share_of(number, self.workers), log=log)

    def _opened(self, answer: OpenedSimulator) -> None:
        self._number = answer.logged

    def _prepare(self, task: Task[Any]) -> None:
        if self._log and isinstance(task, SimulatorTask) and task.logged is None:
            task.request = structs.replace(task.request, number=self._number)

    def _done(self, worker: Worker[Task[Any]], task: Task[Any]) -> None:
        super()._done(worker, task)
        if self._log and isinstance(task, SimulatorTask):
            if task.logged == self._number:
                self._number += 1  # first: handled again, it is not noted twice
                self._unsaved.append((self._number - 1, task.result.request or task.request.picture))
            if task.result.saved:
                self._unsaved.clear()
