"""The files of BOP's scenes. A scene is a variant in a split; its images are numbered by their places in the stage."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spin_usd.dataset.export.bop.entries import depth_numbers, model_entry
from spin_usd.dataset.export.layout.exported_dataset import ExportedDataset
from spin_usd.dataset.export.layout.exported_picture import ExportedPicture
from spin_usd.dataset.export.layout.images import VISIBLE, any_image, own_suffix
from spin_usd.dataset.export.layout.index_file import write_json_file
from spin_usd.dataset.export.layout.layout import FormatOption
from spin_usd.dataset.export.layout.output import LinkedFile, MadeFile
from spin_usd.dataset.export.models.body_models import body_models
from spin_usd.dataset.export.models.model import Model
from spin_usd.dataset.export.models.model_file import ply_bytes
from spin_usd.dataset.export.rectified.rectified_picture import RectifiedPicture
from spin_usd.formats.image_file import write_image

RECTIFY, YES, NO = "rectify", "yes", "no"
RECTIFYING = FormatOption(name=RECTIFY, meaning="whether lens distortion is taken out", default=NO, choices=(YES, NO))
RECTIFY_IT = "take it out of the pictures: --option rectify=yes"


def as_exported(dataset: ExportedDataset, picture: ExportedPicture) -> ExportedPicture:
    """Return the picture without lens distortion where the export's options say so."""
    return RectifiedPicture.of(picture) if dataset.options[RECTIFY] == YES else picture


def scene_number(dataset: ExportedDataset, variant: str) -> int:
    """Return the number of the variant's scene, from 0."""
    return dataset.variants.index(variant)


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
