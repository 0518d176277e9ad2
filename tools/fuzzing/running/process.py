"""Run a command as a user does: a process of its own, with the surroundings that the command asks for."""

import contextlib
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import psutil
from fuzzing.running.ended import PATIENCE_S, Command, Ended, Stream, patience

SPIN_USD = (sys.executable, "-P", "-m", "spin_usd.command_line")
SHOWN = 1 << 20  # bytes of what was printed that are read
GRACE_S = 3.0  # for children to end after their parent


def run_process(command: Command, sandbox: Path, *, patience_s: float = PATIENCE_S) -> Ended:
    """Run `command` in the sandbox, and end it with all that it started when the patience is over."""
    began, patience_s = time.monotonic(), patience(patience_s)
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err, _streams(command, out, err) as streams:
        process = subprocess.Popen(
            [*SPIN_USD, *(os.fsencode(argument) for argument in command.arguments)],
            cwd=sandbox / "work" / command.in_folder,
            env=_environment(command, sandbox),
            stdin=subprocess.DEVNULL,
            stdout=streams[0],
            stderr=streams[1],
            start_new_session=True,
            preexec_fn=lambda: _prepare(command),
        )
        code = _waited(process, command, began, patience_s)
        seconds = time.monotonic() - began
        return Ended(code=code, out=_text(out), err=_text(err), seconds=seconds)


def processes_left(sandbox: Path) -> list[str]:
    """End what still runs of a command in this sandbox after it ended; return what they were."""
    until = time.monotonic() + GRACE_S
    while (left := list(_processes_of(sandbox))) and time.monotonic() < until:
        time.sleep(0.05)
    for process in left:
        with contextlib.suppress(psutil.Error):
            process.kill()
    return [f"process {process.pid}" for process in left]


def _waited(process: subprocess.Popen[bytes], command: Command, began: float, patience_s: float) -> int | None:
    for after_s, number in sorted(command.signals):
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(timeout=max(0.0, began + after_s - time.monotonic()))
        if process.poll() is None:
            process.send_signal(number)
    try:
        return process.wait(timeout=max(0.1, began + patience_s - time.monotonic()))
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
        return None


def _processes_of(sandbox: Path) -> Iterator[psutil.Process]:
    """Processes whose environment names this sandbox: children are given TMPDIR."""
    mark = os.fsencode(sandbox) + b"/"
    for process in psutil.process_iter():
        with contextlib.suppress(OSError, psutil.Error):
            if process.pid != os.getpid() and mark in Path(f"/proc/{process.pid}/environ").read_bytes():
                yield process


def _environment(command: Command, sandbox: Path) -> dict[str, str]:
    given = {**os.environ, "HOME": str(sandbox / "home"), "TMPDIR": str(sandbox / "tmp"), "COLUMNS": "120"}
    given |= {name: value for name, value in command.environment.items() if value is not None}
    return {name: value for name, value in given.items() if command.environment.get(name, value) is not None}


def _prepare(command: Command) -> None:
    """In the new process, before spin-usd: closed streams and limits."""
    for number, stream in ((1, command.stdout), (2, command.stderr)):
        if stream == "closed":
            os.close(number)
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    for name, limit in command.limits.items():
        resource.setrlimit(getattr(resource, name), (limit, limit))


@contextmanager
def _streams(command: Command, out: IO[bytes], err: IO[bytes]) -> Iterator[tuple[int, int]]:
    """Descriptors for standard output and error."""
    with contextlib.ExitStack() as opened:
        yield (_descriptor(command.stdout, out, opened), _descriptor(command.stderr, err, opened))


def _descriptor(stream: Stream, kept: IO[bytes], opened: contextlib.ExitStack) -> int:
    if stream == "full":
        return opened.enter_context(Path("/dev/full").open("wb")).fileno()
    if stream == "pipe":
        read, write = os.pipe()
        os.close(read)
        opened.callback(os.close, write)
        return write
    return kept.fileno()


def _text(file: IO[bytes]) -> str:
    file.seek(0)
    return file.read(SHOWN).decode(errors="surrogateescape")
