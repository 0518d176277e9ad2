"""URSO: numbered images, and for each split a list of them and one of poses: CSV in the Unreal engine's axes.

A row has t in Unreal's axes at the camera (x forward, y right, z up), metres, and a quaternion, scalar last, of the JPL
convention, whose matrix is the transpose of Hamilton's; it takes the body's axes, y mirrored, to x right, y
up, z forward. A rotation seen in axes with one mirrored goes the other way about the mirrored axis, so the two
undo one another but for y. Source: pedropro/UrsoNet. urso.py: SPLIT_images.csv, SPLIT_poses_gt.csv, u from y/x and v
from z/x with a negative focal length, so z is up; pose_estimator.py: the rotation of `R_cam_unreal` to x right, y up, z
forward; se3lib.py: the quaternions; utils.plot_axes: the body's y axis is mirrored.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.exchange.layout.export_format import ExportFormat, IndexRow, Layout, Output
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.images import any_image
from spin_usd.exchange.layout.index_file import IndexFile, csv_table, text_lines
from spin_usd.exchange.layout.limits import no_distortion, one_camera
from spin_usd.exchange.pose_format import SCALAR_LAST, PoseEntry, PoseFormat, files_like
from spin_usd.exchange.pose_numbers import cells, csv_rows
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.formats.text_file import lines_of

POSITION = ("x", "y", "z")
QUATERNION = ("q1", "q2", "q3", "q4")
COLUMNS = POSITION + QUATERNION
HEAD = ",".join(COLUMNS)
POSES, IMAGES = "_poses_gt.csv", "_images.csv"
CONVENTIONS = (
    "x, y, z is the body's origin in Unreal's axes at the camera, metres: x forward, y right, z up. A point is seen at "
    "u = cx + fx y / x, v = cy - fy z / x, (0, 0) being the corner of the image.",
    "q1, q2, q3, q4 is a unit quaternion, scalar last, of the JPL convention (its matrix is the transpose of "
    "Hamilton's), of the rotation from the body's axes, of which y is mirrored, to the camera's, x right, y up, z "
    "forward: with (w, a, b, c) = q_cam_body of this package it is (a, -b, c, w).",
    "Numbers have all their digits. N_rgb.png is picture N of pictures.csv, in 8 bits as the dataset's.",
    "The format has no camera file: K is in the table below.",
)


def location(t_cam_body: Float) -> tuple[float, float, float]:
    """Return x, y, z in Unreal's axes at the camera."""
    x, y, z = t_cam_body.tolist()
    return z, x, -y


def quaternion(q_cam_body: Float) -> tuple[float, float, float, float]:
    """Return q1, q2, q3, q4."""
    w, x, y, z = q_cam_body.tolist()
    return x, -y, z, w


def _indexes(dataset: ExportedDataset) -> Mapping[str, IndexFile]:
    lists = {f"{split}{IMAGES}": text_lines() for split in dataset.splits}
    return lists | {f"{split}{POSES}": csv_table(COLUMNS) for split in dataset.splits}


def _files(dataset: ExportedDataset, picture: ExportedPicture) -> Iterator[Output]:
    file, target = f"{picture.number}_rgb.png", picture.target
    yield any_image(picture, file)
    yield IndexRow(path=f"{picture.split}{IMAGES}", value=file)
    pose = (*location(target.t_cam_body), *quaternion(target.q_cam_body))
    yield IndexRow(path=f"{picture.split}{POSES}", value=pose)


LAYOUT = Layout(
    needs=("image",),
    conventions=CONVENTIONS,
    indexes=_indexes,
    files=_files,
    limits=(no_distortion, one_camera),
    splits={"train": "train", "validation": "val", "test": "test"},
)


URSO = ExportFormat(name="urso", holds="in the layout of URSO: poses as CSV in Unreal's axes, images", layout=LAYOUT)


def read_poses(path: Path) -> Iterator[PoseEntry]:
    """Read the rows of the file, and the names of their images. Raises InputError that names the row."""
    rows = list(csv_rows(path))
    names = _images(path)
    if len(names) != len(rows):
        found = f"has {len(rows)} poses for the {len(names)} images of {_list_beside(path).name}"
        raise InputError(found, where=path, do="give both lists as they belong together")
    for name, (line, where, row) in zip(names, rows, strict=True):
        forward, right, up = cells(row, POSITION, where)
        q1, q2, q3, q4 = cells(row, QUATERNION, where)
        yield PoseEntry(filename=name, q_cam_body=(q4, q1, -q2, q3), t_cam_body=(right, -up, forward), line=line)


def _images(path: Path) -> list[str]:
    """Return the file names of the images, without folders. Raises InputError."""
    lines = (line.strip() for line in lines_of(_list_beside(path), MAX_POSE_LIST))
    return [line.rpartition("/")[2] for line in lines if line]


def _list_beside(path: Path) -> Path:
    return path.with_name(path.name.removesuffix(POSES) + IMAGES)


URSO_POSES = PoseFormat(
    name="URSO",
    recognises=lambda path, head: head.replace(" ", "").startswith(HEAD),
    read=read_poses,
    lists=files_like(f"*{POSES}", f"*/*{POSES}"),
    rotation=SCALAR_LAST,
)
