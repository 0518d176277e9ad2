"""The child's part of `check`: findings on a stage, as JSON."""

from dataclasses import asdict
from typing import Any

from spin_usd.stage.check import check_stage


def stage_findings(*, stage: str) -> list[dict[str, Any]]:
    """Every finding on the stage whose root layer is `stage`."""
    return [asdict(finding) for finding in check_stage(stage)]
