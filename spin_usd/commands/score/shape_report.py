"""The report of a scored shape, and the call of the child that scores it."""

from typing import Annotated

from msgspec import UNSET, Meta, Struct, UnsetType

from spin_usd.basics.json_fields import Count, JsonStruct, Positive, Share, Size, Vector, one_of
from spin_usd.commands.score.options import ALIGNMENTS
from spin_usd.processes.call import Call


class ScoredPart(JsonStruct, frozen=True, kw_only=True):
    """How complete the reconstruction of a part is."""

    name: str
    points: Annotated[Count, Meta(description="How many of the true points are on it.")]
    completeness_m: Annotated[Size, Meta(description="Mean distance of these from the reconstruction, metres.")]
    recall: Annotated[Share, Meta(description="Share of these within the threshold.")]


class ScoredViews(JsonStruct, frozen=True, kw_only=True):
    """Rendered views against the export's pictures, within the masks; means over the pictures."""

    pictures: Count
    psnr: Annotated[float | UnsetType, Meta(description="Decibels; absent where a picture is equal.")] = UNSET
    ssim: Annotated[float, Meta(ge=-1, le=1)]


class ScoredAlignment(JsonStruct, frozen=True, kw_only=True):
    """How the reconstruction was laid on the truth: a point x goes to scale R x + t."""

    mode: Annotated[str, one_of(*ALIGNMENTS)]
    scale: Positive
    R: list[Vector]
    t: Annotated[Vector, Meta(description="Metres.")]


class ShapeReport(JsonStruct, frozen=True, kw_only=True, tag_field="schema", tag="shape-report-1"):
    """Output of spin-usd score --shape --json."""

    shape: str
    truth: str
    target: str
    diameter: Annotated[Positive, Meta(description="The largest distance between two points of the target, metres.")]
    alignment: ScoredAlignment
    chamfer_m: Annotated[Size, Meta(description="Mean of accuracy and completeness, metres.")]
    chamfer_percent: Annotated[Size, Meta(description="The same in percent of the diameter.")]
    accuracy_m: Annotated[Size, Meta(description="Mean distance of the reconstruction from the true surface, metres.")]
    completeness_m: Annotated[Size, Meta(description="Mean distance of true points from the reconstruction, metres.")]
    threshold_m: Annotated[Positive, Meta(description="One percent of the diameter, metres.")]
    precision: Annotated[Share, Meta(description="Share of the reconstruction within the threshold of the truth.")]
    recall: Annotated[Share, Meta(description="Share of the true points within the threshold of the reconstruction.")]
    f_score: Annotated[Share, Meta(description="Harmonic mean of precision and recall.")]
    normal_consistency: Annotated[
        Share | UnsetType,
        Meta(description="Mean cosine between normals, without its sign; absent for points without normals."),
    ] = UNSET
    parts: list[ScoredPart]
    views: Annotated[ScoredViews | UnsetType, Meta(description="Absent without views.")] = UNSET
    notes: Annotated[list[str], Meta(description="Notes for the user.")]


class ScoreShape(Struct, frozen=True, kw_only=True):
    """The request to score a shape."""

    shape: str
    truth: str
    align: str | None
    """One of ALIGNMENTS; None for similarity where the pictures come without poses, else none."""
    views: str | None
    """Folder of rendered views; None for none."""


SCORE_SHAPE = Call("spin_usd.commands.score.shape_in_child:score_shape", ScoreShape, ShapeReport)
