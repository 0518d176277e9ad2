"""The options of `merge`."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.options import Argument, Listening, Option


@dataclass(frozen=True)
class MergeOptions(Listening):
    """What is put together, and where."""

    shards: Annotated[
        str | Path | Sequence[str] | Sequence[Path],
        Argument("Datasets' folders, which stay as they are.", "SHARD", repeated=True),
    ]
    _: KW_ONLY
    out: Annotated[
        str | Path,
        Option(
            "The folder to put them into: a new one, or a dataset of the same stage. Run again, it goes on.", "PATH"
        ),
    ]
    copy: Annotated[bool, Option("Copy files; they are linked (hard links) if not given.")] = False
