"""rosbag2: a bag of ROS 2 for each variant, with MCAP as its storage.

Source: REP 103 (axes of optical frames), REP 118 (depth images), sensor_msgs and tf2_msgs of ROS 2 Humble. The package
`rosbags` writes the storage and serialises the messages.
"""

import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.exchange.bop_scenes import camera_matrix
from spin_usd.exchange.layout.export_format import ExportFormat, Layout, MadeFile, Output
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.limits import needs_extra
from spin_usd.exchange.layout.stamps import SAYS, stamp_of
from spin_usd.geometry.rotation import quaternion_from_matrix

CENTRE = 0.0  # of the first pixel, as OpenCV and image_geometry have it
CAMERA, LIDAR = "camera_optical_frame", "lidar_link"
VERSION: Literal[8] = 8  # of metadata.yaml, which ROS 2 reads from Iron on; the storage is read by Humble too
IMAGE, INFO, DEPTH = "/camera/image_raw", "/camera/camera_info", "/camera/depth"
POINTS, POSE, TF = "/lidar/points", "/target/pose", "/tf"
TYPES: Mapping[str, str] = {
    IMAGE: "sensor_msgs/msg/Image",
    INFO: "sensor_msgs/msg/CameraInfo",
    DEPTH: "sensor_msgs/msg/Image",
    POINTS: "sensor_msgs/msg/PointCloud2",
    POSE: "geometry_msgs/msg/PoseStamped",
    TF: "tf2_msgs/msg/TFMessage",
}
ENCODINGS = {("uint8", 1): "mono8", ("uint16", 1): "mono16", ("uint8", 3): "rgb8", ("uint16", 3): "rgb16"}
FLOATS = {1: "32FC1", 3: "32FC3"}
FLOAT32 = 7  # of sensor_msgs/PointField
CONVENTIONS = (
    f"VARIANT is a bag of one variant. Topics: {', '.join(f'{topic} ({kind})' for topic, kind in TYPES.items())}.",
    f"{SAYS} All messages of a picture have its stamp.",
    f"{CAMERA} has REP 103's optical axes: x right, y down, z forward. {TF} has each target's body axes in it, by its "
    f"name, and those of `{LIDAR}`: x forward, y left, z up. {POSE} is the chosen target's. Metres; quaternions are "
    "scalar last, as ROS has them.",
    "CameraInfo: plumb_bob (k1, k2, p1, p2, k3) or equidistant (k1 to k4), in pixels whose first has its centre at 0.",
    f"{DEPTH}: 32FC1, metres along z; NaN where there is no surface (REP 118).",
)
Message = tuple[str, Any]
"""A topic, and its message."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Bag:
    """A bag of one variant, made once for its two files."""

    dataset: ExportedDataset
    numbers: list[int]
    name: str
    made: dict[str, bytes] = field(default_factory=dict)
    """Content of metadata.yaml, once the other is made."""

    def write(self, file: str, path: Path) -> None:
        """Write that file of the bag."""
        if file in self.made:
            path.write_bytes(self.made[file])
            return
        with tempfile.TemporaryDirectory(dir=path.parent) as folder:
            bag = Path(folder) / self.name
            self._record(bag)
            self.made["metadata.yaml"] = (bag / "metadata.yaml").read_bytes()
            (bag / file).replace(path)

    def _record(self, bag: Path) -> None:
        from rosbags.rosbag2 import StoragePlugin, Writer  # not above: an extra
        from rosbags.typesys import Stores, get_typestore

        store = get_typestore(Stores.ROS2_HUMBLE)
        with Writer(bag, version=VERSION, storage_plugin=StoragePlugin.MCAP) as writer:
            topics: dict[str, Any] = {}
            for picture in map(self.dataset.picture, self.numbers):
                nanoseconds = stamp_of(picture.picture)
                for topic, message in _messages(picture, nanoseconds, store.types):
                    kind = TYPES[topic]
                    if topic not in topics:
                        topics[topic] = writer.add_connection(topic, kind, typestore=store)
                    writer.write(topics[topic], nanoseconds, store.serialize_cdr(message, kind))


def _messages(picture: ExportedPicture, nanoseconds: int, types: Mapping[str, Any]) -> Iterator[Message]:
    """Yield the messages of a picture; `types`: the classes of messages by their names."""
    stamp = types["builtin_interfaces/msg/Time"](sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)
    header = partial(types["std_msgs/msg/Header"], stamp=stamp)
    of_camera = header(frame_id=CAMERA)
    yield IMAGE, _image(picture.image, of_camera, types)
    yield INFO, _camera_info(picture, of_camera, types)
    if picture.has("depth"):
        depth = picture.label("depth")
        yield DEPTH, _image(np.where(depth > 0, depth, np.float32(np.nan)), of_camera, types)
    frames = {target.name: target.T_cam_body for target in picture.targets}
    if picture.has("lidar"):
        cloud = picture.picture.lidar
        frames[LIDAR] = cloud.T_cam_lidar
        yield POINTS, _points(cloud.points, header(frame_id=LIDAR), types)
    place, turn = _place_and_turn(picture.target.T_cam_body, types, "Point")
    pose = types["geometry_msgs/msg/Pose"](position=place, orientation=turn)
    yield POSE, types[TYPES[POSE]](header=of_camera, pose=pose)
    transforms = []
    for name, matrix in frames.items():
        place, turn = _place_and_turn(matrix, types, "Vector3")
        transform = types["geometry_msgs/msg/Transform"](translation=place, rotation=turn)
        stamped = types["geometry_msgs/msg/TransformStamped"]
        transforms.append(stamped(header=of_camera, child_frame_id=name, transform=transform))
    yield TF, types[TYPES[TF]](transforms=transforms)


def _image(array: NDArray[Any], header: Any, types: Mapping[str, Any]) -> Any:
    channels = 1 if array.ndim == 2 else array.shape[2]
    encoding = FLOATS[channels] if array.dtype == np.float32 else ENCODINGS[array.dtype.name, channels]
    array = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
    return types[TYPES[IMAGE]](
        header=header,
        height=array.shape[0],
        width=array.shape[1],
        encoding=encoding,
        is_bigendian=0,
        step=array.strides[0],
        data=array.reshape(-1).view(np.uint8),
    )


def _camera_info(picture: ExportedPicture, header: Any, types: Mapping[str, Any]) -> Any:
    camera = picture.camera
    k = np.array(camera_matrix(camera, first_centre=CENTRE))
    return types[TYPES[INFO]](
        header=header,
        height=camera.height,
        width=camera.width,
        distortion_model="equidistant" if camera.fisheye else "plumb_bob",
        d=np.array(camera.distortion, np.float64),
        k=k,
        r=np.eye(3).reshape(-1),
        p=np.pad(k.reshape(3, 3), ((0, 0), (0, 1))).reshape(-1),
        binning_x=0,
        binning_y=0,
        roi=types["sensor_msgs/msg/RegionOfInterest"](x_offset=0, y_offset=0, height=0, width=0, do_rectify=False),
    )


def _points(points: NDArray[np.float32], header: Any, types: Mapping[str, Any]) -> Any:
    of = partial(types["sensor_msgs/msg/PointField"], datatype=FLOAT32, count=1)
    data = np.ascontiguousarray(points, "<f4").reshape(-1).view(np.uint8)
    return types[TYPES[POINTS]](
        header=header,
        height=1,
        width=len(points),
        fields=[of(name=name, offset=4 * place) for place, name in enumerate("xyz")],
        is_bigendian=False,
        point_step=12,
        row_step=len(data),
        data=data,
        is_dense=True,
    )


def _place_and_turn(matrix: Float, types: Mapping[str, Any], place: str) -> tuple[Any, Any]:
    """Return the place, a Point or Vector3, and the quaternion of a transform (4, 4)."""
    x, y, z = matrix[:3, 3].tolist()
    w, *turn = quaternion_from_matrix(matrix[:3, :3]).tolist()
    quaternion = dict(zip("xyz", turn, strict=True))
    return types[f"geometry_msgs/msg/{place}"](x=x, y=y, z=z), types["geometry_msgs/msg/Quaternion"](w=w, **quaternion)


def _storage(picture: ExportedPicture) -> str:
    return f"{picture.variant}/{picture.variant}.mcap"


def _files(dataset: ExportedDataset, picture: ExportedPicture) -> Iterator[Output]:
    """Yield the bag that the picture is the last of, if it is."""
    if numbers := dataset.ended_by(picture):
        bag = _Bag(dataset=dataset, numbers=numbers, name=picture.variant)
        for path in (_storage(picture), f"{picture.variant}/metadata.yaml"):
            yield MadeFile(path=path, write=partial(bag.write, path.rpartition("/")[2]))


ROSBAG2 = ExportFormat(
    name="rosbag2",
    holds="as a bag of ROS 2 for each variant, in MCAP",
    layout=Layout(
        needs=("image",),
        conventions=CONVENTIONS,
        files=_files,
        file=lambda dataset, picture: _storage(picture),
        limits=(needs_extra("ros"),),
        splits={"train": "train"},
        several=True,
        first_centre=CENTRE,
    ),
)
