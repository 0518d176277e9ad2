"""The command lines that most of the corpus uses, and how a trial is written down."""

from collections.abc import Callable, Iterable
from typing import Any

from fuzzing.running.ended import Command, call
from fuzzing.sandbox import Sandbox
from fuzzing.seeds import LABELS, author_arguments
from fuzzing.trial import Trial

INPUTS = ("poses.json", "camera.json", "box.obj", "box.mtl", "texture.png")
RAYCAST = ("--renderer", "raycast", "--workers", "1")


def author(*options: str, **unusual: Any) -> Command:
    """`author` from the usual inputs, or those of the options."""
    return call(*author_arguments(*options), **unusual)


def render(stage: str = "st", out: str = "out", *options: object, **unusual: Any) -> Command:
    """`render` by rays."""
    return call("render", stage, *RAYCAST, "--out", out, *options, **unusual)


def resume(**unusual: Any) -> Command:
    """`render` into the dataset that is there."""
    return render("st", "ds", "--labels", LABELS, **unusual)


def check(path: str, **unusual: Any) -> Command:
    """`check` of a stage or dataset."""
    return call("check", path, **unusual)


def inputs(sandbox: Sandbox) -> None:
    """Put what `author` reads into the sandbox."""
    for name in INPUTS:
        sandbox.take(name)


def dataset(sandbox: Sandbox) -> None:
    """Put a dataset and its stage into the sandbox."""
    sandbox.take("ds")
    sandbox.take("st")


def reads_dataset() -> list[Command]:
    """The commands that read a dataset."""
    return [
        check("ds"),
        resume(),
        call("reproduce", "ds", "img000001"),
        call("export", "ds", "--to", "coco", "--out", "out"),
    ]


def reads_stage(stage: str) -> list[Command]:
    """The commands that read a stage."""
    return [check(stage), call("plan", stage, "--renderer", "raycast")]


def trial(kind: str, name: str, prepare: Callable[[Sandbox], Iterable[Command]], **fields: Any) -> Trial:
    """A trial of the corpus."""
    return Trial(kind=kind, name=name.replace("/", "|"), prepare=prepare, **fields)
