"""The child's part of `check`: findings on a stage, and a summary of what its pictures show."""

from spin_usd.basics.progress import Progress
from spin_usd.commands.check.calls import CheckStage, StageAnswer
from spin_usd.renderers.embree.face_findings import face_findings
from spin_usd.scene.derived.views import Views
from spin_usd.stage.check.check_stage import check_stage


def stage_findings(request: CheckStage, progress: Progress) -> StageAnswer:
    """Find all that is wrong with a stage."""
    views: list[Views] = []
    found = check_stage(
        request.stage,
        progress=progress,
        target_rule=face_findings,
        on_views=views.append,
    )
    return StageAnswer(findings=list(found), views=views[0] if views else None)
