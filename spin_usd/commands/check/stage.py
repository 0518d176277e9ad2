"""Findings on a stage, which a child reads."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from msgspec import convert

from spin_usd.errors import SpinError
from spin_usd.processes.deaths import ChildDiedError
from spin_usd.processes.shared_calls import Call
from spin_usd.scene.derived.views import Views
from spin_usd.scene.finding import Finding


def stage_call(root: Path) -> Call:
    """Return what a child is asked about the stage whose root layer is `root`."""
    return Call("check_stage", {"stage": str(root.absolute())})


@dataclass(frozen=True, kw_only=True)
class StageAnswer:
    """The findings on a stage, and what its own pictures show, where they can be read."""

    findings: Sequence[Finding]
    views: Views | None = None

    @classmethod
    def of(cls, result: Mapping[str, Any] | SpinError, root: Path) -> "StageAnswer":
        """Return the answer in the `result` of stage_call. One of which a child dies has a finding; another SpinError
        is raised."""
        if isinstance(result, ChildDiedError):
            message = f"cannot be read: {result.found}"
            return cls(findings=[Finding(code="unreadable", where=str(root), message=message)])
        if isinstance(result, SpinError):
            raise result
        views = convert(result["views"], Views | None)
        return cls(findings=[Finding(**each) for each in result["findings"]], views=views)
