"""The options of `score`."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.options import Argument, Listening, Option


@dataclass(frozen=True)
class ScoreOptions(Listening):
    """Which predictions are scored, and against what."""

    predictions: Annotated[
        str | Path,
        Argument(
            "CSV (filename, qw, qx, qy, qz, x, y, z), JSON as SPEED+ lists poses, or keypoint results as COCO has them."
        ),
    ]
    _: KW_ONLY
    truth: Annotated[str | Path, Option("A dataset's folder, or a pose list in any format that author reads.", "PATH")]
    variants: Annotated[
        str | Sequence[str], Option("The dataset's variants that are scored; all if not given.", "NAME,...")
    ] = ()
    target: Annotated[str | None, Option("Which target of the dataset; the first if not given.", "NAME")] = None
    annotations: Annotated[
        str | Path | None,
        Option("The COCO file whose image ids keypoint results have; not needed for ids that are names.", "PATH"),
    ] = None
    partial: Annotated[
        bool, Option("Score the pictures that have a usable prediction; others are refused if not given.")
    ] = False
    out: Annotated[str | Path | None, Option("Also write a page with plots and the worst pictures.", "PATH")] = None
