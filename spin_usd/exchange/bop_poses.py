"""The poses of BOP's scenes, which SwissCube has too: scene_gt.json, an object of images.

Each image lists its bodies, with R_cam_body row by row and t_cam_body in millimetres; a picture is called after its
scene's folder and its number. Source: bop_toolkit, docs/bop_datasets_format.md.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from spin_usd.errors import InputError
from spin_usd.exchange.pose_format import PoseEntry, PoseFormat, files_like
from spin_usd.exchange.pose_numbers import finite_numbers, quaternion_of
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.formats.json_file import read_json_file

FILE = "scene_gt.json"
MILLIMETRES = 1000.0


def read(path: Path) -> Iterator[PoseEntry]:
    """Read the poses of the first body of each image. Raises InputError that names the image."""
    images = read_json_file(path, MAX_POSE_LIST)
    if not isinstance(images, dict):
        raise InputError("is not an object of images", where=path, do="give a scene_gt.json as BOP has it")
    scene = _scene(path)
    for number in sorted(images, key=_number):
        where = f"{path}, image {number}"
        yield _entry(images[number], f"{scene}_{_number(number):06d}", where)


def _entry(bodies: Any, name: str, where: str) -> PoseEntry:
    if not isinstance(bodies, list) or not bodies or not all(isinstance(body, dict) for body in bodies):
        raise InputError("lists no bodies", where=where)
    body = min(bodies, key=lambda each: _number(each.get("obj_id", 0)))
    millimetres = finite_numbers(body.get("cam_t_m2c"), 3, "cam_t_m2c", where)
    return PoseEntry(
        filename=name,
        q_cam_body=quaternion_of(body.get("cam_R_m2c"), "cam_R_m2c", where),
        t_cam_body=[value / MILLIMETRES for value in millimetres],
    )


def _scene(path: Path) -> str:
    """Return the name of the scene: its folder's; in SwissCube that of the sequence around it, which has one scene."""
    folder = path.resolve().parent
    return folder.parent.name if folder.parent.name.startswith("seq_") else folder.name


def _number(text: Any) -> int:
    """Return the number of an image or a body. Raises InputError."""
    try:
        return int(text)
    except (TypeError, ValueError):
        raise InputError(f"{text!r} is not a number", where=FILE) from None


BOP = PoseFormat(
    name="BOP",
    recognises=lambda path, head: path.name == FILE or (head.lstrip().startswith("{") and '"cam_R_m2c"' in head),
    read=read,
    lists=files_like(FILE, f"*/{FILE}", f"*/*/{FILE}", f"*/*/*/{FILE}"),
)
