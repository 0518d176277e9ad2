"""The report that `gap` returns and writes as gap.json."""

from typing import Annotated

from msgspec import UNSET, Meta, UnsetType

from spin_usd.basics.json_fields import Count, JsonStruct, Span, Vector

INTERVAL = "95 % interval by drawing the pictures again"


class GapMeasure(JsonStruct, frozen=True, kw_only=True, omit_defaults=True):
    """A measure over all pictures: medians. What cannot be measured is absent."""

    unit: str
    description: str
    real: Annotated[float | UnsetType, Meta(description="Of the real pictures.")] = UNSET
    ours: Annotated[float | UnsetType, Meta(description="Of ours, or of both together, before any fit.")] = UNSET
    fitted: Annotated[float | UnsetType, Meta(description="The same after all fits.")] = UNSET
    interval: Annotated[
        Span | UnsetType,
        Meta(description=f"{INTERVAL}: of `real`; without it, of `fitted`, or of `ours` if nothing is fitted."),
    ] = UNSET
    gap: Annotated[float | UnsetType, Meta(description="Ours minus real, picture by picture, before any fit.")] = UNSET
    gap_interval: Annotated[Span | UnsetType, Meta(description=INTERVAL)] = UNSET
    fitted_gap: Annotated[float | UnsetType, Meta(description="The same after all fits.")] = UNSET
    fitted_gap_interval: Annotated[Span | UnsetType, Meta(description=INTERVAL)] = UNSET
    steps: Annotated[dict[str, float] | UnsetType, Meta(description="After each fit: light, camera, surface.")] = UNSET


class GapPart(JsonStruct, frozen=True, kw_only=True):
    """A part of the target, in all pictures that show enough of it."""

    pictures: Count
    correlation: GapMeasure
    wasserstein: GapMeasure


class GapLight(JsonStruct, frozen=True, kw_only=True):
    """A light of a picture's fit."""

    name: str
    strength: Annotated[
        float,
        Meta(
            description="Irradiance at the target's centre, W/m2, about; of the stage's own lights a factor on their "
            "strength."
        ),
    ]
    interval: Annotated[Span, Meta(description="95 % interval by drawing pieces of the picture again.")]
    share: Annotated[float, Meta(description="Share of the light on the target's pixels that comes from it.")]
    direction: Annotated[Vector, Meta(description="From the target's centre to the light, camera axes.")]
    distance: Annotated[float, Meta(ge=0, description="Metres; 0 for a Sun.")]


class GapPicture(JsonStruct, frozen=True, kw_only=True):
    """A pair."""

    name: str
    real: Annotated[dict[str, float], Meta(description="Measures of the real picture, by the names in summary.")]
    ours: dict[str, float]
    fitted: Annotated[dict[str, float], Meta(description="Measures of our picture after all fits; empty without.")]
    silhouette: Annotated[
        dict[str, float],
        Meta(description="Offsets of the real picture's edges from the labels': median and spread in pixels, edges."),
    ]
    lights: list[GapLight]
    notes: list[str]


class GapParameter(JsonStruct, frozen=True, kw_only=True):
    """A fitted number."""

    value: float
    interval: Annotated[
        Span | UnsetType, Meta(description=f"{INTERVAL}, of at least three; of a JPEG quality its neighbours tried.")
    ] = UNSET
    unit: str


class GapFit(JsonStruct, frozen=True, kw_only=True):
    """A fit over all pictures."""

    parameters: Annotated[dict[str, GapParameter], Meta(description="Empty for the light, which pictures have.")]
    explained: Annotated[
        float | UnsetType, Meta(description="Median share of the squared signal on the target that the light explains.")
    ] = UNSET
    seconds: Annotated[float, Meta(ge=0, description="Time it took, per picture.")]


class GapReport(JsonStruct, frozen=True, kw_only=True, tag_field="schema", tag="gap-report-1"):
    """Measures of real pictures beside ours, and fits. Grey is in steps of 8 bits, whatever the files' depth."""

    real: str
    stage: str
    pictures: list[GapPicture]
    parts: dict[str, GapPart]
    summary: dict[str, GapMeasure]
    fits: Annotated[dict[str, GapFit], Meta(description="By name: light, camera, surface, in this order.")]
    fitted_stage: Annotated[str | UnsetType, Meta(description="Root layer of the stage with the fits.")] = UNSET
    left_out: Annotated[dict[str, str], Meta(description="Pictures that could not be compared, and why.")]
    seconds: Annotated[float, Meta(ge=0, description="Time of all measures without fits, per picture.")]
    notes: list[str]
