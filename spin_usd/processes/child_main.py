"""The program of a child process: it reads requests from standard input, and answers them on standard output."""

import ctypes
import json
import os
import signal
import sys
import traceback
from collections.abc import Iterable
from contextlib import suppress
from importlib import import_module
from importlib.util import cache_from_source
from pathlib import Path
from typing import IO, Any

from msgspec import to_builtins

from spin_usd.basics.faults import expected
from spin_usd.processes.child_calls import ChildCalls
from spin_usd.processes.confine import confine_writing

PACKAGES = Path(__file__).parents[2]
PR_SET_PDEATHSIG = 1  # linux/prctl.h
SUBJECTS = ("stage", "root", "dataset")  # fields of a request that name the input of a call


def main() -> None:
    _die_with_parent()
    answers = _private_standard_output()
    folders, modules = json.loads(sys.argv[1]), sys.argv[2:]
    if folders is not None:
        _keep_compiled(modules)
        confine_writing(folders)  # before a library starts threads: those that run already are not confined
    _load(modules)
    calls = ChildCalls(lambda *message: _write(answers, {"progress": message}))
    for line in sys.stdin.buffer:
        request = json.loads(line)
        try:
            answer = {"result": calls.answer(request["call"], request["request"])}
        except Exception as fault:
            answer = {"error": raised_again(fault, request["request"])}
        _write(answers, answer)
    sys.stderr.flush()
    os._exit(0)  # the interpreter's teardown with bpy loaded can hang


def _load(modules: Iterable[str]) -> None:
    """Load these before the first call; a module that fails to load is reported when it is called."""
    for module in modules:
        with suppress(ImportError):
            import_module(module)


def _keep_compiled(modules: Iterable[str]) -> None:
    """Let a copy of this process load the modules if Python has never compiled one of ours, and keep what it compiles:
    a confined process cannot, and would do it again at each start."""
    sources = [
        source for each in modules if (source := PACKAGES.joinpath(*each.split(".")).with_suffix(".py")).exists()
    ]
    if any(not Path(cache_from_source(str(each))).exists() and os.access(each.parent, os.W_OK) for each in sources):
        if (copy := os.fork()) == 0:
            _load(modules)
            os._exit(0)
        os.waitpid(copy, 0)


def raised_again(fault: Exception, request: Any) -> dict[str, Any]:
    """Return the error for the parent to raise again: a SpinError where the input is at fault, else a defect."""
    where = next((request[name] for name in SUBJECTS if name in request), None) if isinstance(request, dict) else None
    error = expected(fault, where)
    if error is None:
        return {"kind": type(fault).__name__, "traceback": traceback.format_exc()}
    return {
        "kind": type(error).__name__,
        "found": error.found,
        "where": None if error.where is None else str(error.where),
        "do": error.do,
        "traceback": traceback.format_exc(),
    }


def _die_with_parent() -> None:
    """On Linux the kernel ends this process with its parent; elsewhere the end of standard input does."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != int(os.environ["SPIN_USD_PARENT"]):
            os._exit(0)  # it was gone before the request


def _private_standard_output() -> IO[bytes]:
    """Return the standard output given, for answers alone; the output of libraries goes to standard error, and so to
    the log."""
    private = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    return private


def _write(answers: IO[bytes], answer: dict[str, Any]) -> None:
    answers.write(json.dumps(answer, default=to_builtins).encode() + b"\n")
    answers.flush()


if __name__ == "__main__":
    main()
