"""Real pictures: found in a folder, paired with frames of a stage or with poses of their own, and read as grey."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.pluralise import pluralise
from spin_usd.commands.gap.calls import Pair
from spin_usd.errors import InputError
from spin_usd.exchange.read_pose_list import IMAGE_SUFFIXES, pose_files, read_pose_list
from spin_usd.geometry.rotation import matrices_from_quaternions
from spin_usd.realism.picture_view import FULL
from spin_usd.scene.poses import PoseList
from spin_usd.scene.sensor import LUMINANCE

NAMED = 3
JPEG = (".jpg", ".jpeg")
NO_PICTURES = re.compile(r"depth|masks?(_visib)?|models?(_eval)?|normals?|segmentation|\..*", re.IGNORECASE)
"""Folders whose images are of no camera: labels, textures, thumbnails."""
GREY_STEPS = 2.0  # of 8 bits: channels that differ by less are a grey picture's


def pairs_in(folder: Path, poses: Path | None, frames: Sequence[str]) -> tuple[list[Pair], list[str]]:
    """Return a pair for each picture in the folder, and notes on those that have none.

    Poses are those of `poses`, else of a list in the folder in a known layout, else of the stage's `frames` of the same
    names. Raises InputError if no picture has a pose.
    """
    files = _pictures(folder)
    if not files:
        raise InputError("holds no pictures", where=folder, do="give a folder of JPEG, PNG, TIFF or EXR files")
    listed = _listed(folder, poses)
    known = dict(zip(listed.names, _matrices(listed), strict=True)) if listed else {}
    names = list(known) or list(frames)
    pairs, found = [], set()
    for name in names:
        file = files.get(name)
        if file is not None:
            found.add(file)
            pose = known[name].tolist() if known else None
            pairs.append(Pair(name=name, file=str(file), frame=name if name in frames else None, pose=pose))
    source = listed.source if listed else "the stage"
    if not pairs:
        first = next(iter(files))
        found_text = f"none of its pictures, such as {first}, has a name in {source}, such as {names[0]}"
        do = "give --poses, or author the stage from the pictures' own pose list"
        raise InputError(found_text, where=folder, do=do)
    notes = list(listed.notes) if listed else []
    lone = sorted(str(file.relative_to(folder)) for file in {*files.values()} - found)
    missing = [name for name in names if name not in files]
    for what, left in ((f"no pose in {source}", lone), ("no picture", missing if known else [])):
        if left:
            more = ", ..." if len(left) > NAMED else ""
            kind = "picture" if left is lone else "pose"
            notes.append(f"{pluralise(len(left), kind)} left out, for {what}: {', '.join(left[:NAMED])}{more}")
    return pairs, notes


def _listed(folder: Path, poses: Path | None) -> PoseList | None:
    if poses is not None:
        return read_pose_list(poses)
    try:
        pose_files(folder)
    except InputError:  # no list in a known layout
        return None
    return read_pose_list(folder)


def _matrices(listed: PoseList) -> NDArray[np.float64]:
    """Return (N, 4, 4) T_cam_body."""
    found = np.tile(np.eye(4), (len(listed.names), 1, 1))
    found[:, :3, :3], found[:, :3, 3] = matrices_from_quaternions(listed.q_cam_body), listed.t_cam_body
    return found


def _pictures(folder: Path) -> dict[str, Path]:
    """Return the picture files below a folder by their names; those in folders also by FOLDER_NAME, with and without
    the innermost folder, as data sets of several scenes have pictures of one name (BOP: SCENE/rgb/NAME)."""
    if not folder.is_dir():
        raise InputError("is not a folder", where=folder, do="give the folder of the real pictures")
    found: dict[str, Path] = {}
    for file in sorted(folder.rglob("*")):
        *folders, name = file.relative_to(folder).with_suffix("").parts
        hidden = file.name.startswith(".") or any(NO_PICTURES.fullmatch(each) for each in folders)
        if hidden or file.suffix.lower() not in IMAGE_SUFFIXES:
            continue
        for above in (folders, folders[:-1]):
            for start in range(len(above) + 1):
                found.setdefault("_".join((*above[start:], name)), file)
    return found


def read_grey(file: Path, size: tuple[int, int]) -> tuple[NDArray[np.float32], int, list[str]]:
    """Return a picture (H, W) of that `size`, columns and rows, in steps of 8 bits; how many
    of its pixels a side are averaged to one; and notes on what was done to it.

    A picture of a whole multiple of the size is averaged. Raises InputError for any other size, and for a file that
    cannot be read.
    """
    from spin_usd.formats.image_file import jpeg_is_whole, read_image  # not above: OpenImageIO is slow to load

    image, names = read_image(file)
    notes = []
    top = {np.dtype(np.uint8): 255.0, np.dtype(np.uint16): 65535.0}.get(image.dtype, 1.0)
    grey = np.asarray(image, np.float32) * np.float32(FULL / top)
    if file.suffix.lower() in JPEG and not jpeg_is_whole(file.read_bytes()):
        notes.append("is cut off: part of it is missing")
    if "A" in names:
        notes.append("has transparency, which is ignored")
    if grey.ndim == 3:
        colour = grey[..., [n for n, name in enumerate(names) if name != "A"]][..., :3]
        if colour.shape[-1] == 3 and float(np.ptp(colour, axis=-1).mean()) > GREY_STEPS:
            notes.append("is in colour: its luminance is compared")
        grey = colour @ np.array(LUMINANCE, np.float32) if colour.shape[-1] == 3 else colour[..., 0]
    height, width = grey.shape
    by = width // size[0]
    if (width, height) != (by * size[0], by * size[1]) or not by:
        found = f"is {width} x {height}, and the stage's camera makes {size[0]} x {size[1]}"
        do = f"author the stage with --resolution {width}x{height}, or a whole fraction of it"
        raise InputError(found, where=file, do=do)
    if by > 1:
        notes.append(f"is averaged over {by} x {by} pixels to the stage's size: so its noise is of those")
    return pooled(grey, by, (size[1], size[0])), by, notes


def pooled(image: NDArray[np.float32], by: int, size: tuple[int, int]) -> NDArray[np.float32]:
    """Return the means of squares of `by` pixels, as many rows and columns as `size`; the last ones hold beyond the
    frame what is at its edge."""
    if by == 1:
        return image
    rows, columns = (max(side * by - length, 0) for side, length in zip(size, image.shape, strict=True))
    held = np.pad(image, ((0, rows), (0, columns)), mode="edge")[: size[0] * by, : size[1] * by]
    return np.asarray(held.reshape(size[0], by, size[1], by).mean((1, 3)), np.float32)
