"""The poses of a COCO file whose annotations have one: the member `pose`, with q_cam_body and t_cam_body.

COCO itself has none; spin-usd export adds it. An image's pose is that of its annotation of the least category.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from spin_usd.errors import InputError
from spin_usd.formats.json_file import read_json_file
from spin_usd.formats.poses.pose_format import PoseEntry, PoseFormat, files_like
from spin_usd.formats.poses.record import pose_of_record

HEAD = re.compile(r'\s*\{\s*"(info|licenses|images|annotations|categories)"\s*:')


def read(path: Path) -> Iterator[PoseEntry]:
    """Read the poses of the images that have one. Raises InputError that names the image."""
    document = read_json_file(path)
    names = {image.get("id"): image.get("file_name") for image in _list(document, "images", path)}
    found: dict[Any, dict[str, Any]] = {}
    for annotation in _list(document, "annotations", path):
        image = annotation.get("image_id")
        if "pose" in annotation and _category(annotation) < _category(found.get(image)):
            found[image] = annotation
    if not found:
        raise InputError("has no annotation with a pose", where=path, do="export it with spin-usd export --to coco")
    for image, annotation in found.items():
        name = str(names.get(image, ""))
        yield pose_of_record(annotation, f"{path}, image {name!r}", name=name.rpartition("/")[2])


def _list(document: Any, key: str, path: Path) -> list[dict[str, Any]]:
    found = document.get(key) if isinstance(document, dict) else None
    if not isinstance(found, list) or not all(isinstance(each, dict) for each in found):
        raise InputError(f"has no list of {key}", where=path, do="give a file as COCO has it")
    return found


def _category(annotation: dict[str, Any] | None) -> float:
    number = float("inf") if annotation is None else annotation.get("category_id", 0)
    return float(number) if isinstance(number, int | float) else 0.0


COCO = PoseFormat(
    recognises=lambda path, head: HEAD.match(head) is not None,
    read=read,
    lists=files_like("annotations/*.json", "*.json"),
)
