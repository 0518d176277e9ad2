"""The report that `score` returns, and prints with --json."""

from typing import Annotated

from msgspec import UNSET, Meta, UnsetType

from spin_usd.basics.json_fields import Count, JsonStruct, Share, Size


class ScoredErrors(JsonStruct, frozen=True, kw_only=True):
    """How far off the poses of some pictures are."""

    pictures: Count
    scores: Annotated[
        dict[str, Size],
        Meta(
            description="The mean over the pictures of the position's error over the distance, and the attitude's in "
            "radians: speed, of 2019, without thresholds · speedplus: each counts as 0 below 0.002173 and 0.169 "
            "degrees · speedplus_2021: only where both are below, as before 12 January 2023."
        ),
    ]
    position_m: Annotated[dict[str, Size], Meta(description="mean, median and p90: nine of ten are below it; metres.")]
    relative_position: Annotated[dict[str, Size], Meta(description="The same of the error over the distance.")]
    attitude_deg: Annotated[dict[str, Size], Meta(description="The same of the attitude, degrees.")]


class ScoredGroup(ScoredErrors, frozen=True, kw_only=True):
    """Pictures that are alike in something."""

    by: Annotated[str, Meta(description="variant, range, facing, sun or visible.")]
    group: Annotated[str, Meta(description="Which of them, such as 5 to 10 m.")]


class ScoredModel(JsonStruct, frozen=True, kw_only=True):
    """How far the target's own points are off."""

    diameter: Annotated[Size, Meta(description="The largest distance between two points of the target, metres.")]
    add_m: Annotated[dict[str, Size], Meta(description="ADD: mean, median and p90, metres.")]
    add_s_m: Annotated[dict[str, Size], Meta(description="ADD-S, the same.")]
    add_found: Annotated[Share, Meta(description="Share of the pictures whose ADD is below a tenth of the diameter.")]
    add_s_found: Share
    mssd_recall: Annotated[Share, Meta(description="BOP's average recall of MSSD, no symmetries.")]
    mspd_recall: Annotated[Share, Meta(description="BOP's average recall of MSPD, no symmetries.")]


class ScoredPicture(JsonStruct, frozen=True, kw_only=True):
    """One picture's errors."""

    picture: str
    variant: str
    speed: Annotated[Size, Meta(description="Its score without thresholds.")]
    position_m: Size
    attitude_deg: Size


class ScoreReport(JsonStruct, frozen=True, kw_only=True, tag_field="schema", tag="score-report-1"):
    """Output of spin-usd score --json."""

    predictions: str
    truth: str
    all: ScoredErrors
    missing: Annotated[Count, Meta(description="Pictures of the truth without a usable prediction.")]
    groups: list[ScoredGroup]
    model: Annotated[
        ScoredModel | UnsetType, Meta(description="Absent where the truth is a pose list, which has no model.")
    ] = UNSET
    worst: Annotated[list[ScoredPicture], Meta(description="The pictures of the highest scores, the worst first.")]
    notes: Annotated[list[str], Meta(description="Notes for the user.")]
