"""KITTI's raw recordings: images of one camera or a stereo pair, LiDAR points, calibration, depth and disparity.

A recording is an augmentation; its folder stands where KITTI has a date. Cameras 0 and 1 are grey, 2 and 3 in colour,
the even ones left; pictures are without lens distortion. P_rect takes the axes of camera 0, which is the first here, to
pixels, whose centres are at whole numbers. Depth and disparity are 16-bit PNG of 1/256 m and 1/256 px, 0 for nothing.
Source: Geiger et al., "Vision meets Robotics: The KITTI Dataset" (2013), the development kits of the raw data and of
the benchmarks of stereo (2015) and depth, and pykitti 0.3.1, which reads it.
"""

from collections.abc import Iterator, Mapping, Sequence
from datetime import timedelta
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import UNSET
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.errors import UnsupportedError
from spin_usd.exchange.layout.export_format import ExportFile, ExportFormat, IndexRow, Layout, MadeFile, Output
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.images import any_image
from spin_usd.exchange.layout.index_file import IndexFile, text_lines, write_text_file
from spin_usd.exchange.layout.limits import UINT16_MAX, undistorted
from spin_usd.exchange.layout.rectified_picture import RECTIFIED, RECTIFY, RECTIFY_IT, RECTIFYING, YES, as_exported
from spin_usd.exchange.layout.stamps import EPOCH, SAYS, stamp_of
from spin_usd.formats.image_file import write_image
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.geometry.transform import Transform
from spin_usd.labels.displacement import PointState
from spin_usd.reading.picture import Picture
from spin_usd.scene.scene import augmentation_and_camera

STEPS = 256.0  # of a metre, or a pixel
FIRST_CENTRE = 0.0  # where the first pixel has its centre
PARALLEL = 1e-9  # tolerance for rounding: between axes, radians; of a baseline's parts across, metres
CONVENTIONS = (
    "AUGMENTATION/AUGMENTATION_drive_0001_sync is a recording, as KITTI has DATE/DATE_drive_NUMBER_sync, and a file's "
    "number is the picture's place in the stage. image_00 (grey) or image_02 (colour) is the first camera's, image_01 "
    f"or image_03 the second's. {SAYS} oxts has nothing else; the motion of the target is in the record's pose.",
    "P_rect and K have pixels whose centres are at whole numbers: half a pixel less than in the dataset. The four "
    "cameras of the calibration are two, each in grey and in colour.",
    "velodyne_points are the LiDAR's points in its own axes, x forward, y left, z up, metres, with reflectance 1; "
    "calib_velo_to_cam.txt takes them to the first camera's.",
    "proj_depth/groundtruth/image_0x is depth of every pixel with a surface, 1/256 m; disp_occ/image_0x is "
    "disparity, 1/256 px, and disp_noc/image_0x disparity of pixels whose point both cameras see, from the label "
    "disparity. Numbers beyond 16 bits are 0.",
)


def _files(dataset: ExportedDataset, original: ExportedPicture) -> Iterator[Output]:
    picture = as_exported(dataset, original)
    _refuse_another_calibration(dataset, original)
    camera = _camera_number(picture)
    drive, number = _drive(picture), f"{picture.picture.index:010d}"
    image = f"image_{camera:02d}"
    yield any_image(picture, f"{drive}/{image}/data/{number}.png")
    yield IndexRow(path=f"{drive}/{image}/timestamps.txt", value=_time(picture.picture))
    depth = f"{drive}/proj_depth/groundtruth/{image}/{number}.png"
    yield MadeFile(path=depth, write=partial(_write_depth, picture))
    baseline = abs(_rig(dataset, picture.variant).translation[0])
    for kind in ("occ", *(["noc"] if picture.has("disparity") else [])) if baseline else ():
        path = f"{drive}/disp_{kind}/{image}/{number}.png"
        yield MadeFile(path=path, write=partial(_write_disparity, picture, baseline, kind == "noc"))
    if camera in (0, 2):
        yield IndexRow(path=f"{drive}/oxts/timestamps.txt", value=_time(picture.picture))
    if picture.has("lidar") and camera in (0, 2):
        path = f"{drive}/velodyne_points/data/{number}.bin"
        yield MadeFile(path=path, write=partial(_write_points, picture.picture))
        yield IndexRow(path=f"{drive}/velodyne_points/timestamps.txt", value=_time(picture.picture))


def _indexes(dataset: ExportedDataset) -> Mapping[str, IndexFile]:
    """Timestamps of the files of each recording."""
    found: dict[str, IndexFile] = {}
    for variant in dataset.variants:
        first = dataset.first(variant)
        kinds = [f"image_{_camera_number(first):02d}"]
        if not augmentation_and_camera(variant)[1]:
            kinds += ["oxts", *(["velodyne_points"] if first.has("lidar") else [])]
        found |= {f"{_drive(first)}/{kind}/timestamps.txt": text_lines() for kind in kinds}
    return found


def _shared(dataset: ExportedDataset) -> Iterator[ExportFile]:
    """Yield the calibration of each recording. Raises UnsupportedError for cameras that KITTI has no form for."""
    for variant in dict.fromkeys(augmentation_and_camera(each)[0] for each in dataset.variants):
        pair = [each for each in dataset.variants if augmentation_and_camera(each)[0] == variant]
        if variant not in pair:
            found = "is of a further camera, but KITTI's positions are in the first one's axes"
            raise UnsupportedError(found, where=pair[0], do=f"export {variant} too")
        if len(pair) > 2:
            do = f"choose two with --variants, such as {variant},{next(each for each in pair if each != variant)}"
            raise UnsupportedError(f"has {len(pair)} cameras, and KITTI's stereo has two", where=variant, do=do)
        pictures = [as_exported(dataset, dataset.first(each)) for each in pair]
        rig = _rig(dataset, pair[-1])
        _refuse_unless_rectified(pictures, rig)
        projections = [_projection(picture, rig if number else None) for number, picture in enumerate(pictures)]
        yield _text(f"{variant}/calib_cam_to_cam.txt", _cameras(pictures, (projections * 2)[:2]))
        recorded = pictures[0].picture.recorded.lidar
        placed = (np.eye(3), np.zeros(3))
        if recorded is not UNSET:
            placed = (matrix_from_quaternion(recorded.q_cam_lidar), np.array(recorded.t_cam_lidar))
        yield _text(f"{variant}/calib_velo_to_cam.txt", _placed(*placed))
        yield _text(f"{variant}/calib_imu_to_velo.txt", _placed(np.eye(3), np.zeros(3)))


def _refuse_unless_rectified(pictures: Sequence[ExportedPicture], rig: Transform) -> None:
    """Raise UnsupportedError unless the second camera is the first one, moved to the right along its x axis."""
    turned = float(np.abs(rig.rotation - np.eye(3)).max())
    aside = np.abs(rig.translation[1:]).max() > PARALLEL or rig.translation[0] < 0
    if turned > PARALLEL or aside or pictures[0].camera != pictures[-1].camera:
        found = "is not a rectified pair: one camera is turned, not to the right of the other, or has another K"
        raise UnsupportedError(found, where=pictures[-1].variant, do="author --camera NAME --camera NAME:BASELINE,0,0")


def _refuse_another_calibration(dataset: ExportedDataset, picture: ExportedPicture) -> None:
    """Raise UnsupportedError for a picture whose camera is not as in the first of its variant: a recording has one
    calibration."""
    first = dataset.first(picture.variant)
    here, there = (each.picture.recorded.rig for each in (picture, first))
    if picture.camera != first.camera or here != there:
        found = "has another lens, or another place in its rig, than the first picture, and KITTI has one calibration"
        raise UnsupportedError(found, where=picture.name, do="choose pictures of one with --frames")


def _rig(dataset: ExportedDataset, variant: str) -> Transform:
    """Return T_first_cam of the variant's camera; for the first of a stereo pair the second's, with the same
    baseline."""
    augmentation, _ = augmentation_and_camera(variant)
    others = (each for each in dataset.variants if each != variant and each.startswith(f"{augmentation}-"))
    return _recorded_rig(dataset.first(variant if variant != augmentation else next(others, variant)).picture)


def _recorded_rig(picture: Picture) -> Transform:
    rig = picture.recorded.rig
    q, t = ((1, 0, 0, 0), (0, 0, 0)) if rig is UNSET else (rig.q_first_cam, rig.t_first_cam)
    return Transform.from_quaternion(to="cam", of="cam", q=q, t=t)


def _camera_number(picture: ExportedPicture) -> int:
    colour = picture.picture.files["image"].channels > 1
    return 2 * colour + bool(augmentation_and_camera(picture.variant)[1])


def _drive(picture: ExportedPicture) -> str:
    augmentation, _ = augmentation_and_camera(picture.variant)
    return f"{augmentation}/{augmentation}_drive_0001_sync"


def _time(picture: Picture) -> str:
    """Return the picture's timestamp as KITTI writes it."""
    seconds, nanoseconds = divmod(stamp_of(picture), 10**9)
    return f"{EPOCH + timedelta(seconds=seconds):%Y-%m-%d %H:%M:%S}.{nanoseconds:09}"


def _projection(picture: ExportedPicture, rig: Transform | None) -> Float:
    """Return P_rect (3, 4) of a camera that stands so in the first one's axes."""
    camera, shift = picture.camera, FIRST_CENTRE - 0.5
    K = np.array([[camera.fx, 0, camera.cx + shift], [0, camera.fy, camera.cy + shift], [0, 0, 1]])
    return np.asarray(K @ np.column_stack([np.eye(3), np.zeros(3) if rig is None else -rig.translation]))


def _cameras(pictures: Sequence[ExportedPicture], projections: Sequence[Float]) -> str:
    """Return the text of calib_cam_to_cam.txt: cameras 0 and 2 are the first, 1 and 3 the second."""
    size = (float(pictures[0].camera.width), float(pictures[0].camera.height))
    lines = ["calib_time: 01-Jan-2000 00:00:00", f"corner_dist: {_numbers([1.0])}"]
    for number in range(4):
        P = projections[number % 2]
        said = {
            "S": size,
            "K": P[:, :3].ravel(),
            "D": np.zeros(5),
            "R": np.eye(3).ravel(),
            "T": P[:, 3] / P[0, 0],
            "S_rect": size,
            "R_rect": np.eye(3).ravel(),
            "P_rect": P.ravel(),
        }
        lines += [f"{name}_{number:02d}: {_numbers(values)}" for name, values in said.items()]
    return "".join(f"{line}\n" for line in lines)


def _placed(rotation: Float, translation: Float) -> str:
    return f"calib_time: 01-Jan-2000 00:00:00\nR: {_numbers(rotation.ravel())}\nT: {_numbers(translation)}\n"


def _numbers(values: Sequence[float] | Float) -> str:
    return " ".join(repr(float(value)) for value in values)


def _text(path: str, text: str) -> MadeFile:
    return MadeFile(path=path, write=write_text_file(text))


def _write_depth(picture: ExportedPicture, path: Path) -> None:
    _write_steps(path, picture.label("depth").astype(np.float64))


def _write_disparity(picture: ExportedPicture, baseline: float, seen_by_both: bool, path: Path) -> None:
    depth = picture.label("depth").astype(np.float64)
    shown = depth > 0
    if seen_by_both:
        shown &= picture.label("disparity")[..., 2] == PointState.SEEN
    _write_steps(path, np.divide(picture.camera.fx * baseline, depth, out=np.zeros_like(depth), where=shown))


def _write_steps(path: Path, values: Float) -> None:
    """Write (H, W) in steps of 1/256; numbers beyond 16 bits become 0."""
    steps = np.rint(values * STEPS)
    write_image(path, np.where(steps <= UINT16_MAX, steps, 0).astype(np.uint16), channels=("Y",))


def _write_points(picture: Picture, path: Path) -> None:
    points: NDArray[np.float32] = picture.lidar.points
    path.write_bytes(np.column_stack([points, np.ones(len(points))]).astype("<f4").tobytes())


def _layout(options: Mapping[str, Any]) -> Layout:
    rectify = options[RECTIFY] == YES
    return Layout(
        needs=("image", "depth"),
        first_centre=FIRST_CENTRE,
        conventions=CONVENTIONS + (RECTIFIED if rectify else ()),
        files=_files,
        shared=_shared,
        indexes=_indexes,
        limits=() if rectify else (undistorted(RECTIFY_IT),),
    )


KITTI = ExportFormat(
    name="kitti",
    holds="raw recordings of a camera or a stereo pair, with depth, disparity and LiDAR points",
    layout=_layout,
    options=(RECTIFYING,),
)
