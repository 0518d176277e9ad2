"""Shards of a dataset put together."""

from collections.abc import Sequence
from pathlib import Path

from spin_usd.api.checked import checked
from spin_usd.dataset.merge import merge as merging
from spin_usd.dataset.merge.report import MergeReport
from spin_usd.progress import Progress, ignore


@checked
def merge(
    shards: str | Path | Sequence[str] | Sequence[Path],
    *,
    out: str | Path,
    copy: bool = False,
    on_progress: Progress | None = None,
) -> MergeReport:
    """Put datasets of one stage, such as the shards of a run, into one. Run again, it goes on.

    The result has the bytes of a single run. Pictures that are still to come do not raise: the report's `missing`
    counts them by shard.

    Args:
        shards: the datasets' folders, which stay as they are.
        out: the folder to put them into, a new one or a dataset of the same stage.
        copy: copy files, instead of hard links to them.
        on_progress: called with what is counted, how many are done and how many there are.

    Raises InputError for datasets of different stages, rendered otherwise, damaged, or with another picture of the same
    name; and OutputError.
    """
    given = [shards] if isinstance(shards, str | Path) else shards
    progress = ignore if on_progress is None else on_progress
    return merging.merge([Path(shard) for shard in given], Path(out), copy=copy, progress=progress)
