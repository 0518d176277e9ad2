"""The pose lists of URSO: CSV in the axes of the Unreal engine, with the images in a list beside it.

A row has t in Unreal's axes at the camera (x forward, y right, z up), metres, and a quaternion, scalar last, of the JPL
convention, whose matrix is the transpose of Hamilton's; it takes the body's axes, of which y is mirrored, to x right, y
up, z forward. A rotation seen in axes of which one is mirrored goes the other way about the mirrored axis, so the two
undo one another but for y. Source: pedropro/UrsoNet (urso.py, se3lib.py, pose_estimator.py).
"""

from collections.abc import Iterator
from pathlib import Path

from spin_usd.errors import InputError
from spin_usd.exchange.pose_format import SCALAR_LAST, PoseEntry, PoseFormat, files_like
from spin_usd.exchange.pose_numbers import cells, csv_rows
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.formats.text_file import lines_of

POSITION = ("x", "y", "z")
QUATERNION = ("q1", "q2", "q3", "q4")
HEAD = ",".join(POSITION + QUATERNION)
POSES, IMAGES = "_poses_gt.csv", "_images.csv"


def read(path: Path) -> Iterator[PoseEntry]:
    """Read the rows of the file, and the names of their images. Raises InputError that names the row."""
    rows = list(csv_rows(path))
    names = _images(path)
    if len(names) != len(rows):
        found = f"has {len(rows)} poses for the {len(names)} images of {_list_beside(path).name}"
        raise InputError(found, where=path, do="give both lists as they belong together")
    for name, (where, row) in zip(names, rows, strict=True):
        forward, right, up = cells(row, POSITION, where)
        q1, q2, q3, q4 = cells(row, QUATERNION, where)
        yield PoseEntry(filename=name, q_cam_body=(q4, q1, -q2, q3), t_cam_body=(right, -up, forward))


def _images(path: Path) -> list[str]:
    """Return the file names of the images, without folders. Raises InputError."""
    lines = (line.strip() for line in lines_of(_list_beside(path), MAX_POSE_LIST))
    return [line.rpartition("/")[2] for line in lines if line]


def _list_beside(path: Path) -> Path:
    return path.with_name(path.name.removesuffix(POSES) + IMAGES)


URSO = PoseFormat(
    name="URSO",
    recognises=lambda path, head: head.replace(" ", "").startswith(HEAD),
    read=read,
    lists=files_like(f"*{POSES}", f"*/*{POSES}"),
    rotation=SCALAR_LAST,
)
