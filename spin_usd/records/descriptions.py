"""Descriptions in the folders that we write: dataset.json, export.json and gallery.json; and tags.json."""

from typing import Annotated, Any

from msgspec import UNSET, Meta, UnsetType, field

from spin_usd.basics.json_fields import FileName, Id, JsonStruct, Number, PictureName, Sha256, TagName, Vector

AtLeastOne = Annotated[int, Meta(ge=1)]


class OriginFile(JsonStruct, frozen=True, kw_only=True):
    """A file that a stage was authored from."""

    name: str
    sha256: str


class StageOrigin(JsonStruct, frozen=True, kw_only=True):
    """Sources of the stage for author; of another stage only its root layer's name."""

    inputs: Annotated[dict[str, OriginFile] | UnsetType, Meta(description="Files, by their roles.")] = UNSET
    options: Annotated[
        dict[str, str | int | float | list[int | float]] | UnsetType,
        Meta(
            description="Options of author that change pictures: seed, units_per_metre, prim, channels, sun_direction, "
            "sun_from_target."
        ),
    ] = UNSET
    root: str | UnsetType = UNSET


class StageEntry(JsonStruct, frozen=True, kw_only=True):
    """The stage that a dataset shows."""

    root: Annotated[FileName, Meta(description="The root layer, relative to the dataset.")]
    origin: Annotated[
        StageOrigin | UnsetType,
        Meta(
            description="A stage of another origin, by files' sha256 and options, is not rendered into the dataset "
            "unless requested."
        ),
    ] = UNSET
    hashes: Annotated[dict[str, Sha256], Meta(description="Composed content, by variant.")]


class TargetEntry(JsonStruct, frozen=True, kw_only=True):
    """A target, as all pictures share it."""

    id: Id
    name: str
    path: Annotated[str, Meta(description="Its prim.")]
    size: Annotated[Vector, Meta(description="Edges of its bounding box along its own axes, metres.")]
    box: Annotated[
        list[Vector],
        Meta(min_length=2, max_length=2, description="Its least and largest coordinates in its own axes, metres."),
    ]
    keypoints: Annotated[dict[str, Vector], Meta(description="Its named points in its own axes, metres.")]


class PartEntry(JsonStruct, frozen=True, kw_only=True):
    """A part of a body."""

    path: str
    class_: str = field(name="class")
    name: str
    target: Annotated[
        int,
        Meta(ge=0, description="Id of its target; 0 for geometry of no target."),
    ]
    materials: Annotated[
        list[str], Meta(description="The names of its materials in the first picture of the stage without a variant.")
    ] = field(default_factory=list)


class DatasetDescription(JsonStruct, frozen=True, kw_only=True, tag_field="schema", tag="dataset-1"):
    """A spin_usd dataset."""

    stage: StageEntry
    targets: Annotated[
        list[TargetEntry],
        Meta(
            min_length=1,
            description="The targets in order of their ids, which are the numbers in the label instance.",
        ),
    ]
    parts: Annotated[dict[Number, PartEntry], Meta(description="Segmentation ids of all bodies; 0 is nothing.")]
    classes: Annotated[
        dict[Number, str] | UnsetType,
        Meta(description="Ids of the parts' classes, from 1 in alphabetic order; 0 is nothing."),
    ] = UNSET
    variants: Annotated[list[str], Meta(min_length=1)]
    frames: Annotated[AtLeastOne, Meta(description="Frames of the stage: so many pictures has each variant.")]
    files: Annotated[dict[str, str], Meta(description="Content of each kind of file.")]


class ExportDescription(JsonStruct, frozen=True, kw_only=True, tag_field="schema", tag="export-1"):
    """Contents of an export of a spin_usd dataset."""

    format: Annotated[str, Meta(description="The format's name.")]
    options: Annotated[dict[str, Any], Meta(description="Options of the format, by name.")]
    dataset: Annotated[
        Sha256,
        Meta(description="Digest of the dataset's parts and keypoints and of the records of the pictures, in order."),
    ]
    target: Annotated[str, Meta(description="The target's name, where the format holds one.")]
    splits: Annotated[dict[str, float], Meta(description="The share of each split, by the format's name for it.")]
    seed: Annotated[int, Meta(description="Seed that assigns poses to splits.")]
    pictures: AtLeastOne
    spin_usd: Annotated[str, Meta(description="Version.")]
    complete: Annotated[bool, Meta(description="Whether all files exist; false for an interrupted export.")]


class GalleryDescription(JsonStruct, frozen=True, kw_only=True, tag_field="schema", tag="gallery-1"):
    """The folder of a page that spin-usd show wrote."""

    dataset: Annotated[str, Meta(description="The name of the dataset's folder.")]
    spin_usd: Annotated[str, Meta(description="Version.")]


class Tags(JsonStruct, frozen=True, kw_only=True, tag_field="schema", tag="tags-1"):
    """The tags that people gave to pictures of a dataset. It lies in the dataset's folder as tags.json."""

    dataset: Annotated[str, Meta(description="The name of the dataset's folder.")]
    tags: Annotated[
        dict[TagName, list[PictureName]],
        Meta(description="The pictures of each tag, as VARIANT/FRAME."),
    ]
