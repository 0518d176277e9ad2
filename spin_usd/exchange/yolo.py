"""YOLO as Ultralytics reads it: a text file of boxes, outlines or keypoints beside each image.

Source: the documentation of Ultralytics' data set formats for detection, segmentation and pose, and its file
`ultralytics/data/utils.py`.
"""

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from spin_usd.basics.arrays import Float
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
from spin_usd.exchange.layout.images import any_image, own_suffix
from spin_usd.exchange.layout.index_file import IndexFile, json_list, write_text_file
from spin_usd.exchange.layout.limits import bodies_told_apart, has_keypoints
from spin_usd.exchange.layout.masks import joined, outlines
from spin_usd.exchange.speedplus import pose_row
from spin_usd.reading.pictured_target import PicturedTarget

DETECT, SEGMENT, POSE = "detect", "segment", "pose"
POSES = "poses.json"
SPLITS = {"train": "train", "validation": "val", "test": "test"}
VISIBILITY = {"visible": 2, "self-occluded": 1, "occluded": 1}
"""A keypoint's third number by its state: 2 visible, 1 hidden; 0, which all others have, is not labelled."""
CONVENTIONS = (
    "All coordinates are shares of the image's width and height, (0, 0) being the corner of the image and (1, 1) the "
    "one opposite.",
    "A line of labels is a target: its class, which is its id less 1, then x and y of the middle, width and height of "
    "the box around its visible pixels.",
    "With task=segment its outline stands in place of the box: the corners of one closed line along the edges of its "
    "visible pixels. Pieces that lie apart, and holes, are joined by bridges of no width.",
    "With task=pose its keypoints follow the box, each x, y and 2 where visible, 1 where hidden by the target itself "
    "or by another body; 0 0 0 where out of the frame or behind the camera.",
    "A target of which nothing is visible has no line. The lens distortion is in the images and in all labels.",
    "poses.json has the poses, which YOLO's labels do not hold, in the form of SPEED+.",
    "There is no flip_idx, for a mirrored craft is another craft: train with fliplr=0.",
    "Ultralytics trains with a train and a validation split, and data.yaml names the existing ones.",
)


def box_numbers(box: Float, size: Float) -> list[float]:
    """Return x and y of the middle, width and height of the box x0, y0, x1, y1 in an image of that `size`."""
    low, high = box[:2] / size, box[2:] / size
    return [*((low + high) / 2).tolist(), *(high - low).tolist()]


def keypoint_numbers(target: PicturedTarget, size: Float, count: int) -> list[float]:
    """Return x, y and how visible it is of each keypoint, zeros up to `count` of them."""
    found = []
    for point, state in zip(target.keypoints, target.keypoint_states, strict=True):
        visibility = VISIBILITY.get(state, 0)
        found += [*(point / size).tolist(), visibility] if visibility else [0, 0, 0]
    return found + [0] * (3 * count - len(found))


def line_of(number: int, values: list[float]) -> str:
    """Return a line of labels."""
    return " ".join([str(number), *(f"{value:.9g}" for value in values)])


def _labels(dataset: ExportedDataset, picture: ExportedPicture) -> str:
    size = np.array([picture.camera.width, picture.camera.height], np.float64)
    lines = []
    for target in picture.targets:
        if not target.pixels_visible:
            continue
        if dataset.options["task"] == SEGMENT:
            values = (joined(outlines(picture.mask(target.id))) / size).ravel().tolist()
        else:
            values = box_numbers(target.box_visible, size)
        if dataset.options["task"] == POSE:
            values += keypoint_numbers(target, size, _most_keypoints(dataset))
        lines.append(line_of(target.id - 1, values))
    return "".join(f"{line}\n" for line in lines)


def _files(dataset: ExportedDataset, picture: ExportedPicture) -> Iterator[Output]:
    file = f"{picture.name}{own_suffix(picture)}"
    yield any_image(picture, f"images/{picture.split}/{file}")
    labels = f"labels/{picture.split}/{picture.name}.txt"
    yield MadeFile(path=labels, write=lambda path: write_text_file(_labels(dataset, picture))(path))
    yield IndexRow(path=POSES, value=pose_row(picture, file))


def _indexes(dataset: ExportedDataset) -> Mapping[str, IndexFile]:
    return {POSES: json_list()}


def _shared(dataset: ExportedDataset) -> Iterator[ExportFile]:
    lines = [f"{split}: images/{split}" for split in dataset.splits]
    lines += ["names:", *(f"  {target.id - 1}: {json.dumps(target.name)}" for target in dataset.dataset.targets)]
    if dataset.options["task"] == POSE:
        lines.append(f"kpt_shape: [{_most_keypoints(dataset)}, 3]")
    yield MadeFile(path="data.yaml", write=write_text_file("".join(f"{line}\n" for line in lines)))


def _most_keypoints(dataset: ExportedDataset) -> int:
    """Return how many keypoints the target has that has the most: Ultralytics wants as many of each."""
    return max(len(target.keypoints.names) for target in dataset.dataset.targets)


def _layout(options: Mapping[str, Any]) -> Layout:
    return Layout(
        needs=("image", "segmentation"),
        conventions=CONVENTIONS,
        files=_files,
        shared=_shared,
        indexes=_indexes,
        limits=(bodies_told_apart, *((has_keypoints,) if options["task"] == POSE else ())),
        splits=SPLITS,
        several=True,
    )


YOLO = ExportFormat(
    name="yolo",
    holds="images with boxes, outlines or keypoints, for Ultralytics",
    layout=_layout,
    options=(
        FormatOption(name="task", meaning="purpose of the labels", default=DETECT, choices=(DETECT, SEGMENT, POSE)),
    ),
)
