"""The report that `evidence` returns and writes as evidence.json."""

from typing import Annotated

from msgspec import UNSET, Meta, UnsetType

from spin_usd.basics.json_fields import Count, JsonStruct, Sha256, Share
from spin_usd.scene.finding import ERROR, Finding


class Hole(JsonStruct, frozen=True, kw_only=True):
    """A cell of the domain with too few pictures."""

    cells: Annotated[dict[str, Count], Meta(description="Number of the cell in each dimension, from 0.")]
    bounds: Annotated[
        dict[str, list[float] | str],
        Meta(description="Lower and upper limit, or name; of attitudes latitude_deg and longitude_deg in body axes."),
    ]
    pictures: Annotated[Count, Meta(description="Pictures in the cell.")]


class CellCoverage(JsonStruct, frozen=True, kw_only=True):
    """Coverage of one dimension, or of two together."""

    dimensions: list[str]
    cells: Count
    covered: Annotated[Count, Meta(description="Cells with enough pictures.")]
    share: Share
    counts: Annotated[list[Count], Meta(description="Pictures in each cell; of two dimensions the last runs fastest.")]
    unknown: Annotated[Count, Meta(description="Pictures without a value.")]
    holes: Annotated[list[Hole], Meta(description="Cells with too few pictures, those with the fewest first.")]


class LabelBound(JsonStruct, frozen=True, kw_only=True):
    """Bound of the errors of a label in this set."""

    bound: Annotated[float, Meta(ge=0)]
    unit: str
    reason: str


class Calibrated(JsonStruct, frozen=True, kw_only=True, omit_defaults=True):
    """A property of camera and detector, as measured in pictures of test charts, and as set."""

    unit: str
    description: str
    claimed: Annotated[float, Meta(description="By the settings of the stage.")]
    measured: Annotated[float | UnsetType, Meta(description="Absent where the pictures cannot resolve it.")] = UNSET


class ReproducedPicture(JsonStruct, frozen=True, kw_only=True):
    """A picture that was made again."""

    frame: str
    variant: str
    same: Annotated[bool, Meta(description="Whether every file has the same bytes.")]
    different: Annotated[list[str], Meta(description="Files with other bytes.")]
    versions: Annotated[dict[str, list[str]], Meta(description="Libraries of other versions: recorded, and now.")]


class PictureSources(JsonStruct, frozen=True, kw_only=True):
    """All that the pictures were made from."""

    stages: Annotated[list[Sha256], Meta(description="Hashes of the composed stages.")]
    files: Annotated[dict[str, list[Sha256]], Meta(description="Layers, models and textures: sha256 by name.")]
    versions: Annotated[dict[str, list[str]], Meta(description="Versions of the libraries that made them.")]
    licences: Annotated[dict[str, str], Meta(description="Licences of these libraries, as installed here.")]
    renderers: Annotated[dict[str, Count], Meta(description="Pictures by renderer.")]


class EvidenceReport(
    JsonStruct, frozen=True, kw_only=True, omit_defaults=True, tag_field="schema", tag="evidence-report-1"
):
    """What datasets show of an operational domain, how right their labels are, and what went into them."""

    datasets: list[str]
    title: str
    pictures: Count
    least: Annotated[Count, Meta(description="Pictures that each cell needs.")]
    coverage: list[CellCoverage]
    outside: Annotated[
        dict[str, list[str]],
        Meta(description="Pictures outside the domain, as VARIANT/FRAME, with the dimensions in which they are."),
    ]
    quality: Annotated[
        dict[str, dict[str, float]],
        Meta(description="By dimension: figures of dqm-ml-core, by its own names."),
    ]
    quality_by: Annotated[str, Meta(description="Version of dqm-ml-core.")]
    labels: Annotated[dict[str, LabelBound], Meta(description="Bounds of the errors of each label.")]
    calibration: dict[str, Calibrated]
    reproduced: list[ReproducedPicture]
    findings: Annotated[list[Finding], Meta(description="Findings of check.")]
    sources: PictureSources
    gap: Annotated[
        dict[str, dict[str, float]] | UnsetType,
        Meta(description="Figures of a report of gap: real, ours, fitted, by measure."),
    ] = UNSET
    deviations: Annotated[list[str], Meta(description="Known deviations and limits, a sentence each.")]
    fill: Annotated[str | UnsetType, Meta(description="Specification that was written for the holes.")] = UNSET

    @property
    def wrong(self) -> bool:
        """Whether a finding is an error, or a picture came out differently."""
        return any(each.severity == ERROR for each in self.findings) or not all(each.same for each in self.reproduced)
