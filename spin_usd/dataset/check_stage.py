"""The child's part of `check`: findings on a stage, as JSON."""

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from spin_usd.dataset.check_faces import face_findings
from spin_usd.stage.check import check_stage


def stage_findings(*, stage: str, progress: Callable[[Any], None]) -> list[dict[str, Any]]:
    """Every finding on the stage whose root layer is `stage`. `progress` is told [done, total]."""
    found = check_stage(stage, progress=lambda done, total: progress([done, total]), target_rule=face_findings)
    return [asdict(finding) for finding in found]
