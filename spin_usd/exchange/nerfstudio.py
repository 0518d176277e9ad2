"""nerfstudio: transforms.json with a camera and a pose for each image, masks, depth, and points to begin with.

A frame's `transform_matrix`, 4 x 4, takes OpenGL's camera axes (x right, y up, looking along -z) to the world's, which
in an export are the target's body axes, in metres. `file_path` names its image. Source: nerfstudio's documentation of
its data format ("Data conventions"), and its loader `nerfstudio_dataparser.py`: `*_filenames` are its splits, of which
it needs all or none; depth is in millimetres; `orientation_override` keeps it from turning the axes.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from spin_usd.errors import InputError
from spin_usd.exchange.cameras.camera_format import CORNER, Calibration, CameraFormat, whole
from spin_usd.exchange.layout.export_format import ExportFile, ExportFormat, FormatOption, IndexRow, Layout, Output
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.images import RGB, any_image, depth_image, mask_image, own_suffix
from spin_usd.exchange.layout.index_file import IndexFile, json_lists
from spin_usd.exchange.layout.limits import bodies_told_apart, depth_at_most, views_of_one_target
from spin_usd.exchange.layout.rectified_picture import (
    RECTIFIED,
    RECTIFY,
    RECTIFYING,
    YES,
    as_exported,
    exported_cameras,
)
from spin_usd.exchange.layout.surface_points import DENSE_POSE, cloud_file
from spin_usd.exchange.pose_format import PoseEntry, PoseFormat, files_like
from spin_usd.exchange.pose_numbers import finite_numbers, quaternion_of
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.formats.json_file import read_json_file
from spin_usd.formats.lens_models import distortion_of
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.frames import T_CAM_USDCAM
from spin_usd.geometry.transform import Transform

FILE, CLOUD, FRAMES = "transforms.json", "points.ply", "frames"
POINTS = 100_000  # of the cloud, at most
DEPTH = "depth"
METRES = 1e-3  # of a millimetre, in which depth is
WITHOUT_DEPTH = "export without depth: --option depth=no"
SPLITS = {"train": "train", "validation": "val", "test": "test"}
LENS = ("fl_x", "fl_y", "cx", "cy")
MATRIX, APPLIED = "transform_matrix", "applied_transform"
STAMP = "timestamp"  # of a frame, seconds since the start; nerfstudio passes over it
IDENTITY = np.eye(4).tolist()
CONVENTIONS = (
    "transform_matrix takes the camera's axes, which are OpenGL's (x right, y up, looking along -z), to the body axes "
    "of the target's model, which are the world's here; metres. Numbers have all their digits.",
    "cx and cy are in pixels with (0, 0) at the corner of the image, as in the dataset; k1, k2, k3, p1, p2 are "
    "OpenCV's. They are given once for all pictures, or in each frame if cameras differ.",
    "A mask is 255 where the target is visible and to be used, else 0.",
    f"{CLOUD} has up to {POINTS} points of the target's surface, of the label dense_pose, with normals and the colours "
    "of the images.",
    "nerfstudio moves and scales poses and points by itself; --center-method none --auto-scale-poses False keeps the "
    "body's axes and metres. orientation_override = none keeps them from being turned.",
    "Where there are several splits, train_filenames, val_filenames and test_filenames list them; nerfstudio needs "
    "all three, so a missing one of the latter two repeats the other.",
    "The target does not move, and the Sun and the background move around it instead: the brightness of a point "
    "may differ from picture to picture.",
)
IN_MILLIMETRES = "Depth is planar z in whole millimetres, 16-bit PNG, 0 for nothing."


def camera_to_world(T_cam_body: Transform) -> list[list[float]]:
    """Return the rows of the matrix (4, 4) from OpenGL's camera axes to the body's."""
    rows: list[list[float]] = (T_cam_body.inverse() @ T_CAM_USDCAM).matrix.tolist()
    return rows


def lens(camera: Camera) -> dict[str, Any]:
    """Return the camera's entries in transforms.json, for a fisheye with its model, which otherwise is stated once."""
    sizes = {"w": camera.width, "h": camera.height}
    lengths = {"fl_x": camera.fx, "fl_y": camera.fy, "cx": camera.cx, "cy": camera.cy}
    if camera.fisheye:
        model = {"camera_model": "OPENCV_FISHEYE"}
        return sizes | lengths | model | dict(zip(("k1", "k2", "k3", "k4"), camera.distortion, strict=True))
    k1, k2, p1, p2, k3 = camera.distortion
    return sizes | lengths | {"k1": k1, "k2": k2, "k3": k3, "p1": p1, "p2": p2}


def _indexes(dataset: ExportedDataset) -> Mapping[str, IndexFile]:
    head: dict[str, Any] = {"camera_model": "OPENCV", "orientation_override": "none", "ply_file_path": CLOUD}
    if dataset.options[DEPTH] == YES:
        head["depth_unit_scale_factor"] = METRES
    if len(cameras := exported_cameras(dataset)) == 1:
        head |= lens(cameras[0])
    lists = [f"{split}_filenames" for split in SPLITS.values()] if len(dataset.splits) > 1 else []
    return {FILE: json_lists(head, [FRAMES, *lists])}


def _files(dataset: ExportedDataset, original: ExportedPicture) -> Iterator[Output]:
    picture = as_exported(dataset, original)
    image = any_image(picture, f"images/{picture.name}{own_suffix(picture)}", rgb=dataset.options[RGB.name] == YES)
    mask = mask_image(picture, f"masks/{picture.name}.png")
    yield image
    yield mask
    frame: dict[str, Any] = {"file_path": image.path, "mask_path": mask.path}
    if dataset.options[DEPTH] == YES:
        depth = depth_image(picture, f"depths/{picture.name}.png")
        yield depth
        frame["depth_file_path"] = depth.path
    if len(exported_cameras(dataset)) > 1:
        frame |= lens(picture.camera)
    if picture.picture.time_s is not None:
        frame[STAMP] = picture.picture.time_s
    target = picture.target
    pose = Transform.from_quaternion(to="cam", of="body", q=target.q_cam_body, t=target.t_cam_body)
    yield IndexRow(path=FILE, section=FRAMES, value={**frame, MATRIX: camera_to_world(pose)})
    if len(dataset.splits) > 1:
        for split in _splits_with(dataset, picture.split):
            yield IndexRow(path=FILE, section=f"{split}_filenames", value=image.path)


def _splits_with(dataset: ExportedDataset, split: str) -> Iterator[str]:
    """Yield the split, and the other held-out split if it was not requested."""
    yield split
    held_out = ("val", "test")
    if split in held_out:
        yield from (other for other in held_out if other not in dataset.splits)


def _shared(dataset: ExportedDataset) -> Iterator[ExportFile]:
    yield cloud_file(dataset, CLOUD, POINTS)


def _layout(options: Mapping[str, Any]) -> Layout:
    depth = options[DEPTH] == YES
    return Layout(
        needs=("image", "segmentation", DENSE_POSE, *([DEPTH] if depth else [])),
        conventions=CONVENTIONS + ((IN_MILLIMETRES,) if depth else ()) + (RECTIFIED if options[RECTIFY] == YES else ()),
        files=_files,
        shared=_shared,
        indexes=_indexes,
        limits=(bodies_told_apart, views_of_one_target, *((depth_at_most(1, WITHOUT_DEPTH),) if depth else ())),
        splits=SPLITS,
    )


NERFSTUDIO = ExportFormat(
    name="nerfstudio",
    holds="as transforms.json with images, masks, depth and points",
    layout=_layout,
    options=(
        FormatOption(name=DEPTH, meaning="whether depth is exported", default=YES, choices=(YES, "no")),
        RECTIFYING,
        RGB,
    ),
)


def read_poses(path: Path) -> Iterator[PoseEntry | str]:
    """Read the frames of the file at `path`, whose world is taken for the body. Raises InputError that names the
    frame."""
    document = read_json_file(path, MAX_POSE_LIST)
    frames = document.get(FRAMES) if isinstance(document, dict) else None
    if not isinstance(frames, list):
        raise InputError("has no list of frames", where=path, do="give a transforms.json as nerfstudio has it")
    if any(set(LENS) & set(frame) for frame in frames if isinstance(frame, dict)):
        yield "frames have cameras of their own there: all pictures are taken with --camera alone"
    T_applied_body, scale = _applied(document, str(path))
    for i, frame in enumerate(frames):
        where = f"{path}, frame {i}"
        name = frame.get("file_path") if isinstance(frame, dict) else None
        if not isinstance(name, str):
            raise InputError("has no file_path", where=where, do="name the picture's file")
        T_applied_usdcam, off = _transform(frame.get(MATRIX), MATRIX, where, of="usdcam", scale=scale)
        T_cam_body = T_CAM_USDCAM @ T_applied_usdcam.inverse() @ T_applied_body
        q, t = T_cam_body.quaternion.tolist(), T_cam_body.translation.tolist()
        time = frame.get(STAMP)
        time = float(time) if isinstance(time, int | float) else None
        yield PoseEntry(filename=name, q_cam_body=q, t_cam_body=t, off_rotation=off, time=time)


def _applied(document: Mapping[str, Any], where: str) -> tuple[Transform, float]:
    """Return the transformation that nerfstudio applied to the poses it wrote: rotation and translation of their world,
    then the scale. Raises InputError."""
    (scale,) = finite_numbers([document.get("applied_scale", 1.0)], 1, "applied_scale", where)
    if scale <= 0:
        raise InputError(f"applied_scale is {scale:g}", where=where, do="give a number above 0")
    return _transform(document.get(APPLIED, IDENTITY), APPLIED, where, of="body")[0], scale


def _transform(rows: Any, name: str, where: str, *, of: str, scale: float = 1.0) -> tuple[Transform, float]:
    """Return the transform to the file's world, unscaled, that a matrix is, and by how much it misses being one. Raises
    InputError."""
    if not isinstance(rows, list) or len(rows) not in (3, 4):
        raise InputError(f"{name} is not a list of 4 rows", where=where)
    matrix = np.array([finite_numbers(row, 4, f"a row of {name}", where) for row in rows])
    turn, off = quaternion_of(matrix[:3, :3].ravel().tolist(), name, where)
    return Transform.from_quaternion(to="applied", of=of, q=turn, t=matrix[:3, 3] / scale), off


NERFSTUDIO_POSES = PoseFormat(
    name="nerfstudio",
    recognises=lambda path, head: path.name == FILE or (head.lstrip().startswith("{") and f'"{MATRIX}"' in head),
    read=read_poses,
    lists=files_like(FILE, "transforms_*.json"),
    rotation="a rotation from OpenGL's camera axes to the body's, row by row",
)


def read_camera(path: Path) -> Calibration:
    """Read the one camera of the transforms.json at `path`. Raises InputError."""
    said = read_json_file(path, MAX_POSE_LIST)
    frames = said.get(FRAMES, []) if isinstance(said, dict) else None
    if not isinstance(frames, list) or "distortion_params" in said:
        do = "give one JSON object, with k1, k2, p1 and p2 beside fl_x, and a list of frames"
        raise InputError("has no camera under the supported names", where=path, do=do)
    if any({*LENS, "w", "h", "k1", "camera_model"} & set(frame) for frame in frames if isinstance(frame, dict)):
        do = "write the camera of one of them, as COLMAP's cameras.txt or as OpenCV does"
        raise InputError("has cameras of its own in its frames", where=path, do=do)
    fisheye = bool(said.get("is_fisheye", said.get("camera_model") == "OPENCV_FISHEYE"))
    model = str(said.get("camera_model", "OPENCV_FISHEYE" if fisheye else "OPENCV"))
    if fisheye != (model == "OPENCV_FISHEYE"):
        found = f"has the camera_model {model!r}, and is_fisheye {said['is_fisheye']!r}"
        raise InputError(found, where=path, do="leave one of them out")
    names = ("k1", "k2", "k3", "k4") if fisheye else ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
    given = [said.get("w"), said.get("h"), *(said.get(name) for name in LENS), *(said.get(name, 0.0) for name in names)]
    width, height, fx, fy, cx, cy, *k = finite_numbers(given, len(given), f"w, h, {', '.join(LENS)} or k", str(path))
    distortion = distortion_of(k, model.removeprefix("SIMPLE_"), path)
    return Calibration(size=whole([width, height], path), projection=(fx, fy, cx, cy), distortion=distortion)


NERFSTUDIO_CAMERA = CameraFormat(
    name="nerfstudio", first_centre=CORNER, recognises=lambda path, head: '"fl_x"' in head, read=read_camera
)
