"""Check a stage or a dataset for what is wrong with it."""

from pathlib import Path

from spin_usd.api.checked import checked
from spin_usd.dataset.check import check as checking
from spin_usd.progress import Progress, ignore


@checked
def check(path: str | Path, *, on_progress: Progress | None = None) -> checking.CheckReport:
    """Look for what is wrong with a stage or a dataset: conventions, schemas, digests, label consistency.

    Args:
        path: a stage's root layer, the folder of its dataset.usda, or a dataset's folder.
        on_progress: called with what is counted, how many are done and how many there are.

    Raises InputError where `path` is neither a stage nor a dataset.
    """
    return checking.check(Path(path), progress=ignore if on_progress is None else on_progress)
