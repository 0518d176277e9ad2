"""The warm process: runs commands that it reads as lines of JSON, in itself. Started by `warm.py`."""

import functools
import gc
import importlib
import json
import os
import resource
import signal
import sys
from collections.abc import Iterator, Mapping
from contextlib import redirect_stderr, redirect_stdout, suppress
from io import StringIO
from types import FrameType
from typing import IO, Any, Self

import typer.main

from spin_usd.processes import child

MEMORY = 6 << 30
SHOWN = 1 << 16
TIDIED = 50  # commands after which what they left is collected: as often as that it takes a third of the time
# The modules that commands import when they are called, and that take long.
LOADED = (
    "api.author",
    "api.augment",
    "dataset.author.author",
    "dataset.author.augment",
    "dataset.check.check",
    "dataset.check.in_child",
    "dataset.export.export",
    "dataset.plan.in_child",
    "dataset.plan.make_plan",
    "dataset.render.render",
    "dataset.render.worker",
    "dataset.reproduce.reproduce",
    "renderers.raycast.renderer",
)


class Hang(BaseException):
    """The alarm rang: no `except Exception` swallows it."""


class ChildHere:
    """What `Child` does, without a process: calls are done when they are sent, answers go through JSON."""

    def __init__(self, **_: Any) -> None:
        from spin_usd.processes.child_calls import ChildCalls

        self._answers: list[dict[str, Any]] = []
        self._calls = ChildCalls(lambda *said: self._answers.append({"progress": said}))
        self._readable, self._writable = os.pipe()
        self._closed = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __getattr__(self, name: str) -> Any:
        """What `Child` has beyond this, such as `call`, which only sends and receives."""
        if name.startswith("__") or not hasattr(REAL_CHILD, name):
            raise AttributeError(name)
        return getattr(REAL_CHILD, name).__get__(self)

    def fileno(self) -> int:
        return self._readable

    def send(self, call: str, **arguments: Any) -> None:
        from spin_usd.processes.child_main import _error

        try:
            result = self._calls.answer(call, json.loads(json.dumps(arguments)))
            self._answers.append({"result": result})
        except Exception as fault:
            self._answers.append({"error": _error(fault, arguments)})
        os.write(self._writable, b".")

    def receive(self, **_: Any) -> Mapping[str, Any]:
        answer = self._answers.pop(0)
        if not self._answers:
            os.read(self._readable, 1)
        if "error" in answer:
            raise child._error(answer["error"])
        heard: dict[str, Any] = json.loads(json.dumps(answer))
        return heard

    def received(self) -> Iterator[Mapping[str, Any]]:
        while self._answers:
            yield self.receive()

    def close(self) -> None:
        if not self._closed:
            os.close(self._readable)
            os.close(self._writable)
            self._closed = True

    kill = close


def main() -> None:
    answers = _private_standard_output()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    signal.signal(signal.SIGALRM, _ring)
    typer.main.get_command = functools.cache(typer.main.get_command)  # it takes longer than a refusal
    for name in LOADED:
        importlib.import_module(f"spin_usd.{name}")
    gc.collect()
    gc.freeze()  # what is loaded need not be looked through after each command
    _answer(answers, {})
    for number, line in enumerate(sys.stdin.buffer):
        _answer(answers, _ended(json.loads(line)))
        if number % TIDIED == 0:
            gc.collect()
            gc.freeze()


def _ended(request: dict[str, Any]) -> dict[str, Any]:
    """The exit code and what was printed; None for a hang."""
    from spin_usd.command_line import run

    os.chdir(request["folder"])
    sys.argv = ["spin-usd", *request["arguments"]]
    out, err, code = StringIO(), StringIO(), None
    signal.setitimer(signal.ITIMER_REAL, request["patience_s"])
    try:
        with redirect_stdout(out), redirect_stderr(err):
            run()
    except SystemExit as ended:
        code = ended.code
    except Hang:
        pass
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
    with suppress(OSError):
        os.chdir("/")
    return {"code": code, "out": out.getvalue()[-SHOWN:], "err": err.getvalue()[-SHOWN:]}


def _ring(_: int, frame: FrameType | None) -> None:
    raise Hang


def _private_standard_output() -> IO[bytes]:
    private = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    return private


def _answer(answers: IO[bytes], answer: dict[str, Any]) -> None:
    answers.write(json.dumps(answer).encode() + b"\n")
    answers.flush()


if __name__ == "__main__":
    REAL_CHILD = child.Child
    child.Child = ChildHere  # type: ignore[misc, assignment]
    main()
