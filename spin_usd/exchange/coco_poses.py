"""The poses of a COCO file whose images have them: the member `poses`, with q_cam_body and t_cam_body of each target.

COCO itself has none; spin-usd export adds it. An image's pose is that of its target of the least category.
"""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from spin_usd.errors import InputError
from spin_usd.exchange.pose_format import PoseEntry, PoseFormat, files_like
from spin_usd.exchange.record_poses import pose_of_record
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.formats.json_file import read_json_file

BOP_FILE = "scene_gt_coco.json"
HEAD = re.compile(r'\s*\{\s*"(info|licenses|images|annotations|categories)"\s*:')


def read(path: Path) -> Iterator[PoseEntry]:
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
        raise InputError("has poses that are no list of objects", where=where)
    return min(poses, key=_category)


def _category(pose: dict[str, Any]) -> float:
    number = pose.get("category_id", 0)
    return float(number) if isinstance(number, int | float) else 0.0


def _lists(folder: Path) -> Sequence[Path]:
    """Return the files in the folder but BOP's, which has its poses beside them."""
    return [file for file in files_like("annotations/*.json", "*.json")(folder) if file.name != BOP_FILE]


COCO = PoseFormat(
    name="COCO",
    recognises=lambda path, head: HEAD.match(head) is not None,
    read=read,
    lists=_lists,
)
