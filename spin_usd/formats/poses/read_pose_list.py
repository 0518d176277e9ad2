"""A file of poses, in any of the formats of the table, to a PoseList."""

from contextlib import suppress
from pathlib import Path

import numpy as np

from spin_usd.arrays import Float
from spin_usd.errors import InputError
from spin_usd.formats.poses.pose_format import PoseFormat
from spin_usd.formats.poses.pose_formats import POSE_FORMATS
from spin_usd.geometry.rotation import QUATERNION_NORM_TOLERANCE
from spin_usd.scene.source.poses import FRAME_NAME, FRAME_NAME_RULE, PoseList, repeated_name

IMAGE_SUFFIXES = {".jpg", ".jpeg", ".png", ".tif", ".tiff", ".bmp", ".exr"}
HEAD_BYTES = 4096


def read_pose_list(path: str | Path) -> PoseList:
    """Read the poses of the file at `path`, in its order. Raises InputError that names the file and the entry."""
    path = Path(path)
    entries = list(_format_of(path).read(path))
    if not entries:
        raise InputError("holds no poses: its list is empty", where=path)
    files = tuple(entry.filename for entry in entries)
    names = [_picture_name(file, f"{path}, entry {i}") for i, file in enumerate(files)]
    if pair := repeated_name(names):
        where = f"{path}, entry {pair[1]} ({names[pair[1]]!r})"
        raise InputError(f"names the same picture as entry {pair[0]}", where=where, do="give every pose its own name")
    q = np.array([entry.q_cam_body for entry in entries], np.float64)
    t = np.array([entry.t_cam_body for entry in entries], np.float64)
    _check_norms(q, names, path)
    return PoseList(names=tuple(names), q_cam_body=q, t_cam_body=t, files=files, source=str(path))


def _format_of(path: Path) -> PoseFormat:
    """Return the first format that recognises the file; one that cannot be read is left to its reader to refuse."""
    head = ""
    with suppress(OSError), path.open("rb") as file:
        head = file.read(HEAD_BYTES).decode("utf-8-sig", "replace")
    return next(each for each in POSE_FORMATS if each.recognises(path, head))


def _picture_name(filename: str, where: str) -> str:
    """Return the picture's name: the file's without an image format's extension."""
    stem, dot, suffix = filename.rpartition(".")  # no Path: lists have tens of thousands
    name = stem if dot + suffix.lower() in IMAGE_SUFFIXES else filename
    if not FRAME_NAME.fullmatch(name):
        raise InputError(
            f"has the filename {filename[:80]!r}, which cannot name a picture", where=where, do=FRAME_NAME_RULE
        )
    return name


def _check_norms(q: Float, names: list[str], path: Path) -> None:
    norm = np.linalg.norm(q, axis=1)
    off = np.flatnonzero(np.abs(norm - 1) > QUATERNION_NORM_TOLERANCE)
    if not len(off):
        return
    i = int(off[0])
    found = "is zero, which is not a rotation" if norm[i] == 0 else f"has norm {norm[i]:.9g}, expected 1"
    raise InputError(
        f"the quaternion {found}", where=f"{path}, entry {i} ({names[i]!r})", do="give a unit quaternion, scalar first"
    )
