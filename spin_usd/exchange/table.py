"""The data sets of others that are written and read.

A new one is a file of its own and an entry here.
"""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

from spin_usd.basics.suggestion import suggestion
from spin_usd.errors import InputError, SpinError
from spin_usd.exchange.bop import BOP, BOP_CAMERA, BOP_POSES
from spin_usd.exchange.cameras.camera_format import CameraFormat
from spin_usd.exchange.cameras.opencv_camera import OPENCV_CAMERAS
from spin_usd.exchange.coco import COCO, COCO_POSES
from spin_usd.exchange.colmap import COLMAP, COLMAP_CAMERA, COLMAP_POSES
from spin_usd.exchange.croissant import CROISSANT, CROISSANT_POSES
from spin_usd.exchange.csv_poses import CSV_POSES
from spin_usd.exchange.events import EVENT_FORMATS
from spin_usd.exchange.kitti import KITTI
from spin_usd.exchange.layout.export_format import ExportFormat
from spin_usd.exchange.nerfstudio import NERFSTUDIO, NERFSTUDIO_CAMERA, NERFSTUDIO_POSES
from spin_usd.exchange.parquet import PARQUET, PARQUET_POSES
from spin_usd.exchange.pose_format import PoseFormat
from spin_usd.exchange.record_poses import RECORD
from spin_usd.exchange.rosbag2 import ROSBAG2
from spin_usd.exchange.shirt import SHIRT
from spin_usd.exchange.spades import SPADES, SPADES_POSES
from spin_usd.exchange.spark import CUBESAT_CDT, SPARK, SPARK_POSES
from spin_usd.exchange.speed import SPEED
from spin_usd.exchange.speedplus import SPEEDPLUS, SPEEDPLUS_CAMERA, SPEEDPLUS_POSES
from spin_usd.exchange.swisscube import SWISSCUBE
from spin_usd.exchange.trajectories import EUROC_POSES, KITTI_POSES, TUM, TUM_POSES
from spin_usd.exchange.unknown_target import UNKNOWN_TARGET
from spin_usd.exchange.urso import URSO, URSO_POSES
from spin_usd.exchange.video import VIDEO
from spin_usd.exchange.webdataset import WEBDATASET, WEBDATASET_POSES
from spin_usd.exchange.yolo import YOLO
from spin_usd.files.size_limits import MAX_SHARD
from spin_usd.files.user_file import open_file

Format = TypeVar("Format", PoseFormat, CameraFormat)
POSE_HEAD, CAMERA_HEAD = 1 << 12, 1 << 16  # bytes, by which formats recognise files

_ALL = (
    SPEEDPLUS,
    SPEED,
    SHIRT,
    SPARK,
    URSO,
    CUBESAT_CDT,
    COCO,
    YOLO,
    BOP,
    SWISSCUBE,
    WEBDATASET,
    CROISSANT,
    PARQUET,
    NERFSTUDIO,
    COLMAP,
    UNKNOWN_TARGET,
    KITTI,
    TUM,
    ROSBAG2,
    VIDEO,
    SPADES,
    *EVENT_FORMATS,
)
EXPORT_FORMATS = {each.name: each for each in _ALL}
"""By name."""
POSE_FORMATS: tuple[PoseFormat, ...] = (
    RECORD,
    SPARK_POSES,
    URSO_POSES,
    BOP_POSES,
    COCO_POSES,
    WEBDATASET_POSES,
    CROISSANT_POSES,
    PARQUET_POSES,
    SPADES_POSES,
    NERFSTUDIO_POSES,
    COLMAP_POSES,
    EUROC_POSES,
    TUM_POSES,
    KITTI_POSES,
    CSV_POSES,
    SPEEDPLUS_POSES,
)
"""The formats of pose lists, in the order in which they are tried on a file."""

CAMERA_FORMATS: tuple[CameraFormat, ...] = (
    SPEEDPLUS_CAMERA,
    BOP_CAMERA,
    COLMAP_CAMERA,
    NERFSTUDIO_CAMERA,
    *OPENCV_CAMERAS,
)
"""The formats of calibrations, in the order in which they are tried on a file."""


def format_named(name: str) -> ExportFormat:
    """Return the format of that name. Raises InputError that lists those there are."""
    if name not in EXPORT_FORMATS:
        raise InputError(f"there is no format {name!r}", do=suggestion(name, EXPORT_FORMATS))
    return EXPORT_FORMATS[name]


def recognised(path: Path, formats: Sequence[Format], head_bytes: int) -> tuple[Format, str]:
    """Return the first format that recognises the file, and the file's head; one that cannot be read is left to its
    reader to refuse, its head empty."""
    head = ""
    with suppress(InputError, OSError), open_file(path, MAX_SHARD) as file:
        head = file.read(head_bytes).decode("utf-8-sig", "replace")
    return next(each for each in formats if each.recognises(path, head)), head


def refuse_of_other_option(path: Path, of: PoseFormat | CameraFormat) -> None:
    """Raise InputError for a calibration given as poses, and for poses given as a camera. `of`: the format that refuses
    the file; one that recognised it is right about its kind."""
    found, do = "", ""
    with suppress(SpinError, StopIteration):
        if of is POSE_FORMATS[-1]:
            camera, _ = recognised(path, CAMERA_FORMATS, CAMERA_HEAD)
            camera.read(path)
            found, do = f"is a calibration ({camera.name})", "give it as --camera"
        elif of is CAMERA_FORMATS[-1]:
            poses, _ = recognised(path, POSE_FORMATS, POSE_HEAD)
            next(poses.read(path))
            found, do = f"is a pose list ({poses.name})", "give it as --poses"
    if found:
        raise InputError(found, where=path, do=do) from None
