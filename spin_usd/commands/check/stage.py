"""Findings on a stage, which a child reads."""

from pathlib import Path

from spin_usd.basics.progress import Progress
from spin_usd.commands.check.calls import CHECK_STAGE, CheckStage, StageAnswer
from spin_usd.processes.deaths import READING_TRIES, ChildDiedError
from spin_usd.processes.task import Task
from spin_usd.scene.finding import Finding


def stage_task(root: Path, progress: Progress) -> Task[StageAnswer]:
    """Return the task to check the stage whose root layer is `root`."""
    request = CheckStage(stage=str(root.absolute()))
    return Task(call=CHECK_STAGE, request=request, tries=READING_TRIES, progress=progress)


def stage_answer(task: Task[StageAnswer], root: Path) -> StageAnswer:
    """Return the answer of a stage_task. A stage that kills a child has a finding; another SpinError is raised."""
    if isinstance(task.failure, ChildDiedError):
        message = f"cannot be read: {task.failure.found}"
        return StageAnswer(findings=[Finding(code="unreadable", where=str(root), message=message)])
    return task.result
