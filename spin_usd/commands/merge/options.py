"""The options of `merge`."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.options import Argument, Listening, Option


@dataclass(frozen=True)
class MergeOptions(Listening):
    """The datasets to join, and the folder for them."""

    shards: Annotated[
        str | Path | Sequence[str] | Sequence[Path],
        Argument("Folders of datasets; they stay unchanged.", "SHARD", repeated=True),
    ]
    _: KW_ONLY
    out: Annotated[
        str | Path,
        Option("Folder for all pictures: a new one, or a dataset of the same stage. Another run resumes.", "PATH"),
    ]
    copy: Annotated[bool, Option("Copy files, instead of hard-linking them.")] = False
