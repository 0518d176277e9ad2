"""Compare two variants of a stage: their differences, and the work they cause."""

from pathlib import Path

from msgspec import convert

from spin_usd.basics.progress import Progress
from spin_usd.processes.ask_child import ask_child
from spin_usd.records.difference import DiffReport


def diff(stage: Path, before: str, after: str, *, frames: str | None = None, progress: Progress) -> DiffReport:
    """Return the differences, found by a child process. Raises StageError, InputError."""
    answer = ask_child(
        "diff",
        reads=stage,
        progress=progress,
        stage=str(stage.absolute()),
        before=before,
        after=after,
        frames=frames,
    )
    return convert(answer, DiffReport)
