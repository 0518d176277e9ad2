"""Check a stage or a dataset for what is wrong with it."""

from pathlib import Path

from spin_usd.api.checked import checked
from spin_usd.dataset.check import check as checking
from spin_usd.dataset.repair import repair as repairing
from spin_usd.progress import Note, Progress, ignore, unsaid


@checked
def check(
    path: str | Path, *, repair: bool = False, on_progress: Progress | None = None, on_note: Note | None = None
) -> checking.CheckReport:
    """Look for what is wrong with a stage or a dataset: conventions, schemas, digests, label consistency.

    Args:
        path: a stage's root layer, the folder of its dataset.usda, or a dataset's folder.
        repair: first make again what is missing or damaged in a dataset, from its own stage; the report then says what
            was `repaired`, and what is `unrepaired`.
        on_progress: called with what is counted, how many are done and how many there are.
        on_note: called with what is to be said meanwhile.

    Raises InputError where `path` is neither a stage nor a dataset.
    """
    if repair:
        progress, note = on_progress or ignore, on_note or unsaid
        return repairing.repair(Path(path), progress=progress, note=note)
    return checking.check(Path(path), progress=ignore if on_progress is None else on_progress)
