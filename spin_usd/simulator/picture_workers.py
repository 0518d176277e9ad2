"""The processes that make pictures on request: asked, waited for, and replaced where they die."""

import os
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from msgspec import convert, to_builtins

from spin_usd.errors import InputError, SpinError
from spin_usd.processes.child import Child, ChildInternalError
from spin_usd.processes.child_calls import modules_of
from spin_usd.processes.child_limits import PATIENCE_S, RENDER_PATIENCE_S, START_PATIENCE_S, rendering_memory
from spin_usd.processes.deaths import READING_TRIES, ChildDiedError, Retries
from spin_usd.processes.patience import LOOK_S
from spin_usd.processes.pool import Answered, Failed, Pool
from spin_usd.processes.processors import share_of
from spin_usd.simulator.live_picture import Arrays
from spin_usd.simulator.picture_request import MadeInMemory, OpenedSimulator, PictureRequest
from spin_usd.simulator.shared_arrays import SharedArrays, new_memory


@dataclass(kw_only=True)
class AskedPicture:
    """A picture that was asked for."""

    number: int
    request: PictureRequest
    kinds: tuple[str, ...]
    recorded: bool = False
    """Whether its record is asked for too."""
    logged: int | None = None
    """Its place in the log, from when it is first given to a worker; None where there is none."""
    retries: Retries = field(default_factory=lambda: Retries(READING_TRIES))


@dataclass(frozen=True, kw_only=True)
class MadePictureArrays:
    """A picture that was made."""

    asked: AskedPicture
    made: MadeInMemory
    arrays: Arrays


@dataclass(frozen=True, kw_only=True)
class PictureLog:
    """Where requests are logged: the folder, and the parts that they may move."""

    log: str
    parts: Sequence[str] = ()


class PictureWorkers:
    """`count` processes with the stage in that `variant` open, as StagePictures has it; one with a `log`.

    opened: what a worker says of the stage.
    """

    def __init__(
        self,
        *,
        stage: str,
        options: Mapping[str, Any],
        variant: str,
        seed: int | None,
        graphics: bool,
        count: int,
        log: PictureLog | None,
    ) -> None:
        """Start the first. Raises what opening the stage does."""
        self._of: dict[str, Any] = {"stage": stage, "options": options, "variant": variant, "seed": seed}
        self._graphics, self._most, self._log = graphics, count, log
        self._pool = Pool[int]()
        self._memories: dict[int, SharedArrays] = {}
        self._waiting: deque[AskedPicture] = deque()
        self._doing: dict[int, AskedPicture] = {}
        self._results: dict[int, MadePictureArrays | Exception] = {}
        self._unwanted: set[int] = set()
        self._count = self._logged = 0
        self._unsaved: list[tuple[int, Any]] = []
        self._process: int | None = os.getpid()
        self.opened = self._start(0)

    def fileno(self) -> int:
        """Readable when a worker says something."""
        return self._pool.fileno()

    def close(self) -> None:
        """End the workers, and write a log to its end; again, and in another process, does nothing."""
        if self._process != os.getpid():
            return
        if self._log and 0 in self._pool and not self._doing:
            self._pool.send(0, "save_log", within_s=PATIENCE_S)
            while 0 in self._pool and 0 not in self._pool.idle():
                deque(self._pool.wait(), maxlen=0)
        for number in self._pool:
            self._pool.kill(number)
        for memory in self._memories.values():
            memory.close()
        self._memories.clear()
        self._doing.clear()
        self._process = None

    def ask(self, request: PictureRequest, kinds: tuple[str, ...], *, first: bool = False, **how: Any) -> int:
        """Ask for a picture, `first` before all others that wait; return its number. `how`: as AskedPicture has it."""
        self._count += 1
        asked = AskedPicture(number=self._count, request=request, kinds=kinds, **how)
        if first:
            self._waiting.appendleft(asked)
        else:
            self._waiting.append(asked)
        return asked.number

    def result(self, number: int) -> MadePictureArrays:
        """Wait for a picture. Raises why it cannot be made."""
        while not self.has(number):
            self.step()
        found = self._results.pop(number)
        if isinstance(found, Exception):
            raise found
        return found

    def has(self, number: int) -> bool:
        """Return whether the picture need not be waited for."""
        return number in self._results

    def forget(self, numbers: Iterable[int]) -> None:
        """Drop pictures that nobody waits for any more."""
        unwanted = {*numbers}
        self._waiting = deque(asked for asked in self._waiting if asked.number not in unwanted)
        self._unwanted |= unwanted & {asked.number for asked in self._doing.values()}
        for number in unwanted:
            self._results.pop(number, None)

    def step(self, *, within_s: float = LOOK_S) -> None:
        """Give idle workers what waits, and take what they have made, waiting for that as long. Raises InputError where
        they are not there any more, or another process's."""
        if self._process is None:
            raise InputError("the simulator is closed", do="ask while it is open")
        if self._process != os.getpid():
            raise InputError("the simulator is another process's", do="open one in each process")
        while len(self._pool) < min(self._most, len(self._waiting) + len(self._doing)):
            try:
                self._start(next(number for number in range(self._most) if number not in self._pool))
            except (SpinError, ChildInternalError) as error:  # such as a stage that is not there any more
                if not self._waiting:
                    break
                self._keep(self._waiting.popleft(), error)
        for number in self._pool.idle():
            if self._waiting:
                self._send(number, self._waiting.popleft())
        for event in self._pool.wait(within_s=within_s):
            match event:
                case Answered(key=number, result=result):
                    self._take(self._doing.pop(number), convert(result, MadeInMemory), self._memories[number])
                case Failed(key=number, reason=ChildDiedError() as died) if number in self._doing:
                    asked = self._doing.pop(number)
                    if asked.retries.may_try_again(died):
                        self._waiting.appendleft(asked)
                    else:
                        self._keep(asked, died)
                case Failed(key=number, reason=reason) if number in self._doing:
                    self._keep(self._doing.pop(number), reason)

    def _send(self, number: int, asked: AskedPicture) -> None:
        self._doing[number] = asked
        if self._log and asked.logged is None:
            asked.logged = self._logged
        where = {"number": asked.logged} if self._log else {}
        self._pool.send(
            number,
            "logged_picture" if self._log else "simulated_picture",
            within_s=RENDER_PATIENCE_S,
            **where,
            request=to_builtins(asked.request),
            kinds=asked.kinds,
            recorded=asked.recorded,
        )

    def _take(self, asked: AskedPicture, made: MadeInMemory, memory: SharedArrays) -> None:
        if self._log and asked.logged == self._logged:
            self._unsaved.append((asked.logged, to_builtins(made.request or asked.request)))
            self._logged += 1
        if made.saved:
            self._unsaved.clear()
        self._keep(asked, MadePictureArrays(asked=asked, made=made, arrays=dict(memory.taken(made.arrays))))

    def _keep(self, asked: AskedPicture, found: MadePictureArrays | Exception) -> None:
        if asked.number in self._unwanted:
            self._unwanted.remove(asked.number)
        else:
            self._results[asked.number] = found

    def _start(self, number: int) -> OpenedSimulator:
        """Start the worker of that number; return what it says of the stage."""
        if number in self._memories:
            self._memories.pop(number).close()
        call = "open_logged" if self._log else "open_simulated"
        more: dict[str, Any] = {**to_builtins(self._log), "redo": self._unsaved} if self._log else {}
        memory = new_memory()
        child = Child(keep_open=(memory,), memory=rendering_memory(graphics=self._graphics), modules=modules_of(call))
        try:
            cpus = share_of(number, self._most)
            answer = child.call(call, within_s=START_PATIENCE_S, **self._of, **more, memory=memory, cpus=cpus)
        except BaseException:
            child.kill()
            os.close(memory)
            raise
        opened = convert(answer, OpenedSimulator)
        self._logged = opened.logged
        self._memories[number] = SharedArrays(memory)
        self._pool.add(number, child)
        return opened
