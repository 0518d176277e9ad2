"""Findings on a stage, which a child reads."""

from pathlib import Path
from typing import Any

from msgspec import convert

from spin_usd.commands.check.answers import StageAnswer
from spin_usd.errors import SpinError
from spin_usd.processes.deaths import ChildDiedError
from spin_usd.processes.shared_calls import Call
from spin_usd.scene.finding import Finding


def stage_call(root: Path) -> Call:
    """Return a child's call about the stage whose root layer is `root`."""
    return Call("check_stage", {"stage": str(root.absolute())})


def stage_answer(result: Any, root: Path) -> StageAnswer:
    """Return the answer in the `result` of stage_call. A stage that kills a child has a finding; another SpinError is
    raised."""
    if isinstance(result, ChildDiedError):
        message = f"cannot be read: {result.found}"
        return StageAnswer(findings=[Finding(code="unreadable", where=str(root), message=message)])
    if isinstance(result, SpinError):
        raise result
    return convert(result, StageAnswer)
