"""The warm process: runs commands that it reads as lines of JSON, in itself. Started by `warm.py`."""

import functools
import gc
import importlib
import json
import os
import resource
import signal
import sys
from contextlib import redirect_stderr, redirect_stdout, suppress
from io import StringIO
from types import FrameType
from typing import IO, Any

import typer.main

from spin_usd.processes.child import IN_PROCESS

MEMORY = 6 << 30
SHOWN = 1 << 16
TIDIED = 50  # commands after which what they left is collected: as often as that it takes a third of the time
# The modules that commands import when they are called, and that take long.
LOADED = (
    "commands.author.in_child",
    "commands.author.augment",
    "commands.check.run",
    "commands.check.in_child",
    "commands.export.in_child",
    "commands.render.run",
    "commands.render.worker",
    "commands.reproduce.run",
    "planning.in_child",
    "renderers.raycast.renderer",
)


class Hang(BaseException):
    """The alarm rang: no `except Exception` swallows it."""


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
    os.environ[IN_PROCESS] = "1"
    main()
