"""The options of `score`."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.errors import InputError
from spin_usd.options import Argument, Listening, Option

ALIGNMENTS = ("similarity", "rigid", "none")


@dataclass(frozen=True)
class ScoreOptions(Listening):
    """The predicted poses, or the reconstructed shape, to score, and the truth."""

    predictions: Annotated[
        str | Path | None,
        Argument(
            "CSV (filename, qw, qx, qy, qz, x, y, z), JSON poses in the format of SPEED+, or COCO keypoint results; "
            "none with --shape."
        ),
    ] = None
    _: KW_ONLY
    truth: Annotated[
        str | Path,
        Option(
            "A dataset's folder, or a pose list in any format that author reads; with --shape the folder truth of an "
            "export --to unknown_target.",
            "PATH",
        ),
    ]
    shape: Annotated[
        str | Path | None,
        Option("A reconstructed shape to score: a mesh or point cloud, PLY, OBJ, STL or GLB, in metres.", "PATH"),
    ] = None
    align: Annotated[
        str | None,
        Option(
            "With --shape: similarity, rigid or none; if not given, similarity for pictures without poses, else none.",
            "NAME",
            words=lambda incomplete: ALIGNMENTS,
        ),
    ] = None
    views: Annotated[
        str | Path | None,
        Option("With --shape: a folder of rendered views to compare, named after the export's pictures.", "PATH"),
    ] = None
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

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.predictions is None) == (self.shape is None):
            found = "neither predictions nor a shape" if self.shape is None else "predictions and a shape together"
            raise InputError(f"{found} are given", do="give predicted poses, or --shape")
        of_poses = (*self.variants, self.target, self.annotations, self.partial, self.out)
        if self.shape is not None and any(of_poses):
            raise InputError("options of predicted poses are given with a shape", do="leave them out")
        if self.shape is None and (self.align or self.views):
            raise InputError("align or views is given without a shape", do="add --shape")
        if self.align is not None and self.align not in ALIGNMENTS:
            raise InputError(f"align is {self.align!r}", do=f"choose among {', '.join(ALIGNMENTS)}")
