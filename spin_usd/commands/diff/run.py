"""Compare two variants of a stage: their differences, and the work they cause."""

from pathlib import Path

from spin_usd.basics.progress import Progress
from spin_usd.commands.diff.calls import COMPARE_VARIANTS, CompareVariants
from spin_usd.processes.ask_child import ask_child
from spin_usd.records.difference import DiffReport


def diff(stage: Path, before: str, after: str, *, frames: str | None = None, progress: Progress) -> DiffReport:
    """Return what differs, as a child process of its own finds. Raises StageError, InputError."""
    request = CompareVariants(stage=str(stage.absolute()), before=before, after=after, frames=frames)
    return ask_child(COMPARE_VARIANTS, request, reads=stage, progress=progress)
