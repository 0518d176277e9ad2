"""Pose lists of SPEED+, SPEED, SHIRT and SPIN: JSON in, PoseList out.

A bare list or {"poses": [...]} of entries with a file name, a scalar-first quaternion q_cam_body and a position
t_cam_body in metres. The sets call the quaternion `q_vbs2tango_true` (SPEED: `q_vbs2tango`) and the position
`r_Vo2To_vbs_true`. Source: tpark94/speedplusbaseline, vpulab/SPIN.
"""

from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from spin_usd.arrays import Float
from spin_usd.errors import InputError
from spin_usd.formats.json_file import read_json_file
from spin_usd.geometry.rotation import QUATERNION_NORM_TOLERANCE
from spin_usd.scene.source.poses import FRAME_NAME, FRAME_NAME_RULE, PoseList, repeated_name

QUATERNION_KEYS = ("q_vbs2tango_true", "q_vbs2tango")
POSITION_KEYS = ("r_Vo2To_vbs_true", "r_Vo2To_vbs")
IMAGE_SUFFIXES = {".jpg", ".jpeg", ".png", ".tif", ".tiff", ".bmp", ".exr"}


def read_pose_list(path: str | Path) -> PoseList:
    """The poses of the file at `path`, in its order. Raises InputError that names the file and the entry."""
    path = Path(path)
    entries = _entries(read_json_file(path), path)
    files: list[str] = []
    names: list[str] = []
    q, t = np.empty((len(entries), 4)), np.empty((len(entries), 3))
    for i, entry in enumerate(entries):
        where = f"{path}, entry {i}"
        if not isinstance(entry, dict):
            raise InputError(f"is a {type(entry).__name__}, expected an object", where=where)
        file, name = _names(entry, where)
        where = f"{where} ({name!r})"
        files.append(file)
        names.append(name)
        q[i] = _numbers(entry, QUATERNION_KEYS, 4, where)
        t[i] = _numbers(entry, POSITION_KEYS, 3, where)
    if pair := repeated_name(names):
        where = f"{path}, entry {pair[1]} ({names[pair[1]]!r})"
        raise InputError(f"names the same picture as entry {pair[0]}", where=where, do="give every pose its own name")
    _check_norms(q, names, path)
    return PoseList(names=tuple(names), q_cam_body=q, t_cam_body=t, files=tuple(files), source=str(path))


def slice_of(text: str) -> slice:
    """The slice that "A:B" or "A:B:STEP" says, as Python reads it; any of the three may be left out."""
    fields = text.split(":")
    try:
        if not 2 <= len(fields) <= 3:
            raise ValueError
        numbers = [int(field) if field.strip() else None for field in fields]
    except ValueError:
        raise InputError(f"frames {text!r} is not A:B:STEP", do="write for example 0:100:5") from None
    chosen = slice(*numbers)
    if chosen.step == 0:
        raise InputError(f"frames {text!r} has step 0", do="write for example 0:100:5")
    return chosen


def chosen_frames(poses: PoseList, text: str | None) -> PoseList:
    """The poses that `text` (A:B:STEP) chooses; all for None. Raises InputError when that is none."""
    if text is None:
        return poses
    chosen = poses[slice_of(text)]
    if not len(chosen):
        raise InputError(f"frames {text!r} chooses none of {len(poses)} poses", where=poses.source or None)
    return chosen


def _entries(document: Any, path: Path) -> Sequence[Any]:
    if isinstance(document, dict):
        document = document.get("poses")
    if not isinstance(document, list):
        raise InputError("holds no list of poses", where=path, do='give a list, or {"poses": [...]}')
    if not document:
        raise InputError("holds no poses: its list is empty", where=path)
    return document


def _names(entry: dict[str, Any], where: str) -> tuple[str, str]:
    """The file's name, and the picture's: the same without an image format's extension."""
    filename = entry.get("filename")
    if not isinstance(filename, str):
        raise InputError("has no 'filename'", where=where)
    stem, dot, suffix = filename.rpartition(".")  # no Path: lists have tens of thousands
    name = stem if dot + suffix.lower() in IMAGE_SUFFIXES else filename
    if not FRAME_NAME.fullmatch(name):
        raise InputError(
            f"has the filename {filename[:80]!r}, which cannot name a picture",
            where=where,
            do=FRAME_NAME_RULE,
        )
    return filename, name


def _numbers(entry: dict[str, Any], keys: tuple[str, ...], count: int, where: str) -> list[float]:
    """`count` finite numbers under the first of `keys` that is there."""
    key = next((k for k in keys if k in entry), None)
    if key is None:
        raise InputError(f"has neither '{keys[0]}' nor '{keys[1]}'", where=where)
    values = entry[key]
    if not isinstance(values, list) or len(values) != count:
        raise InputError(f"'{key}' is not a list of {count} numbers", where=where)
    if not all(type(v) in (float, int) for v in values):
        raise InputError(f"'{key}' holds something else than numbers: {values!r}", where=where)
    try:
        numbers = [float(v) for v in values]
    except OverflowError:
        numbers = [float("inf")]
    if not all(map(isfinite, numbers)):
        raise InputError(f"'{key}' holds NaN or infinity", where=where)
    return numbers


def _check_norms(q: Float, names: list[str], path: Path) -> None:
    norm = np.linalg.norm(q, axis=1)
    off = np.flatnonzero(np.abs(norm - 1) > QUATERNION_NORM_TOLERANCE)
    if not len(off):
        return
    i = int(off[0])
    found = "is zero, which is no rotation" if norm[i] == 0 else f"has norm {norm[i]:.9g}, expected 1"
    raise InputError(
        f"the quaternion {found}", where=f"{path}, entry {i} ({names[i]!r})", do="give a unit quaternion, scalar first"
    )
