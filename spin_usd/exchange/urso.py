"""URSO: numbered images, and for each split a list of them and one of poses, in Unreal's axes.

Source: pedropro/UrsoNet. urso.py: SPLIT_images.csv, SPLIT_poses_gt.csv, u from y/x and v from z/x with a negative focal
length, so z is up; pose_estimator.py: the rotation of `R_cam_unreal` to x right, y up, z forward; se3lib.py:
quaternions have the scalar last and are of the JPL convention, whose matrix is the transpose of Hamilton's;
utils.plot_axes: the body's y axis is mirrored.
"""

from collections.abc import Iterator, Mapping

from spin_usd.arrays import Float
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.images import any_image
from spin_usd.exchange.layout.index_file import IndexFile, csv_table, text_lines
from spin_usd.exchange.layout.layout import ExportFormat, IndexRow, Layout, Output
from spin_usd.exchange.layout.limits import no_distortion, one_camera

COLUMNS = ("x", "y", "z", "q1", "q2", "q3", "q4")
CONVENTIONS = (
    "x, y, z is the body's origin in Unreal's axes at the camera, metres: x forward, y right, z up. A point is seen at "
    "u = cx + fx y / x, v = cy - fy z / x, (0, 0) being the corner of the image.",
    "q1, q2, q3, q4 is a unit quaternion, scalar last, of the JPL convention (its matrix is the transpose of "
    "Hamilton's), of the rotation from the body's axes, of which y is mirrored, to the camera's, x right, y up, z "
    "forward: with (w, a, b, c) = q_cam_body of this package it is (a, -b, c, w).",
    "Numbers have all their digits. N_rgb.png is picture N of pictures.csv, in 8 bits as the dataset's.",
    "The format has no camera file: K is that of the table below.",
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
    lists = {f"{split}_images.csv": text_lines() for split in dataset.splits}
    return lists | {f"{split}_poses_gt.csv": csv_table(COLUMNS) for split in dataset.splits}


def _files(dataset: ExportedDataset, picture: ExportedPicture) -> Iterator[Output]:
    file, target = f"{picture.number}_rgb.png", picture.target
    yield any_image(picture, file)
    yield IndexRow(path=f"{picture.split}_images.csv", value=file)
    pose = (*location(target.t_cam_body), *quaternion(target.q_cam_body))
    yield IndexRow(path=f"{picture.split}_poses_gt.csv", value=pose)


LAYOUT = Layout(
    needs=("image",),
    conventions=CONVENTIONS,
    indexes=_indexes,
    files=_files,
    limits=(no_distortion, one_camera),
    splits={"train": "train", "validation": "val", "test": "test"},
)


URSO = ExportFormat(name="urso", holds="in the layout of URSO: poses as CSV in Unreal's axes, images", layout=LAYOUT)
