"""SwissCube: scenes like BOP's in sequences, with lists of images and the corners of the bodies' boxes, in millimetres.

Source: the loader in EPFL's repository wide-depth-range-pose (`dataset.py`, `utils.py`, `configs/swisscube.yaml`).
"""

from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any

import numpy as np

from spin_usd.exchange.bop_scenes import (
    POSES_TO_CAMERA,
    camera_matrix,
    image_file,
    mask_file,
    model_files,
    pose_entry,
    scene_indexes,
    scene_number,
    scene_rows,
)
from spin_usd.exchange.layout.export_format import ExportFile, ExportFormat, IndexRow, Layout, MadeFile, Output
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.index_file import IndexFile, text_lines, write_json_file
from spin_usd.exchange.layout.limits import bodies_told_apart, undistorted
from spin_usd.exchange.layout.models import MILLIMETRES, body_models
from spin_usd.exchange.layout.rectified_picture import RECTIFIED, RECTIFY, RECTIFY_IT, RECTIFYING, YES, as_exported

SPLITS = {"train": "training", "validation": "validation", "test": "testing"}
INDEXES = ("scene_camera", "scene_gt")
SCENE = "000000"  # the one scene of a sequence
FIRST_CENTRE = 0.5  # where the first pixel has its centre: its K has 512 as the middle of 1024 pixels
CONVENTIONS = (
    "Lengths are millimetres: poses, models and the corners of their boxes.",
    POSES_TO_CAMERA,
    "cam_K is in pixels with (0, 0) at the corner of the image, as in the dataset.",
    "A sequence is a variant in a split, and an image has the number of its place in the stage. mask_visib is the "
    "visible part of a body.",
    "swisscube_bbox.json has the eight corners of each model's box along the body's axes, z changing fastest.",
)


def _files(dataset: ExportedDataset, original: ExportedPicture) -> Iterator[Output]:
    picture = as_exported(dataset, original)
    scene = _scene(dataset, picture.split, picture.variant)
    image = image_file(picture, f"{scene}/rgb")
    yield image
    yield IndexRow(path=f"{picture.split}.txt", value=image.path)
    poses = []
    for place, target in enumerate(picture.targets):
        yield mask_file(picture, f"{scene}/mask_visib", place, picture.mask(target.id))
        poses.append(pose_entry(target.id, target.q_cam_body, target.t_cam_body))
    camera = {"cam_K": camera_matrix(picture.camera, first_centre=FIRST_CENTRE)}
    yield from scene_rows(picture, scene, dict(zip(INDEXES, (camera, poses), strict=True)))


def _scene(dataset: ExportedDataset, split: str, variant: str) -> str:
    return f"{split}/seq_{scene_number(dataset, variant):06d}/{SCENE}"


def _indexes(dataset: ExportedDataset) -> Mapping[str, IndexFile]:
    return scene_indexes(dataset, _scene, INDEXES) | {f"{split}.txt": text_lines() for split in dataset.splits}


def _shared(dataset: ExportedDataset) -> Iterator[ExportFile]:
    boxes = []
    for model in body_models(dataset).values():
        ends = np.stack([model.points.min(0), model.points.max(0)]) * MILLIMETRES
        boxes.append([list(corner) for corner in product(*ends.T.tolist())])
    yield MadeFile(path="swisscube_bbox.json", write=write_json_file(boxes))
    yield from model_files(dataset)


def _layout(options: Mapping[str, Any]) -> Layout:
    rectify = options[RECTIFY] == YES
    return Layout(
        needs=("image", "segmentation"),
        conventions=CONVENTIONS + (RECTIFIED if rectify else ()),
        files=_files,
        shared=_shared,
        indexes=_indexes,
        limits=(bodies_told_apart, *(() if rectify else (undistorted(RECTIFY_IT),))),
        splits=SPLITS,
        several=True,
    )


SWISSCUBE = ExportFormat(
    name="swisscube",
    holds="sequences of images, masks and poses, with models",
    layout=_layout,
    options=(RECTIFYING,),
)
