"""An unknown target: pictures to reconstruct a craft's shape from, and the true shape in a folder of its own.

`frames.json` (UnknownTarget) lists the pictures; `truth/truth.json` (ShapeTruth) describes the true shape beside it, so
that `truth` can be withheld. `spin-usd score --shape` compares a reconstruction with it.
"""

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from msgspec import UNSET, Meta, UnsetType, to_builtins

from spin_usd.basics.json_fields import Count, FileName, JsonStruct, Vector
from spin_usd.exchange.layout.export_format import (
    ExportFile,
    ExportFormat,
    FormatOption,
    IndexRow,
    Layout,
    MadeFile,
    Output,
)
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.images import any_image, mask_image, own_suffix
from spin_usd.exchange.layout.index_file import IndexFile, json_lists, write_json_file
from spin_usd.exchange.layout.limits import bodies_told_apart, views_of_one_target
from spin_usd.exchange.layout.models import Model, body_models
from spin_usd.exchange.layout.rectified_picture import NO, RECTIFIED, RECTIFY, RECTIFYING, YES, as_exported
from spin_usd.exchange.layout.true_shape import (
    FOLDER,
    SURFACE,
    TRUTH,
    ShapeTruth,
    TruePicture,
    measured_shape,
    shape_files,
)

FRAMES, VIEWS = "frames.json", "frames"
MASKS, POSES = "masks", "poses"
CONVENTIONS = (
    f"{FRAMES} lists the pictures: K is in pixels with (0, 0) at the corner of the image; distortion is OpenCV's k1, "
    "k2, p1, p2, k3, or k1 to k4 of its fisheye. Camera axes are OpenCV's: x right, y down, z forward.",
    "sun_cam is the unit vector towards the Sun in camera axes; exposure is the factor from W/m2/sr to full scale; "
    "time_s is seconds since the start. Each is absent where the dataset does not have it.",
    "T_cam_body, 4 x 4, takes the body's axes to the camera's, metres; without poses it is in the truth alone.",
    "A mask is 255 where the target is visible, else 0. With masks=no masks are in the folder truth.",
    "The folder truth is for scoring alone: spin-usd score --shape MESH --truth FOLDER. Withhold it, the contact sheet "
    "and this card from whoever reconstructs: these show labels and distances.",
    *SURFACE,
)


class UnknownView(JsonStruct, frozen=True, kw_only=True, omit_defaults=True):
    """A picture of the target."""

    name: str
    image: FileName
    split: str
    width: Count
    height: Count
    K: Annotated[list[Vector], Meta(description="The camera's matrix, pixels; (0, 0) is the corner of the image.")]
    distortion: Annotated[list[float], Meta(description="As OpenCV orders it.")]
    fisheye: bool = False
    mask: Annotated[FileName | UnsetType, Meta(description="Absent without masks.")] = UNSET
    T_cam_body: Annotated[list[list[float]] | UnsetType, Meta(description="Absent without poses.")] = UNSET
    sun_cam: Annotated[Vector | UnsetType, Meta(description="Unit vector towards the Sun, camera axes.")] = UNSET
    exposure: Annotated[float | UnsetType, Meta(description="Factor from W/m2/sr to full scale.")] = UNSET
    time_s: Annotated[float | UnsetType, Meta(description="Seconds since the start.")] = UNSET


class UnknownTarget(JsonStruct, frozen=True, kw_only=True, tag_field="schema", tag="unknown-target-1"):
    """Pictures to reconstruct a shape from."""

    frames: list[UnknownView]


def _files(dataset: ExportedDataset, original: ExportedPicture) -> Iterator[Output]:
    picture = as_exported(dataset, original)
    record, camera = picture.picture.recorded, picture.camera
    mask = mask_image(picture, _mask_of(dataset, picture.name))
    image = any_image(picture, _image_of(picture))
    appearance = record.appearance
    yield image
    yield mask
    view = UnknownView(
        name=picture.name,
        image=image.path,
        split=picture.split,
        width=camera.width,
        height=camera.height,
        K=camera.matrix.tolist(),
        distortion=list(camera.distortion),
        fisheye=camera.fisheye,
        mask=mask.path if dataset.options[MASKS] == YES else UNSET,
        T_cam_body=picture.target.T_cam_body.tolist() if dataset.options[POSES] == YES else UNSET,
        sun_cam=UNSET if record.sun is UNSET else record.sun.towards_cam,
        exposure=UNSET if appearance is UNSET else appearance.exposure_chosen or appearance.exposure,
        time_s=record.time_s,
    )
    yield IndexRow(path=FRAMES, section=VIEWS, value=to_builtins(view))


def _mask_of(dataset: ExportedDataset, name: str) -> str:
    return f"{'' if dataset.options[MASKS] == YES else f'{FOLDER}/'}masks/{name}.png"


def _image_of(picture: ExportedPicture) -> str:
    return f"images/{picture.name}{own_suffix(picture)}"


def _indexes(dataset: ExportedDataset) -> Mapping[str, IndexFile]:
    return {FRAMES: json_lists({"schema": UnknownTarget.__struct_config__.tag}, [VIEWS])}


def _shared(dataset: ExportedDataset) -> Iterator[ExportFile]:
    yield from shape_files(_own(dataset), FOLDER)
    yield MadeFile(path=f"{FOLDER}/{TRUTH}", write=partial(_write_truth, dataset))


def _own(dataset: ExportedDataset) -> Model:
    return body_models(dataset)[dataset.dataset.targets[dataset.target].id]


def _write_truth(dataset: ExportedDataset, path: Path) -> None:
    truth = ShapeTruth(
        target=dataset.target,
        shape=measured_shape(_own(dataset), dataset.dataset.parts),
        poses=dataset.options[POSES] == YES,
        conventions=list(CONVENTIONS),
        pictures=[_true_picture(dataset, picture) for picture in dataset],
    )
    write_json_file(to_builtins(truth))(path)


def _true_picture(dataset: ExportedDataset, original: ExportedPicture) -> TruePicture:
    picture = as_exported(dataset, original)
    place = picture.target.T_cam_body.tolist()
    mask = _mask_of(dataset, picture.name)
    return TruePicture(name=picture.name, image=_image_of(picture), mask=mask, T_cam_body=place)


def _layout(options: Mapping[str, Any]) -> Layout:
    return Layout(
        needs=("image", "segmentation"),
        conventions=CONVENTIONS + (RECTIFIED if options[RECTIFY] == YES else ()),
        files=_files,
        shared=_shared,
        indexes=_indexes,
        limits=(bodies_told_apart, views_of_one_target),
    )


def _choice(name: str, meaning: str) -> FormatOption:
    return FormatOption(name=name, meaning=meaning, default=YES, choices=(YES, NO))


UNKNOWN_TARGET = ExportFormat(
    name="unknown_target",
    holds="pictures to reconstruct a shape from, and the true shape apart",
    layout=_layout,
    options=(
        _choice(MASKS, "whether masks are given; else they are part of the truth"),
        _choice(POSES, "whether poses are given; else they are part of the truth"),
        RECTIFYING,
    ),
)
