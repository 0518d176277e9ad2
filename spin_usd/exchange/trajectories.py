"""Trajectories of a camera in a world, as odometry and SLAM write them: of TUM, EuRoC and KITTI.

TUM's is written too. Each line has a time in seconds, a position and a scalar-last quaternion, separated by blanks;
EuRoC has nanoseconds, a position and a scalar-first quaternion, separated by commas; KITTI has twelve numbers, a matrix
of three rows. A heading may give another unit of time, and so may the size of TUM's stamps: ROS's are nanoseconds. All
transform the camera's axes, which are OpenCV's, to the world's, in metres. We use the world as the body. A time is the
name of its picture, as for the images of TUM and EuRoC; pictures have it in seconds since the first. Poses of EuRoC are
of the body that carries the camera, its IMU: the camera's pose on it (T_BS of sensor.yaml) is not in the list. Source:
TUM's RGB-D benchmark ("File Formats"), EuRoC's state_groundtruth_estimate0/data.csv, KITTI's odometry devkit.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from spin_usd.errors import InputError
from spin_usd.exchange.layout.export_format import ExportFormat, IndexRow, Layout, Output
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.images import any_image, own_suffix
from spin_usd.exchange.layout.index_file import text_lines
from spin_usd.exchange.layout.limits import one_variant
from spin_usd.exchange.layout.stamps import SAYS, stamp_of
from spin_usd.exchange.pose_format import SCALAR_LAST, PoseEntry, PoseFormat, files_like
from spin_usd.exchange.pose_numbers import finite_numbers, quaternion_of
from spin_usd.exchange.pose_times import PLACES, PoseTimes
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.formats.text_file import lines_of
from spin_usd.geometry.rotation import QUATERNION_NORM_ROUNDED
from spin_usd.geometry.transform import Transform

NOTE = (
    "is a trajectory as {} has it: poses of a camera in a world, whose axes are taken for the body's; if yours has the "
    "body's poses in the camera's axes, give a CSV with the columns name, qw, qx, qy, qz, x, y, z"
)
TIME_UNIT = re.compile(r"#\s*time\w*?[\s_]*[\[(]\s*(\w+)\s*[\])]")
"""A heading of the column of times, and their unit."""
TUM_LIST, TUM_IMAGES = "groundtruth.txt", "rgb.txt"
TUM_HEADS = {TUM_LIST: "timestamp tx ty tz qx qy qz qw", TUM_IMAGES: "timestamp filename"}
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
Pose = Callable[[list[float], str], tuple[Sequence[float], Sequence[float], float]]
"""A line's numbers, and where they are, to the quaternion, scalar first, the position, and how far it missed one."""


def _read(path: Path, *, name: str, count: int, timed: bool, pose: Pose, headed: bool) -> Iterator[PoseEntry | str]:
    """Yield a note and the entries. headed: whether columns have headings, and further columns may follow."""
    yield NOTE.format(name)
    if headed:
        yield "its poses are of the body that carries the camera: T_BS of sensor.yaml is not applied"
    place, again, last, times = 0, 0, None, PoseTimes(from_first=True)
    for number, line in enumerate(lines_of(path, MAX_POSE_LIST), 1):
        words, where = line.replace(",", " ").split(), f"{path}, line {number}"
        if not words or words[0].startswith("#"):
            if (unit := TIME_UNIT.match(line.lower())) and unit[1] in PLACES:
                times.unit = unit[1]
            if headed:
                _check_heads(line, where)
            continue
        if not headed and len(words) != count + timed:
            raise InputError(f"has {len(words)} numbers, expected {count + timed}", where=where, do="mend the line")
        try:
            values = [float(word) for word in words[timed : count + timed]]
        except ValueError:
            raise InputError("contains text that is not a number", where=where) from None
        q, t, off = pose(finite_numbers(values, count, "the pose", where), where)
        norm = float(np.linalg.norm(q))
        if not abs(norm - 1) <= QUATERNION_NORM_ROUNDED:
            raise InputError(f"the quaternion has norm {norm:.9g}, expected 1", where=where, do="give a rotation")
        T_cam_body = Transform.from_quaternion(to="body", of="cam", q=np.asarray(q) / norm, t=t).inverse()
        q, t = T_cam_body.quaternion.tolist(), T_cam_body.translation.tolist()
        filename = words[0] if timed else f"{place:06}"
        if headed and not times.unit:
            times.unit = "ns" if words[0].isdigit() else "s"
        time = times.seconds(words[0], where) if timed else None
        if timed and time == last:
            again += 1
            continue
        last = time
        if times.by_size and not place:
            yield times.note
        epoch = times.epoch
        yield PoseEntry(
            filename=filename, q_cam_body=q, t_cam_body=t, line=number, off_rotation=off, time=time, epoch=epoch
        )
        place += 1
    if again:
        yield f"{again} of its poses have the time of the one above, and are left out"


def _check_heads(line: str, where: str) -> None:
    """Raise InputError for headings of other columns than we read, or of other units than metres."""
    heads = [re.sub(r"\s*\[m?\]$", "", head.strip()) for head in line.split(",")[1:8]]
    if len(heads) == 7 and [head[-1:] for head in heads] != list("xyzwxyz"):
        do = "give the position in metres, and the quaternion scalar first"
        raise InputError(f"has the columns {', '.join(heads)}", where=where, do=do)


def _matrix(values: list[float], where: str) -> tuple[Sequence[float], Sequence[float], float]:
    rows = [values[4 * row : 4 * row + 4] for row in range(3)]
    q, off = quaternion_of([each for row in rows for each in row[:3]], "the matrix", where)
    return q, [row[3] for row in rows], off


def _of(
    name: str,
    first: str,
    *,
    count: int,
    pose: Pose,
    timed: bool = True,
    headed: bool = False,
    lists: Callable[[Path], Sequence[Path]] = lambda folder: (),
) -> PoseFormat:
    """Return the format whose head matches the pattern `first`."""
    return PoseFormat(
        name=name,
        recognises=lambda path, head: bool(re.match(rf"(?:\s*#[^\n]*\n)*?\s*(?:{first})", head)),
        read=partial(_read, name=name, count=count, timed=timed, pose=pose, headed=headed),
        lists=lists,
        rotation=SCALAR_LAST,
    )


EUROC_POSES = _of(
    "EuRoC",
    r"#\s*time[^\n,]*,\s*(?:[^\n]*p_|[pt]?_?x\b)",
    count=7,
    pose=lambda v, _: (v[3:], v[:3], 0.0),
    headed=True,
)
TUM_POSES = _of(
    "TUM",
    rf"{NUMBER}(?:[ \t]+{NUMBER}){{7}}\s*(?:\n|$)",
    count=7,
    pose=lambda v, _: ([v[6], *v[3:6]], v[:3], 0.0),
    lists=files_like(TUM_LIST),
)
KITTI_POSES = _of("KITTI", rf"{NUMBER}(?:[ \t]+{NUMBER}){{11}}\s*(?:\n|$)", count=12, pose=_matrix, timed=False)


def _files(dataset: ExportedDataset, picture: ExportedPicture) -> Iterator[Output]:
    """Yield the image, and its lines in both lists."""
    seconds, nanoseconds = divmod(stamp_of(picture.picture), 10**9)
    decimals = f"{nanoseconds:09}"
    stamp = f"{seconds}.{decimals.removesuffix('000')}"
    image = any_image(picture, f"rgb/{picture.name}{own_suffix(picture)}")
    target = picture.target
    T_cam_body = Transform.from_quaternion(to="cam", of="body", q=target.q_cam_body, t=target.t_cam_body)
    T_body_cam = T_cam_body.inverse()
    w, *xyz = T_body_cam.quaternion.tolist()
    pose = " ".join(repr(each) for each in (*T_body_cam.translation.tolist(), *xyz, w))
    yield image
    yield IndexRow(path=TUM_IMAGES, value=f"{stamp} {image.path}")
    yield IndexRow(path=TUM_LIST, value=f"{stamp} {pose}")


TUM = ExportFormat(
    name="tum",
    holds="as a trajectory of TUM's RGB-D benchmark: groundtruth.txt, rgb.txt and images",
    layout=lambda options: Layout(
        needs=("image",),
        conventions=(
            "groundtruth.txt has in each line a timestamp, tx ty tz and qx qy qz qw of the camera in the target's "
            f"axes, in metres; rgb.txt a timestamp and an image. {SAYS} They are seconds since 1970.",
            "Images are as the camera took them, with its lens distortion.",
        ),
        files=_files,
        indexes=lambda dataset: {name: text_lines(f"# {head}\n") for name, head in TUM_HEADS.items()},
        limits=(one_variant,),
        splits={"train": "train"},
    ),
)
