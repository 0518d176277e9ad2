"""The options of `score`."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.options import Argument, Listening, Option


@dataclass(frozen=True)
class ScoreOptions(Listening):
    """The predictions to score, and the truth."""

    predictions: Annotated[
        str | Path,
        Argument(
            "CSV (filename, qw, qx, qy, qz, x, y, z), JSON poses in the format of SPEED+, or COCO keypoint results."
        ),
    ]
    _: KW_ONLY
    truth: Annotated[str | Path, Option("A dataset's folder, or a pose list in any format that author reads.", "PATH")]
    variants: Annotated[
        str | Sequence[str], Option("Variants of the dataset to score; all if not given.", "NAME,...")
    ] = ()
    target: Annotated[str | None, Option("Target of the dataset; the first if not given.", "NAME")] = None
    annotations: Annotated[
        str | Path | None,
        Option("The COCO file with the image ids of keypoint results; not needed if the ids are names.", "PATH"),
    ] = None
    partial: Annotated[bool, Option("Skip pictures without a usable prediction, instead of refusing the file.")] = False
    out: Annotated[str | Path | None, Option("Also write a page with plots and the worst pictures.", "PATH")] = None
