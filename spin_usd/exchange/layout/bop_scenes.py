"""The files of BOP's scenes. A scene is a variant in a split; its images are numbered by their places in the stage."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.exchange.layout.body_models import body_models
from spin_usd.exchange.layout.bop_entries import depth_numbers, model_entry
from spin_usd.exchange.layout.exported_dataset import ExportedDataset
from spin_usd.exchange.layout.exported_picture import ExportedPicture
from spin_usd.exchange.layout.images import VISIBLE, any_image, own_suffix
from spin_usd.exchange.layout.index_file import IndexFile, json_object, write_json_file
from spin_usd.exchange.layout.layout import FormatOption
from spin_usd.exchange.layout.model import Model
from spin_usd.exchange.layout.model_file import ply_bytes
from spin_usd.exchange.layout.output import IndexRow, LinkedFile, MadeFile
from spin_usd.exchange.layout.rectified_picture import RectifiedPicture
from spin_usd.formats.arrays.image_file import write_image

RECTIFY, YES, NO = "rectify", "yes", "no"
RECTIFYING = FormatOption(name=RECTIFY, meaning="whether lens distortion is taken out", default=NO, choices=(YES, NO))
RECTIFY_IT = "take it out of the pictures: --option rectify=yes"
POSES_TO_CAMERA = (
    "cam_R_m2c (row by row) and cam_t_m2c take the body's axes to the camera's, which are OpenCV's: x right, y down, z "
    "forward. obj_id is the target's id."
)
RECTIFIED = (
    "Lens distortion is taken out: images are interpolated between four pixels. Labels are those of the nearest pixel, "
    "so outlines of masks are off by up to half a pixel, and what is counted in masks is of these. Poses, models and "
    "what is projected from them are exact. What the lens did not show is black.",
)


def as_exported(dataset: ExportedDataset, picture: ExportedPicture) -> ExportedPicture:
    """Return the picture without lens distortion where the export's options say so."""
    return RectifiedPicture.of(picture) if dataset.options[RECTIFY] == YES else picture


def scene_number(dataset: ExportedDataset, variant: str) -> int:
    """Return the number of the variant's scene, from 0."""
    return dataset.variants.index(variant)


def scene_indexes(
    dataset: ExportedDataset, scene: Callable[[ExportedDataset, str, str], str], names: Sequence[str]
) -> dict[str, IndexFile]:
    """Return the files of these names in every scene; `scene` gives the folder of a split and a variant."""
    folders = sorted({scene(dataset, entry.split, entry.variant) for entry in dataset.entries})
    return {f"{folder}/{name}.json": json_object() for folder in folders for name in names}


def scene_rows(picture: ExportedPicture, folder: str, values: Mapping[str, Any]) -> Iterator[IndexRow]:
    """Yield the picture's entry in each of its scene's files, by their names."""
    for name, value in values.items():
        yield IndexRow(path=f"{folder}/{name}.json", value=(str(image_number(picture)), value))


def image_number(picture: ExportedPicture) -> int:
    """Return the number of the picture in its scene."""
    return picture.picture.index


def image_file(picture: ExportedPicture, folder: str) -> LinkedFile | MadeFile:
    """Return the image, in 8 bits."""
    return any_image(picture, f"{folder}/{image_number(picture):06d}{own_suffix(picture)}")


def depth_file(picture: ExportedPicture, folder: str, scale: float) -> MadeFile:
    """Return depth in whole numbers of `scale` millimetres."""
    path = f"{folder}/{image_number(picture):06d}.png"
    return MadeFile(path=path, write=lambda path: _write_grey(path, depth_numbers(picture.label("depth"), scale)))


def mask_file(picture: ExportedPicture, folder: str, place: int, mask: NDArray[np.bool_]) -> MadeFile:
    """Return the mask (H, W) of the body at that place in the picture's list of poses."""
    path = f"{folder}/{image_number(picture):06d}_{place:06d}.png"
    return MadeFile(path=path, write=lambda path: _write_grey(path, np.where(mask, VISIBLE, 0).astype(np.uint8)))


def model_files(dataset: ExportedDataset) -> Iterator[MadeFile]:
    """Yield the models, and what is measured of them."""
    models = body_models(dataset)
    for number, model in models.items():
        yield MadeFile(path=f"models/obj_{number:06d}.ply", write=partial(_write_model, model))
    said = {str(number): model_entry(model) for number, model in models.items()}
    yield MadeFile(path="models/models_info.json", write=write_json_file(said))


def _write_model(model: Model, path: Path) -> None:
    path.write_bytes(ply_bytes(model))


def _write_grey(path: Path, pixels: NDArray[np.uint8] | NDArray[np.uint16]) -> None:
    write_image(path, pixels, channels=("Y",))
