"""The child's part of `check`: findings on a stage, as JSON."""

from typing import Any


def stage_findings(*, stage: str) -> list[dict[str, Any]]:
    """Every finding on the stage whose root layer is `stage`."""
    raise NotImplementedError
