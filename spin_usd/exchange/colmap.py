"""COLMAP's text model: cameras, images with their poses, and points of the target with the pixels that see them.

images.txt has two lines an image; other writers leave out the second. The first is a number, the scalar-first
quaternion and the translation that take the world's axes to the camera's, which are OpenCV's, the camera's number and
the image's name; the second x, y and the number of a point, for each point that is seen. The world's axes are the
target's body axes in an export, in metres. Pixels have (0, 0) at the corner of the image. Source: COLMAP's
documentation ("Output Format", "Database Format" for cameras' parameters, "FAQ" for masks), and its `sensor/models.h`
for the order of parameters.
"""

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.errors import InputError
from spin_usd.exchange.cameras.camera_format import CORNER, Calibration, CameraFormat, whole
from spin_usd.exchange.layout.export_format import (
    ExportFile,
    ExportFormat,
    FormatOption,
    IndexRow,
    Layout,
    MadeFile,
    Output,
    from_one,
)
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.images import RGB, any_image, mask_image, own_suffix
from spin_usd.exchange.layout.index_file import IndexFile, text_lines, write_text_file
from spin_usd.exchange.layout.limits import bodies_told_apart, views_of_one_target
from spin_usd.exchange.layout.rectified_picture import (
    RECTIFIED,
    RECTIFY,
    RECTIFYING,
    YES,
    as_exported,
    exported_cameras,
)
from spin_usd.exchange.layout.surface_points import DENSE_POSE, SurfacePoints, surface_points
from spin_usd.exchange.pose_format import PoseEntry, PoseFormat, files_like
from spin_usd.exchange.pose_numbers import finite_numbers
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.formats.lens_models import distortion_of
from spin_usd.formats.text_file import is_finite, lines_of
from spin_usd.geometry.camera import Camera

MODEL = "sparse/0"
FILE, CAMERAS, POINTS = "images.txt", "cameras.txt", "points3D.txt"
HEAD = "# Image list with two lines of data per image:"
IMAGES_HEAD = (
    f"{HEAD}\n#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n#   POINTS2D[] as (X, Y, POINT3D_ID)\n"
)
CAMERAS_HEAD = (
    "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n"
    "#   PINHOLE: fx, fy, cx, cy; OPENCV: and k1, k2, p1, p2; FULL_OPENCV: and k3, k4, k5, k6\n"
)
POINTS_HEAD = (
    "# 3D point list with one line of data per point:\n"
    "#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n"
)
FIRST = 1  # the number of the first camera, image and point
SPLITS = {"train": "train", "validation": "validation", "test": "test"}
CONVENTIONS = (
    "Quaternion (scalar first, Hamilton) and translation take the body axes of the target's model, which are the "
    "world's here, to the camera's: x right, y down, z forward; metres. Numbers have all their digits.",
    "Pixels have (0, 0) at the corner of the image, so the first one's centre is at 0.5, 0.5: COLMAP's way, and the "
    "dataset's.",
    "A camera is PINHOLE without lens distortion, OPENCV with k1, k2, p1, p2 alone, else FULL_OPENCV; a fisheye is "
    "OPENCV_FISHEYE.",
    "masks/NAME.png, where NAME has its own ending too, is 255 where the target is visible and to be used, else 0.",
    "Points are places on the target's surface, of the label dense_pose, with the colours of the images that they are "
    "taken from. A point is in an image where dense_pose has the same place there; its pixel is the exact projection, "
    "so all errors are 0. A point may be in one image alone.",
    f"{MODEL}/SPLIT.txt has the names of a split's images, as readers of COLMAP's models that have a test look for "
    "test.txt.",
)


def camera_line(number: int, camera: Camera) -> str:
    """Return the line of cameras.txt, with the simplest model that holds the lens exactly."""
    model, more = "PINHOLE", camera.distortion[:0]
    if camera.fisheye:
        model, more = "OPENCV_FISHEYE", camera.distortion
    elif camera.distortion[4]:
        model, more = "FULL_OPENCV", (*camera.distortion, 0.0, 0.0, 0.0)
    elif camera.distorted:
        model, more = "OPENCV", camera.distortion[:4]
    numbers = (camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy, *more)
    return " ".join(map(str, (number, model, *numbers)))


def _indexes(dataset: ExportedDataset) -> Mapping[str, IndexFile]:
    lists = {f"{MODEL}/{split}.txt": text_lines() for split in dataset.splits}
    return {f"{MODEL}/{FILE}": text_lines(IMAGES_HEAD), **lists}


def _files(dataset: ExportedDataset, original: ExportedPicture) -> Iterator[Output]:
    picture = as_exported(dataset, original)
    name = f"{picture.name}{own_suffix(picture)}"
    yield any_image(picture, f"images/{name}", rgb=dataset.options[RGB.name] == YES)
    yield mask_image(picture, f"masks/{name}.png")
    pose = (*picture.target.q_cam_body.tolist(), *picture.target.t_cam_body.tolist())
    camera = FIRST + exported_cameras(dataset).index(picture.camera)
    line = " ".join(map(str, (FIRST + picture.number, *pose, camera, name)))
    yield IndexRow(path=f"{MODEL}/{FILE}", value=f"{line}\n{_points_line(_points(dataset), picture)}")
    yield IndexRow(path=f"{MODEL}/{picture.split}.txt", value=name)


def _points(dataset: ExportedDataset) -> SurfacePoints:
    return surface_points(dataset, dataset.options["points"])


def _points_line(points: SurfacePoints, picture: ExportedPicture) -> str:
    """Return the line of the picture's points: x, y and number of each."""
    pixels, seen = points.seen_in(picture)
    places = zip(pixels[seen].tolist(), (np.flatnonzero(seen) + FIRST).tolist(), strict=True)
    return " ".join(f"{x} {y} {number}" for (x, y), number in places)


def _shared(dataset: ExportedDataset) -> Iterator[ExportFile]:
    lines = [camera_line(FIRST + place, camera) for place, camera in enumerate(exported_cameras(dataset))]
    text = CAMERAS_HEAD + "".join(f"{line}\n" for line in lines)
    yield MadeFile(path=f"{MODEL}/{CAMERAS}", write=write_text_file(text))


def _last(dataset: ExportedDataset, out: Path) -> Iterator[MadeFile]:
    text = partial(_points_text, dataset, out / MODEL / FILE)
    yield MadeFile(path=f"{MODEL}/{POINTS}", write=lambda path: write_text_file(text())(path))


def _points_text(dataset: ExportedDataset, images: Path) -> str:
    """Return the points that `images` sees, each with its track."""
    points, lines = _points(dataset), []
    for number, track in _tracks(images):
        place = number - FIRST
        numbers = (number, *points.points[place].tolist(), *points.colours[place].tolist(), 0.0)
        lines.append(" ".join(map(str, (*numbers, *track.ravel().tolist()))))
    return POINTS_HEAD + "".join(f"{line}\n" for line in lines)


def _tracks(images: Path) -> Iterator[tuple[int, NDArray[np.int32]]]:
    """Yield each visible point, and for each image that sees it the image's number and the point's index in it (N,
    2)."""
    found = [np.empty((0, 3), np.int32)]
    for _, line, seen in _image_lines(images):
        points = np.array(seen.split()[2::3], np.int32)
        image = np.full(len(points), int(line.split(maxsplit=1)[0]), np.int32)
        found.append(np.stack([points, image, np.arange(len(points), dtype=np.int32)], axis=1))
    rows = np.concatenate(found)
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    numbers, starts = np.unique(rows[:, 0], return_index=True)
    ends = [*starts[1:].tolist(), len(rows)]
    for number, start, end in zip(numbers.tolist(), starts.tolist(), ends[: len(starts)], strict=True):
        yield number, rows[start:end, 1:]


def _image_lines(path: Path) -> Iterator[tuple[int, str, str]]:
    """Yield for each image where its first line is, and both its lines; the second may be empty, or missing."""
    image: tuple[int, str] | None = None
    for number, line in enumerate(lines_of(path, MAX_POSE_LIST), 1):
        if line.startswith("#"):
            continue
        if image and _is_points(line):
            yield *image, line
            image = None
        else:
            if image:
                yield *image, ""
            image = (number, line) if line.strip() else None
    if image:
        yield *image, ""


def _is_points(line: str) -> bool:
    """Return whether a line is empty, or has three numbers of each point: an image ends in its name."""
    words = line.split()
    return not words or (len(words) % 3 == 0 and is_finite(words[-1]))


def _layout(options: Mapping[str, Any]) -> Layout:
    return Layout(
        needs=("image", "segmentation", DENSE_POSE),
        conventions=CONVENTIONS + (RECTIFIED if options[RECTIFY] == YES else ()),
        files=_files,
        shared=_shared,
        last=_last,
        indexes=_indexes,
        limits=(bodies_told_apart, views_of_one_target),
        splits=SPLITS,
    )


COLMAP = ExportFormat(
    name="colmap",
    holds="as a text model with images, masks and points",
    layout=_layout,
    options=(
        FormatOption(
            name="points", meaning="how many points the model has at most, from 1", default="2000", read=from_one
        ),
        RECTIFYING,
        RGB,
    ),
)


def read_poses(path: Path) -> Iterator[PoseEntry | str]:
    """Read the images of the file at `path`, whose world is taken for the body, and a note. Raises InputError that
    names the line."""
    yield "positions are taken for metres; COLMAP itself gives its world any scale"
    cameras = set[str]()
    for number, line, _ in _image_lines(path):
        where = f"{path}, line {number}"
        words = line.split(maxsplit=9)
        if len(words) < 10:
            do = "give IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID and NAME, and a line of points after each"
            raise InputError(f"has {len(words)} words, which is not an image", where=where, do=do)
        try:
            numbers = [float(word) for word in words[1:8]]
        except ValueError:
            raise InputError("contains text that is not a number before the image's name", where=where) from None
        pose = finite_numbers(numbers, 7, "the pose", where)
        cameras.add(words[8])
        yield PoseEntry(filename=words[9].strip(), q_cam_body=pose[:4], t_cam_body=pose[4:])
    if len(cameras) > 1:
        yield f"its images are of {len(cameras)} cameras: all pictures are taken with --camera alone"


COLMAP_POSES = PoseFormat(
    name="COLMAP",
    recognises=lambda path, head: path.name == FILE or head.startswith(HEAD),
    read=read_poses,
    lists=files_like(FILE, f"sparse/{FILE}", f"sparse/*/{FILE}"),
)

PARAMETERS: Mapping[str, tuple[int, int, str]] = {
    "SIMPLE_PINHOLE": (3, 1, ""),
    "PINHOLE": (4, 2, ""),
    "SIMPLE_RADIAL": (4, 1, ""),
    "RADIAL": (5, 1, ""),
    "OPENCV": (8, 2, ""),
    "FULL_OPENCV": (12, 2, ""),
    "OPENCV_FISHEYE": (8, 2, "fisheye"),
    "SIMPLE_RADIAL_FISHEYE": (4, 1, "fisheye"),
    "RADIAL_FISHEYE": (5, 1, "fisheye"),
}
"""COLMAP's models of a camera that are ours: how many numbers one has, how many focal lengths come first, and the lens
of the rest."""


def read_camera(path: Path) -> Calibration:
    """Read the first camera of the cameras.txt at `path`. Raises InputError."""
    lines = [line.split() for line in lines_of(path, MAX_POSE_LIST) if line.strip() and not line.startswith("#")]
    words = lines[0] if lines else []
    model = words[1] if len(words) > 1 else ""
    if model not in PARAMETERS or len(words) != 4 + PARAMETERS[model][0]:
        do = f"undistort with COLMAP's image_undistorter, or choose among {', '.join(PARAMETERS)}"
        raise InputError(f"has no whole camera of a known model, but {model or 'none'}", where=path, do=do)
    _, focal, lens = PARAMETERS[model]
    try:
        width, height, *numbers = [float(word) for word in words[2:]]
    except ValueError:
        raise InputError("contains text that is not a number after the camera's model", where=path) from None
    cx, cy, *k = finite_numbers(numbers, len(numbers), "the camera", str(path))[focal:]
    note = (f"holds {len(lines)} cameras, of which {words[0]} is used: keep only another one to use that",)
    return Calibration(
        size=whole([width, height], path),
        projection=(numbers[0], numbers[focal - 1], cx, cy),
        distortion=distortion_of(k, lens, path),
        notes=note if len(lines) > 1 else (),
    )


COLMAP_CAMERA = CameraFormat(
    name="COLMAP",
    first_centre=CORNER,
    recognises=lambda path, head: path.name == CAMERAS or head.startswith("# Camera list"),
    read=read_camera,
)
