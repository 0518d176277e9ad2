"""The child's part of `check`: findings on a stage and what its pictures show, as JSON."""

from dataclasses import asdict
from typing import Any

from msgspec import to_builtins

from spin_usd.progress import Progress
from spin_usd.renderers.embree.face_findings import face_findings
from spin_usd.scene.derived.views import Views
from spin_usd.stage.check.check_stage import check_stage


def stage_findings(*, stage: str, progress: Progress) -> dict[str, Any]:
    """Return every finding on the stage whose root layer is `stage`, and "views": what its own pictures show, None
    where they cannot be read."""
    views: list[Views] = []
    found = check_stage(
        stage,
        progress=progress,
        target_rule=face_findings,
        on_views=views.append,
    )
    return {
        "findings": [asdict(finding) for finding in found],
        "views": to_builtins(views[0]) if views else None,
    }
