"""Differences between two variants of a stage, and the report on them."""

from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from spin_usd.basics.json_fields import Count, JsonStruct, one_of

FILE, PRIM, ACTIVE, SELECTION, SCHEMAS, METADATA = "file", "prim", "active", "selection", "schemas", "metadata"
ATTRIBUTE, CONNECTION, RELATIONSHIP = "attribute", "connection", "relationship"


@dataclass(frozen=True, kw_only=True)
class Difference:
    """One thing that differs from a first composition to a second."""

    kind: Annotated[str, one_of(FILE, PRIM, ACTIVE, SELECTION, SCHEMAS, METADATA, ATTRIBUTE, CONNECTION, RELATIONSHIP)]
    where: Annotated[str, Meta(description="A prim's or property's path, or a file.")]
    name: Annotated[str, Meta(description="Of the variant set or the metadata; empty for the others.")] = ""
    before: Annotated[str | None, Meta(description="The value as text; null if missing.")] = None
    after: str | None = None
    before_from: Annotated[str | None, Meta(description="Layer and variants of the strongest opinion.")] = None
    after_from: str | None = None
    samples: Annotated[Count, Meta(description="Number of differing time samples; 0 for constant values.")] = 0
    time_code: Annotated[
        float | None, Meta(description="Of the first sample that differs, which before and after show.")
    ] = None


class ComparedPictures(JsonStruct, frozen=True, kw_only=True):
    """How many pictures both variants have, in how many of them each key differs, and how many only one has."""

    compared: Count
    only_before: Count
    only_after: Count
    geometry: Count
    radiance: Count
    exposure: Count


class DiffReport(JsonStruct, frozen=True, kw_only=True, tag_field="schema", tag="diff-report-1"):
    """Output of spin-usd diff --json. The exit code is 0 whether or not the variants differ."""

    before: Annotated[str, Meta(description="The first variant, as it was given.")]
    after: Annotated[str, Meta(description="The second variant, as it was given.")]
    differences: list[Difference]
    pictures: ComparedPictures
    resampled: Annotated[
        bool, Meta(description="Whether the random samples of each picture differ: noise and back plates.")
    ]
