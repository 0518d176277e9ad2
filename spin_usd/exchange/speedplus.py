"""SPEED+: camera.json, then for a domain its images, masks, and lists of poses.

SPEED, SHIRT and SPIN have the same camera.json, and lists of poses of one format, which is read for all: JSON, a bare
list or {"poses": [...]} of entries with a file name, a scalar-first quaternion q_cam_body and a position t_cam_body in
metres. The sets call the quaternion `q_vbs2tango_true` (SPEED: `q_vbs2tango`) and the position `r_Vo2To_vbs_true`.
Sources: tpark94/spnv2 (tools/preprocess.py: images/NAME.jpg, and a mask of the same file name in masks/),
JotaBravo/spacecraft-uda (camera.json), tpark94/speedplusbaseline and vpulab/SPIN (poses).
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from spin_usd.errors import InputError
from spin_usd.exchange.cameras.camera_format import CORNER, Calibration, CameraFormat
from spin_usd.exchange.cameras.speed_camera import camera_document, read_camera_file
from spin_usd.exchange.layout.export_format import (
    ExportFormat,
    FormatOption,
    IndexRow,
    Layout,
    MadeFile,
    Output,
    SecondName,
)
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.images import GREY_JPEG, grey_image, mask_image, part_image
from spin_usd.exchange.layout.index_file import IndexFile, json_list, write_json_file
from spin_usd.exchange.layout.limits import no_fisheye, one_camera, parts_at_most
from spin_usd.exchange.pose_format import PoseEntry, PoseFormat, files_like
from spin_usd.exchange.pose_numbers import finite_numbers, one_pose
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.files.user_file import open_file
from spin_usd.formats.json_file import read_json_file

TWICE = (
    "Readers that look for a mask under its image's name find it: masks/NAME.jpg is the same PNG, without loss; "
    "programs open images by a file's content, not by its name."
)
MASKS = {"silhouette": mask_image, "parts": part_image}
MEANING = {
    "silhouette": ("masks/NAME.png is 255 where the target is visible, else 0.", TWICE),
    "parts": ("masks/NAME.png has the ids of parts, 0 for nothing.", TWICE),
    "none": ("There are no masks.",),
}
SPLITS = {"train": "train", "validation": "validation", "test": "test"}
POSE_CONVENTIONS = (
    "p_cam = R(q) p_body + r: q is the unit quaternion, scalar first, Hamilton, of the rotation from the body's axes "
    "to the camera's; r is the body's origin in the camera's axes, in metres. Numbers have all their digits.",
    "Camera axes are OpenCV's: x right, y down, z forward. Body axes are the axes of the target's model.",
    "camera.json: cameraMatrix in pixels, (0, 0) being the corner of the image as in SPEED+ (cx = width / 2 is its "
    "middle); distCoeffs are k1, k2, p1, p2, k3 of OpenCV; fx and fy there are metres, cameraMatrix times the pixel "
    "pitch ppx, for which the pitch of SPEED+'s camera is taken.",
)
QUATERNION, SPEED_QUATERNION = "q_vbs2tango_true", "q_vbs2tango"
POSITION, SHORT_POSITION = "r_Vo2To_vbs_true", "r_Vo2To_vbs"
INDEX, INDEX_BYTES = b'"wids_version"', 200  # of a WebDataset, whose lists have such names too
NAMES = ("train", "validation", "test", "real", "real_test", "roe1", "roe2", "poses")


def layout(options: Mapping[str, Any]) -> Layout:
    """Return the layout for the options "domain", "image" and "masks"."""
    masks = options["masks"]
    return Layout(
        needs=("image",) if masks == "none" else ("image", "segmentation"),
        conventions=(
            *POSE_CONVENTIONS,
            GREY_JPEG,
            *MEANING[masks],
        ),
        shared=lambda dataset: iter((camera_file(dataset),)),
        indexes=_indexes,
        files=_files,
        limits=(no_fisheye, one_camera, *([parts_at_most(255, 8)] if masks == "parts" else [])),
        splits=SPLITS,
    )


def _indexes(dataset: ExportedDataset) -> Mapping[str, IndexFile]:
    return {_list(dataset, split): json_list() for split in dataset.splits}


def _list(dataset: ExportedDataset, split: str) -> str:
    return f"{dataset.options['domain']}/{split}.json"


def _files(dataset: ExportedDataset, picture: ExportedPicture) -> Iterator[Output]:
    domain, masks = dataset.options["domain"], dataset.options["masks"]
    filename = f"{picture.name}.{dataset.options['image']}"
    yield grey_image(picture, f"{domain}/images/{filename}")
    if masks in MASKS:
        mask = MASKS[masks](picture, f"{domain}/masks/{picture.name}.png")
        yield mask
        if filename != f"{picture.name}.png":
            yield SecondName(path=f"{domain}/masks/{filename}", of=mask.path)
    yield IndexRow(path=_list(dataset, picture.split), value=pose_row(picture, filename))


def camera_file(dataset: ExportedDataset) -> MadeFile:
    """Return camera.json."""
    return MadeFile(path="camera.json", write=write_json_file(camera_document(dataset.camera)))


def pose_row(picture: ExportedPicture, filename: str, quaternion: str = QUATERNION) -> dict[str, Any]:
    """Return the entry of a list of poses; `quaternion` is the key that the set gives it."""
    target = picture.target
    return {
        "filename": filename,
        quaternion: target.q_cam_body.tolist(),
        POSITION: target.t_cam_body.tolist(),
    }


SPEEDPLUS = ExportFormat(
    name="speedplus",
    holds="in the layout of SPEED+: poses, grey images, masks",
    layout=layout,
    options=(
        FormatOption(
            name="domain",
            meaning="the folder of images and lists",
            default="synthetic",
            choices=("synthetic", "lightbox", "sunlamp"),
        ),
        FormatOption(name="image", meaning="the images' files", default="jpg", choices=("jpg", "png")),
        FormatOption(
            name="masks", meaning="content of masks", default="silhouette", choices=("silhouette", "parts", "none")
        ),
    ),
)


def read_poses(path: Path) -> Iterator[PoseEntry]:
    """Read the entries of the JSON file at `path`. Raises InputError that names the file and the entry."""
    for i, entry in enumerate(_entries(read_json_file(path, MAX_POSE_LIST), path)):
        where = f"{path}, entry {i}"
        if not isinstance(entry, dict):
            raise InputError(f"is a {type(entry).__name__}, expected an object", where=where)
        filename = entry.get("filename")
        if "filename" not in entry:
            raise InputError("has no 'filename'", where=where, do="name the picture's file")
        if not isinstance(filename, str):
            found = f"has the filename {json.dumps(filename)[:80]}, which is not text"
            raise InputError(found, where=where, do="name the picture's file")
        where = f"{where} ({filename[:80]!r})"
        q, t = one_pose(
            _numbers(entry, (QUATERNION, SPEED_QUATERNION), 4, where),
            _numbers(entry, (POSITION, SHORT_POSITION), 3, where),
            where,
        )
        yield PoseEntry(filename=filename, q_cam_body=q, t_cam_body=t)


def _entries(document: Any, path: Path) -> Sequence[Any]:
    if isinstance(document, dict):
        document = document.get("poses")
    if not isinstance(document, list):
        raise InputError("holds no list of poses", where=path, do='give a list, or {"poses": [...]}')
    return document


def _numbers(entry: dict[str, Any], keys: tuple[str, ...], count: int, where: str) -> list[list[float]]:
    """`count` finite numbers under each existing one of `keys`."""
    if not (there := [key for key in keys if key in entry]):
        raise InputError(f"has neither '{keys[0]}' nor '{keys[1]}'", where=where)
    return [finite_numbers(entry[key], count, f"'{key}'", where) for key in there]


def _lists(folder: Path) -> Sequence[Path]:
    """Return the files of the sets' names in the folder but indices of a WebDataset's shards."""
    named = files_like(*(f"{place}{name}.json" for place in ("", "*/") for name in NAMES))(folder)
    return [file for file in named if not _begins_with(file, INDEX)]


def _begins_with(file: Path, words: bytes) -> bool:
    """Return whether the words are among the first of the file; one that cannot be read is left to the reader."""
    with suppress(InputError, OSError), open_file(file, MAX_POSE_LIST) as opened:
        return words in opened.read(INDEX_BYTES)
    return False


SPEEDPLUS_POSES = PoseFormat(
    name="SPEED+",
    recognises=lambda path, head: True,  # tried last: its reader reports the fault of a file
    read=read_poses,
    lists=_lists,
)


def read_camera(path: Path) -> Calibration:
    """Read the camera.json of SPEED+ and its kin at `path`. Raises InputError."""
    found = read_camera_file(path)
    camera, notes = found.camera, tuple(note.removeprefix(f"{path.name} ") for note in found.notes)
    return Calibration(
        size=(camera.width, camera.height),
        projection=(camera.fx, camera.fy, camera.cx, camera.cy),
        distortion=camera.distortion,
        pixel_pitch=found.pixel_pitch,
        notes=notes,
    )


SPEEDPLUS_CAMERA = CameraFormat(
    name="SPEED+", first_centre=CORNER, recognises=lambda path, head: '"Nu"' in head or '"Nv"' in head, read=read_camera
)
