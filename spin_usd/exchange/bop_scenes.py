"""BOP's scenes: their files, and the entries in millimetres: cameras, poses and visibility.

A scene is a variant in a split; its images are numbered by their places in the stage. Source: the format's description
in bop_toolkit (docs/bop_datasets_format.md), and its scripts `calc_gt_info.py` and `calc_model_info.py`, which make
these files of other data sets.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.exchange.layout.export_format import IndexRow, LinkedFile, MadeFile
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.images import VISIBLE, any_image, depth_image, own_suffix
from spin_usd.exchange.layout.index_file import IndexFile, json_object, write_json_file
from spin_usd.exchange.layout.models import MILLIMETRES, Model, body_models, diameter, ply_bytes
from spin_usd.formats.image_file import write_image
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.rotation import matrix_from_quaternion

POSES_TO_CAMERA = (
    "cam_R_m2c (row by row) and cam_t_m2c take the body's axes to the camera's, which are OpenCV's: x right, y down, z "
    "forward. obj_id is the target's id."
)
NO_BOX = [-1, -1, -1, -1]


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
    return depth_image(picture, f"{folder}/{image_number(picture):06d}.png", scale)


def mask_file(picture: ExportedPicture, folder: str, place: int, mask: NDArray[np.bool_]) -> MadeFile:
    """Return the mask (H, W) of the body at that place in the picture's list of poses."""
    path = f"{folder}/{image_number(picture):06d}_{place:06d}.png"
    return MadeFile(path=path, write=partial(_write_mask, mask))


def model_files(dataset: ExportedDataset) -> Iterator[MadeFile]:
    """Yield the models, and their measures."""
    models = body_models(dataset)
    for number, model in models.items():
        yield MadeFile(path=f"models/obj_{number:06d}.ply", write=partial(_write_model, model))
    said = {str(number): model_entry(model) for number, model in models.items()}
    yield MadeFile(path="models/models_info.json", write=write_json_file(said))


def _write_mask(mask: NDArray[np.bool_], path: Path) -> None:
    write_image(path, np.where(mask, VISIBLE, 0).astype(np.uint8), channels=("Y",))


def _write_model(model: Model, path: Path) -> None:
    path.write_bytes(ply_bytes(model))


def camera_matrix(camera: Camera, *, first_centre: float) -> list[float]:
    """Return K, row by row, in pixels whose first has its centre at (first_centre, first_centre)."""
    shift = first_centre - 0.5
    return [camera.fx, 0.0, camera.cx + shift, 0.0, camera.fy, camera.cy + shift, 0.0, 0.0, 1.0]


def pose_entry(number: int, q_cam_body: Float, t_cam_body: Float) -> dict[str, Any]:
    """Return the entry of `scene_gt.json` for the object of that number; t_cam_body in metres."""
    return {
        "cam_R_m2c": matrix_from_quaternion(q_cam_body).ravel().tolist(),
        "cam_t_m2c": (t_cam_body * MILLIMETRES).tolist(),
        "obj_id": number,
    }


def visibility_entry(
    *, visible: NDArray[np.bool_], amodal: NDArray[np.bool_], fraction: float, outline: Float
) -> dict[str, Any]:
    """Return the entry of `scene_gt_info.json` for an object, with its masks (H, W), the visible share of its whole
    silhouette (NaN where that is empty), and pixels (N, 2) with the box of the silhouette, also outside the frame.

    A box is x, y, width and height of BOP's kind: the greatest pixel less the least, so 0 for a single pixel. It is -1,
    -1, -1, -1 if nothing is visible.
    """
    count = int(visible.sum())
    whole = round(count / fraction) if count and fraction > 0 else int(amodal.sum())
    return {
        "bbox_obj": _box_of_silhouette(amodal, outline) if count else NO_BOX,
        "bbox_visib": _box_of_mask(visible) if count else NO_BOX,
        "px_count_all": whole,
        "px_count_valid": int(amodal.sum()),
        "px_count_visib": count,
        "visib_fract": count / whole if whole else 0.0,
    }


def model_entry(model: Model) -> dict[str, float]:
    """Return the entry of `models_info.json`: diameter and box, millimetres. Symmetries are left out, since they are
    unknown."""
    low = model.points.min(0) * MILLIMETRES
    size = np.ptp(model.points, axis=0) * MILLIMETRES
    corner = {f"min_{axis}": float(value) for axis, value in zip("xyz", low, strict=True)}
    sizes = {f"size_{axis}": float(value) for axis, value in zip("xyz", size, strict=True)}
    return {"diameter": diameter(model.hull) * MILLIMETRES, **corner, **sizes}


def _box_of_mask(mask: NDArray[np.bool_]) -> list[int]:
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    return _box(columns[0], rows[0], columns[-1], rows[-1])


def _box_of_silhouette(amodal: NDArray[np.bool_], outline: Float) -> list[int]:
    """Return the box of the silhouette's pixels, as bop_toolkit counts them in its own renders: the mask's (H, W), and
    beyond each side of the frame that it touches, all whose centres lie within the outline's extent. There a tip so
    thin that it lies between pixel centres counts too.

    In the outline's pixels (0, 0) is the corner of the image, so pixel i has its centre half a pixel further, at
    i + 0.5.
    """
    beyond_low, beyond_high = np.ceil(outline.min(0) - 0.5), np.ceil(outline.max(0) - 0.5) - 1
    columns, rows = np.flatnonzero(amodal.any(0)), np.flatnonzero(amodal.any(1))
    low, high = np.array([columns[0], rows[0]]), np.array([columns[-1], rows[-1]])
    end = np.array(amodal.shape[::-1]) - 1
    return _box(
        *np.where(low == 0, np.minimum(low, beyond_low), low),
        *np.where(high == end, np.maximum(high, beyond_high), high),
    )


def _box(left: float, top: float, right: float, bottom: float) -> list[int]:
    return [int(left), int(top), int(right - left), int(bottom - top)]
