"""The child's side of `dataset.child`: reads requests from standard input, answers on standard output."""

import ctypes
import json
import os
import signal
import sys
import traceback
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import asdict
from importlib import import_module
from typing import IO, Any

from spin_usd.faults import expected

PR_SET_PDEATHSIG = 1  # linux/prctl.h
SUBJECTS = ("stage", "root", "dataset")  # arguments that name what a call reads


def main() -> None:
    _die_with_parent()
    answers = _private_standard_output()
    _load(sys.argv[1:])
    calls = _calls(lambda *message: _write(answers, {"progress": message}))
    for line in sys.stdin.buffer:
        request = json.loads(line)
        try:
            answer = {"result": calls[request["call"]](**request["arguments"])}
        except Exception as fault:
            answer = {"error": _error(fault, request["arguments"])}
        _write(answers, answer)
    sys.stderr.flush()
    os._exit(0)  # the interpreter's teardown with bpy loaded can hang


def _load(modules: Iterable[str]) -> None:
    """Load these before anything is asked; what one lacks is said when it is asked for."""
    for module in modules:
        with suppress(ImportError):
            import_module(module)


def _error(fault: Exception, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the parent makes the error of again: a SpinError where what was read is at fault, a defect else."""
    where = next((arguments[name] for name in SUBJECTS if name in arguments), None)
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


def _calls(progress: Callable[..., None]) -> dict[str, Callable[..., Any]]:
    """Return the functions that a child can be asked to call, by name. Each imports what it needs when it is called, so
    that a child carries no more than that."""
    worker: Any = None
    stage: Any = None
    measuring: Any = None

    def author(**arguments: Any) -> Any:
        from spin_usd.dataset.author.author import author_stage

        return author_stage(progress=progress, **arguments).as_json()

    def author_sample(**arguments: Any) -> Any:
        from spin_usd.dataset.author.author import author_sample

        return author_sample(progress=progress, **arguments).as_json()

    def augment(**arguments: Any) -> Any:
        from spin_usd.dataset.author.augment import augment_stage

        return augment_stage(progress=progress, **arguments).as_json()

    def parameter_list() -> Any:
        from spin_usd.dataset.author.parameter_list import parameter_list as listed

        return listed()

    def open_plan(**arguments: Any) -> Any:
        nonlocal stage
        from spin_usd.dataset.plan.in_child import open_plan as opened

        described, stage = opened(**arguments)
        return described

    def plan_pictures(**arguments: Any) -> Any:
        from spin_usd.dataset.plan.in_child import plan_pictures as planned

        return planned(progress=progress, opened=stage, **arguments)

    def check_stage(**arguments: Any) -> Any:
        from spin_usd.dataset.check.in_child.stage import stage_findings

        return stage_findings(progress=progress, **arguments)

    def check_picture(**arguments: Any) -> Any:
        from spin_usd.dataset.check.in_child.picture import picture_findings

        return picture_findings(**arguments)

    def cross_picture(**arguments: Any) -> Any:
        from spin_usd.dataset.check.in_child.cross import cross_findings

        return cross_findings(**arguments)

    def diff(**arguments: Any) -> Any:
        from spin_usd.dataset.diff.in_child.compare import compare

        return compare(progress=progress, **arguments)

    def open_worker(**arguments: Any) -> Any:
        nonlocal worker
        from spin_usd.dataset.render.worker import Worker

        worker = Worker(on_open=progress, **arguments)
        return worker.versions

    def open_measuring(**arguments: Any) -> Any:
        nonlocal measuring
        from spin_usd.dataset.measure.worker import MeasuringWorker

        measuring = MeasuringWorker(on_made=progress, **arguments)

    def export(request: Mapping[str, Any]) -> Any:
        from spin_usd.dataset.export.export import export as exported
        from spin_usd.dataset.export.request import ExportRequest

        return asdict(exported(ExportRequest.from_json(request), progress=progress))

    def graphics_processors() -> Any:
        from spin_usd.dataset.process.open_renderer import graphics_processors as found

        return found()

    def measure(what: str, **arguments: Any) -> Any:
        return getattr(measuring, what)(**arguments)

    def picture(**arguments: Any) -> Any:
        return worker.picture(**arguments)

    def reproduce(**arguments: Any) -> Any:
        from spin_usd.dataset.reproduce.in_child import make_again

        return make_again(**arguments)

    def save_models(**arguments: Any) -> Any:
        from spin_usd.dataset.export.models.in_child import save_models as saved

        return saved(progress=progress, **arguments)

    def try_renderer(name: str) -> Any:
        from spin_usd.dataset.process.open_renderer import open_renderer

        renderer = open_renderer(name)
        found = ", ".join(f"{key} {value}" for key, value in renderer.versions().items())
        renderer.close()
        return found

    return {
        "augment": augment,
        "author": author,
        "author_sample": author_sample,
        "check_picture": check_picture,
        "check_stage": check_stage,
        "cross_picture": cross_picture,
        "diff": diff,
        "export": export,
        "graphics_processors": graphics_processors,
        "measure": measure,
        "open_measuring": open_measuring,
        "open_worker": open_worker,
        "open_plan": open_plan,
        "parameter_list": parameter_list,
        "picture": picture,
        "plan_pictures": plan_pictures,
        "reproduce": reproduce,
        "save_models": save_models,
        "try_renderer": try_renderer,
    }


def _die_with_parent() -> None:
    """On Linux the kernel ends this process with its parent; elsewhere the end of standard input does."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != int(os.environ["SPIN_USD_PARENT"]):
            os._exit(0)  # it was gone before the request


def _private_standard_output() -> IO[bytes]:
    """Return the standard output given, for answers alone; what libraries print goes to standard error, and so to the
    log."""
    private = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    return private


def _write(answers: IO[bytes], answer: dict[str, Any]) -> None:
    answers.write(json.dumps(answer).encode() + b"\n")
    answers.flush()


if __name__ == "__main__":
    main()
