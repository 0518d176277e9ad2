"""Compare two variants of a stage: what differs, and which work that makes."""

from pathlib import Path
from typing import Any

from spin_usd.dataset.process.child import STAGE_PATIENCE_S, Child, ChildDiedError, stage_memory
from spin_usd.errors import StageError
from spin_usd.progress import Progress


def diff(stage: Path, before: str, after: str, *, frames: str | None = None, progress: Progress) -> dict[str, Any]:
    """Return what `in_child.compare` answers, from a child process of its own. Raises StageError, InputError."""
    with Child(memory=stage_memory()) as child:
        try:
            answer: dict[str, Any] = child.call(
                "diff",
                stage=str(stage.absolute()),
                before=before,
                after=after,
                frames=frames,
                progress=progress,
                within_s=STAGE_PATIENCE_S,
            )
        except ChildDiedError as died:
            do = "simplify it, or look for what multiplies in it"
            raise StageError(f"cannot be read: {died.found}", where=stage, do=do) from died
    return answer
