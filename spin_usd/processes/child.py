"""A child process for work that the supervising process must not do: import pxr or bpy, open a stage, render.

A crash ends the child, never the parent.
"""

import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import NoneType
from typing import Any, Self

import psutil
from msgspec import to_builtins

from spin_usd import errors
from spin_usd.basics.faults import expected
from spin_usd.errors import SpinError
from spin_usd.processes.call import Answer, Call, Request
from spin_usd.processes.child_calls import ChildCalls
from spin_usd.processes.child_limits import PATIENCE_S, reading_memory
from spin_usd.processes.child_main import raised_again
from spin_usd.processes.deaths import ChildDiedError, DeathCause
from spin_usd.processes.held_folder import HeldFolder
from spin_usd.processes.patience import LOOK_S, Patience
from spin_usd.processes.readable import readable
from spin_usd.processes.usage import Usage, UsageMeter

# Whatever else is set (PXR_*, OCIO, OSL*, BLENDER_*, LD_*, PYTHONPATH ...) could change a picture or run foreign code.
KEPT_VARIABLES = (
    *("PATH", "HOME", "LANG", "LC_ALL", "TZ", "SYSTEMROOT", "CYCLES_CPU_NO_AVX2"),
    *("CUDA_VISIBLE_DEVICES", "HIP_VISIBLE_DEVICES", "ONEAPI_DEVICE_SELECTOR"),
    *("OPENBLAS_CORETYPE", "OPENBLAS_L2_SIZE"),  # a processor whose own kernels are wrong; the parent has them too
)
HAND_ON = "SPIN_USD_HAND_ON"
"""Variable with the names of further variables for children, separated by commas, at the user's own risk."""
IN_PROCESS = "SPIN_USD_IN_PROCESS"
LOG_TAIL = 2000
READ_BYTES = 1 << 16
RELOAD_LAYERS = Call("spin_usd.stage.usd.layer_file:reload_layers", NoneType, NoneType)
RSS_UNIT = 1 if sys.platform == "darwin" else 1024  # bytes in a unit of ru_maxrss
OUT_OF_MEMORY = ("bad_alloc", "MemoryError", "Cannot allocate memory")  # last output at a memory limit


def in_process() -> bool:
    """Return whether calls to children are answered in this process, as with SPIN_USD_IN_PROCESS=1 in the environment:
    there breakpoints and profilers work."""
    return os.environ.get(IN_PROCESS) == "1"


class Child:
    """One child process; `call` sends a request and waits, `send` and `receive` do the halves.

    It is started fresh (a fork after `import bpy` hangs), with a clean environment, in a session of its own. Messages
    are lines of JSON. It dies with its parent.
    """

    def __new__(cls, **_: Any) -> "Child":
        return super().__new__(ChildHere if in_process() else cls)

    def __init__(
        self,
        *,
        keep_open: tuple[int, ...] = (),
        scratch: Path | None = None,
        memory: int | None = None,
        modules: tuple[str, ...] = (),
        writes: Sequence[Path] | None = (),
    ) -> None:
        """`keep_open`: file descriptors to pass on (a lock). `scratch`: folder for its temporary files, by default one
        that is removed with the child: USD leaves a file there when it crashes. `memory`: limit of its address space in
        bytes (Linux), by default the limit of a child that reads files of strangers. `modules`: modules that it loads
        before the first call. `writes`: the folders in which it may write, beside its temporary files: the kernel
        refuses all others (see confine); None for no limit."""
        self.writes = None if writes is None else tuple(folder.absolute() for folder in writes)
        wanted = {*KEPT_VARIABLES, HAND_ON, *os.environ.get(HAND_ON, "").split(",")}
        environment = {k: v for k, v in os.environ.items() if k in wanted}
        self._temporary = HeldFolder() if scratch is None else None
        own = self._temporary.name if self._temporary else scratch
        environment.update(TMPDIR=str(own), SPIN_USD_PARENT=str(os.getpid()))
        self._heard = bytearray()  # part of an answer that is not yet complete
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the child
        self.process = subprocess.Popen(
            [
                sys.executable,
                "-P",
                "-m",
                "spin_usd.processes.child_main",
                json.dumps(self.writes, default=str),
                *modules,
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            env=environment,
            pass_fds=keep_open,
            start_new_session=True,
        )
        self._memory = reading_memory() if memory is None else memory
        self._limit(self._memory)
        self._meter = UsageMeter(self.process.pid)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None or issubclass(kind, SpinError):
            self.close()
        else:
            self.kill()  # interrupted: its work is not wanted any more

    def may_write(self, folders: Sequence[Path]) -> bool:
        """Return whether it may write in all of these folders."""
        own = self.writes
        return own is None or all(any(each.absolute().is_relative_to(place) for place in own) for each in folders)

    def fileno(self) -> int:
        """Readable when an answer, a progress note or the child's end is there to `receive`."""
        assert self.process.stdout is not None
        return self.process.stdout.fileno()

    def send(self, call: Call[Request, Any], request: Request) -> None:
        """Send the child a call; the answer comes through `receive`."""
        assert self.process.stdin is not None
        message = {"call": call.place, "request": call.encoded(request)}
        try:
            self.process.stdin.write(json.dumps(message).encode() + b"\n")
            self.process.stdin.flush()
        except OSError as broken:
            raise self._died() from broken

    def receive(self, *, within_s: float | None = None) -> Mapping[str, Any]:
        """Receive the next line: {"progress": [...]} or {"result": ...}; raises the error of the child, or
        ChildDiedError.

        A child that takes more than `within_s` seconds for it, as Patience counts them, is ended.
        """
        return returned(self._message(within_s=within_s))

    def received(self) -> Iterator[Mapping[str, Any]]:
        """Yield the results of `receive`, at least one, and more as long as none needs waiting."""
        return map(returned, self.messages())

    def messages(self) -> Iterator[Mapping[str, Any]]:
        """Yield the lines of `received` as the child sent them, with {"error": ...} for an error that it raised."""
        yield self._message()
        while b"\n" in self._heard:
            yield self._message()

    def call(
        self,
        call: Call[Request, Answer],
        request: Request,
        *,
        progress: Callable[..., None] | None = None,
        within_s: float = PATIENCE_S,
    ) -> Answer:
        """Return the child's answer to a call; `within_s` limits the wait for each message."""
        self.send(call, request)
        while "result" not in (message := self.receive(within_s=within_s)):
            if progress:
                progress(*message["progress"])
        return call.decoded(message["result"])

    def close(self) -> None:
        """Let an idle child end by itself."""
        assert self.process.stdin is not None
        try:
            self.process.stdin.close()
            self.process.wait(timeout=10)
        except (OSError, subprocess.TimeoutExpired):
            self.kill()
        self._release()

    def kill(self) -> None:
        """End the child and everything it started, at once."""
        if self.process.poll() is None:
            with suppress(ProcessLookupError):
                os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
        self._release()

    def interrupt(self) -> None:
        """End the child and all its processes, from another thread than the one that waits for its answer: that thread
        learns of the end, and no other may send a call."""
        if self.process.returncode is None:
            with suppress(ProcessLookupError):
                os.killpg(self.process.pid, signal.SIGKILL)

    def usage(self) -> Usage:
        """Measure the processor usage of the child and its processes."""
        return self._meter.look()

    def overdue(self, patience: Patience) -> ChildDiedError | None:
        """End the child if it has run away or hangs; return the error for it."""
        died = patience.exhausted(self.usage(), f"the worker process {self.process.pid}")
        if died:
            self.kill()
        return died

    def outgrown(self, limit: int) -> ChildDiedError | None:
        """End the child if it holds more than `limit` bytes of memory; return the error for it."""
        held = self._held_memory()
        if held <= limit:
            return None
        self.kill()
        gib = f"{held / 2**30:.1f} GiB of memory, more than its {limit / 2**30:.1f} GiB"
        return ChildDiedError(f"the worker process took {gib}", cause=DeathCause.GREW)

    def log(self) -> str:
        """Return the end of the output of the child and its libraries."""
        self._log.seek(0, os.SEEK_END)
        self._log.seek(max(self._log.tell() - LOG_TAIL, 0))
        return self._log.read().decode(errors="replace")

    def _limit(self, memory: int) -> None:
        """Limit the child's address space, and turn off its core files."""
        if hasattr(resource, "prlimit"):
            with suppress(ProcessLookupError):  # it died already; the first call reports it
                resource.prlimit(self.process.pid, resource.RLIMIT_AS, (memory, memory))
                resource.prlimit(self.process.pid, resource.RLIMIT_CORE, (0, 0))

    def _message(self, *, within_s: float | None = None) -> Mapping[str, Any]:
        patience = None if within_s is None else Patience(within_s)
        looked = 0  # no line ends before this byte: an answer may have a hundred megabytes
        while (end := self._heard.find(b"\n", looked)) < 0:
            looked = len(self._heard)
            while patience and not readable(self, LOOK_S):
                if died := self.overdue(patience):
                    raise died
            more = os.read(self.fileno(), READ_BYTES)
            if not more:
                raise self._died()
            self._heard += more
        line = self._heard[:end]
        del self._heard[: end + 1]
        message: Mapping[str, Any] = json.loads(line)
        return message

    def _release(self) -> None:
        if self._temporary is not None:
            self._temporary.cleanup()
        for stream in (self.process.stdout, self.process.stdin):
            if stream and not stream.closed:
                with suppress(OSError):
                    stream.close()

    def _held_memory(self) -> int:
        with suppress(psutil.Error):
            return int(psutil.Process(self.process.pid).memory_info().rss)
        return 0

    def _peak_memory(self) -> int:
        """Wait for the end of the child, and return the most bytes of memory that it held; 0 if unknown."""
        if not hasattr(os, "wait4") or self.process.returncode is not None:
            return 0
        _, status, used = os.wait4(self.process.pid, 0)
        self.process.returncode = os.waitstatus_to_exitcode(status)
        return int(used.ru_maxrss) * RSS_UNIT

    def _died(self) -> ChildDiedError:
        """Wait for the end of the child, which has closed its answers, and return the error for it."""
        most = self._peak_memory()
        self.process.wait()
        code = self.process.returncode
        how = signal.Signals(-code).name if code < 0 else f"exit status {code}"
        if code == -signal.SIGKILL:
            text, cause = "perhaps the system was out of memory", DeathCause.KILLED
        else:
            text = (self.log().strip().splitlines() or ["no output"])[-1]
            grew = most > self._memory / 2 or any(words in self.log() for words in OUT_OF_MEMORY)
            cause = DeathCause.GREW if grew else DeathCause.CRASHED
        return ChildDiedError(f"the worker process ended with {how} ({text})", cause=cause)


class ChildHere(Child):
    """No process: a call is answered here when it is sent. There are no limits, and a crash ends everything."""

    writes = None

    def __init__(self, **_: Any) -> None:
        self._answers: deque[str] = deque()
        self._calls = ChildCalls(lambda *message: self._say({"progress": message}))
        self._readable, self._writable = os.pipe()  # holds a byte while there is something to receive
        self._open = True
        if "pxr" in sys.modules:  # which keeps layers of earlier commands in memory
            self._calls.answer(RELOAD_LAYERS.place, None)

    def fileno(self) -> int:
        return self._readable

    def send(self, call: Call[Request, Any], request: Request) -> None:
        sent = json.loads(json.dumps(call.encoded(request)))
        try:
            answer = {"result": self._calls.answer(call.place, sent)}
        except Exception as fault:
            answer = {"error": raised_again(fault, sent)}
            if expected(fault) is None:  # a defect, to be debugged here
                traceback.print_exc()
        self._say(answer)

    def messages(self) -> Iterator[Mapping[str, Any]]:
        while self._answers:
            yield self._message()

    def close(self) -> None:
        if self._open:
            os.close(self._readable)
            os.close(self._writable)
        self._open = False

    kill = interrupt = close

    def usage(self) -> Usage:
        return UsageMeter(os.getpid()).look()

    def overdue(self, patience: Patience) -> None:
        return None

    def outgrown(self, limit: int) -> None:
        return None

    def log(self) -> str:
        return ""

    def _say(self, message: Mapping[str, Any]) -> None:
        if not self._answers:
            os.write(self._writable, b".")
        self._answers.append(json.dumps(message, default=to_builtins))

    def _message(self, *, within_s: float | None = None) -> Mapping[str, Any]:
        message: Mapping[str, Any] = json.loads(self._answers.popleft())
        if not self._answers:
            os.read(self._readable, 1)
        return message


def returned(message: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a child's result, or raise its error."""
    if "error" in message:
        raise _error(message["error"])
    return message


def _error(raised: Mapping[str, Any]) -> Exception:
    """Make the child's exception again here."""
    kind = getattr(errors, raised["kind"], None)
    if isinstance(kind, type) and issubclass(kind, SpinError):
        error = kind(raised["found"], where=raised["where"], do=raised["do"])
        error.add_note(raised["traceback"])
        return error
    return ChildInternalError(raised["traceback"])


class ChildInternalError(RuntimeError):
    """A defect of ours in the child: its message, with the traceback there as a note."""

    def __init__(self, trace: str) -> None:
        super().__init__(f"internal error in a worker: {trace.strip().splitlines()[-1]}")
        self.add_note(trace)
