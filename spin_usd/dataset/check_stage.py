"""The child's part of `check`: findings on a stage, as JSON."""

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from spin_usd.stage.check import check_stage


def stage_findings(*, stage: str, progress: Callable[[Any], None]) -> list[dict[str, Any]]:
    """Every finding on the stage whose root layer is `stage`. `progress` is told [done, total]."""
    return [asdict(finding) for finding in check_stage(stage, progress=lambda done, total: progress([done, total]))]
