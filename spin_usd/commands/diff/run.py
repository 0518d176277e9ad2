"""Compare two variants of a stage: what differs, and which work that makes."""

from pathlib import Path
from typing import Any

from spin_usd.processes.ask_child import ask_child
from spin_usd.progress import Progress


def diff(stage: Path, before: str, after: str, *, frames: str | None = None, progress: Progress) -> dict[str, Any]:
    """Return what `in_child.compare` answers, from a child process of its own. Raises StageError, InputError."""
    answer: dict[str, Any] = ask_child(
        "diff",
        reads=stage,
        progress=progress,
        stage=str(stage.absolute()),
        before=before,
        after=after,
        frames=frames,
    )
    return answer
