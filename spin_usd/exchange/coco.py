"""COCO: images in a folder for each split, and a JSON file of their boxes, masks, keypoints and poses.

COCO itself has no poses; exports add them to each image as the member `poses`, with q_cam_body and t_cam_body of each
target. We read the pose of an image's target with the lowest category. Source: the format's description by its authors
(data format, object and keypoint detection), and pycocotools.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.exchange.layout.export_format import ExportFormat, IndexRow, Layout, Output
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.images import any_image, own_suffix
from spin_usd.exchange.layout.index_file import IndexFile, json_lists
from spin_usd.exchange.layout.limits import bodies_told_apart
from spin_usd.exchange.layout.masks import compressed, run_lengths
from spin_usd.exchange.pose_format import PoseEntry, PoseFormat, files_like
from spin_usd.exchange.record_poses import pose_of_record
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.formats.json_file import read_json_file
from spin_usd.reading.description import DescribedTarget
from spin_usd.reading.pictured_target import PicturedTarget

IMAGES, ANNOTATIONS = "images", "annotations"
HALF_PIXEL = 0.5  # a keypoint's pixel has its centre at whole numbers, unlike boxes and masks, whose (0, 0) is a corner
VISIBILITY = {"visible": 2, "self-occluded": 1, "occluded": 1}
"""COCO's v of a keypoint by its state: 2 visible, 1 hidden; 0, which all others have, is not labelled."""
CONVENTIONS = (
    "Boxes are x, y, width and height in pixels, (0, 0) being the corner of the image, tight around the visible "
    "pixels.",
    "Keypoints are x, y and v in pixels whose centres are at whole numbers, as COCO has them: half a pixel less than "
    "in the dataset. v is 2 where visible, 1 where hidden by the target itself or by another body, and 0, with x and "
    "y 0, where out of the frame or behind the camera.",
    "Masks are of the visible pixels, in run lengths (RLE) down the columns, compressed as pycocotools reads them. "
    "In Detectron2 set INPUT.MASK_FORMAT to bitmask: they are no polygons.",
    "An image's member poses is an addition to COCO, and readers ignore it. It has every target, visible or not: "
    "q_cam_body, scalar first, and t_cam_body, metres, take the body's axes to the camera's, which are OpenCV's: x "
    "right, y down, z forward.",
    "A category is a target, and its id is the target's; iscrowd is 0. A target of which nothing is visible has no "
    "annotation.",
    "The lens distortion is in the images, as in boxes, masks and keypoints.",
)
BOP_FILE = "scene_gt_coco.json"
HEAD = re.compile(r'\s*\{\s*"(info|licenses|images|annotations|categories)"\s*:')


def annotation(target: PicturedTarget, mask: NDArray[np.bool_]) -> dict[str, Any]:
    """Return COCO's entry of a target with the visible pixels `mask` (H, W), at least one."""
    x0, y0, x1, y1 = target.box_visible.tolist()
    said = {
        "category_id": target.id,
        "iscrowd": 0,
        "area": int(mask.sum()),
        "bbox": [x0, y0, x1 - x0, y1 - y0],
        "segmentation": {"size": list(mask.shape), "counts": compressed(run_lengths(mask))},
    }
    points = keypoint_numbers(target.keypoints, target.keypoint_states)
    return said | {"keypoints": points, "num_keypoints": sum(v > 0 for v in points[2::3])} if points else said


def pose(target: PicturedTarget) -> dict[str, Any]:
    """Return the entry of the target in an image's `poses`, t_cam_body in metres."""
    return {
        "category_id": target.id,
        "name": target.name,
        "q_cam_body": target.q_cam_body.tolist(),
        "t_cam_body": target.t_cam_body.tolist(),
    }


def keypoint_numbers(pixels: Float, states: tuple[str, ...]) -> list[float]:
    """Return x, y and v of each of the keypoints (N, 2), one after another."""
    found: list[float] = []
    for (u, v), state in zip(pixels.tolist(), states, strict=True):
        visibility = VISIBILITY.get(state, 0)
        found += [u - HALF_PIXEL, v - HALF_PIXEL, visibility] if visibility else [0, 0, 0]
    return found


def category(target: DescribedTarget) -> dict[str, Any]:
    """Return COCO's entry of the targets with that id in all pictures."""
    said = {"id": target.id, "name": target.name, "supercategory": "spacecraft"}
    names = list(target.keypoints.names)
    return said | {"keypoints": names, "skeleton": []} if names else said


def _indexes(dataset: ExportedDataset) -> Mapping[str, IndexFile]:
    head = {
        "info": {"description": f"{dataset.dataset.root.name}, exported by spin_usd"},
        "licenses": [],
        "categories": [category(target) for target in dataset.dataset.targets],
    }
    return {f"annotations/{split}.json": json_lists(head, [IMAGES, ANNOTATIONS]) for split in dataset.splits}


def _files(dataset: ExportedDataset, picture: ExportedPicture) -> Iterator[Output]:
    index, file_name = f"annotations/{picture.split}.json", f"{picture.name}{own_suffix(picture)}"
    yield any_image(picture, f"images/{picture.split}/{file_name}")
    image_id, size = picture.number + 1, picture.camera
    said = {"id": image_id, "file_name": file_name, "width": size.width, "height": size.height}
    poses = [pose(target) for target in picture.targets]
    yield IndexRow(path=index, section=IMAGES, value={**said, "poses": poses})
    for target in picture.targets:
        if target.pixels_visible:
            # Unlike any other of the file, and above 0, which COCO's evaluation takes for none.
            number = picture.number * len(picture.targets) + target.id
            value = {"id": number, "image_id": image_id, **annotation(target, picture.mask(target.id))}
            yield IndexRow(path=index, section=ANNOTATIONS, value=value)


LAYOUT = Layout(
    needs=("image", "segmentation"),
    conventions=CONVENTIONS,
    files=_files,
    indexes=_indexes,
    limits=(bodies_told_apart,),
    several=True,
)

COCO = ExportFormat(name="coco", holds="images, boxes, masks (RLE), keypoints and poses", layout=LAYOUT)


def read_poses(path: Path) -> Iterator[PoseEntry]:
    """Read the poses of the images that have some. Raises InputError that names the image."""
    images = [image for image in _images(path) if image.get("poses")]
    if not images:
        raise InputError("has no image with poses", where=path, do="export it with spin-usd export --to coco")
    for image in images:
        name = str(image.get("file_name", ""))
        where = f"{path}, image {name!r}"
        yield pose_of_record({"pose": _first(image["poses"], where)}, where, name=name.rpartition("/")[2])


def _images(path: Path) -> list[dict[str, Any]]:
    document = read_json_file(path, MAX_POSE_LIST)
    found = document.get("images") if isinstance(document, dict) else None
    if not isinstance(found, list) or not all(isinstance(each, dict) for each in found):
        raise InputError("has no list of images", where=path, do="give a file as COCO has it")
    return found


def _first(poses: Any, where: str) -> dict[str, Any]:
    """Return the pose of the least category. Raises InputError."""
    if not isinstance(poses, list) or not all(isinstance(each, dict) for each in poses):
        raise InputError("has poses that are not a list of objects", where=where)
    return min(poses, key=_category)


def _category(pose: dict[str, Any]) -> float:
    number = pose.get("category_id", 0)
    return float(number) if isinstance(number, int | float) else 0.0


def _lists(folder: Path) -> Sequence[Path]:
    """Return the files in the folder but BOP's, which has its poses beside them."""
    return [file for file in files_like("annotations/*.json", "*.json")(folder) if file.name != BOP_FILE]


COCO_POSES = PoseFormat(
    name="COCO",
    recognises=lambda path, head: HEAD.match(head) is not None,
    read=read_poses,
    lists=_lists,
)
