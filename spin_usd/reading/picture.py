"""One picture of a dataset, as those who train and test with it read it."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from msgspec import UNSET
from msgspec.json import decode
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float, frozen
from spin_usd.errors import GeometryError, InputError
from spin_usd.files.folder import FileIn, Folder
from spin_usd.files.size_limits import MAX_RECORD
from spin_usd.geometry.camera import Camera
from spin_usd.labels.table import CLOUD_LABELS, LABELS
from spin_usd.reading.description import DescribedPart, Description, Named, Targets
from spin_usd.reading.picture_file import read_picture_file
from spin_usd.reading.pictured_target import PicturedTarget
from spin_usd.reading.window import Window, margin_of, size_of
from spin_usd.records.record import Record, RecordedFile
from spin_usd.scene.keypoints import Keypoints
from spin_usd.scene.scene import augmentation_and_camera, variant_of
from spin_usd.store.names import record_of
from spin_usd.store.read_documents import CHECK, decoded_record

INSTANCE = "instance"


@dataclass(frozen=True, kw_only=True, eq=False)
class PointCloud:
    """N points in the order of their beams. The LiDAR's axes are x forward, y left, z up; metres.

    Arrays of the file are the caller's own, to be changed at will.

    Attributes:
        table: (N,) the file's columns side by side, which the properties below give one by one.
        T_cam_lidar: (4, 4) float64, from the LiDAR's axes to the camera's: p_cam = T_cam_lidar @ (x, y, z, 1).
    """

    table: NDArray[np.void]
    T_cam_lidar: Float

    def __len__(self) -> int:
        return len(self.table)

    @property
    def points(self) -> NDArray[np.float32]:
        """(N, 3) float32: the points as measured, noise included, in the LiDAR's axes."""
        return self.table["points"]

    @property
    def points_cam(self) -> Float:
        """(N, 3) float64: the same in the camera's axes."""
        return np.asarray(self.points @ self.T_cam_lidar[:3, :3].T + self.T_cam_lidar[:3, 3])

    @property
    def ranges(self) -> NDArray[np.float32]:
        """(N,) float32: the measured ranges, noise included."""
        return self.table["ranges"]

    @property
    def exact_ranges(self) -> NDArray[np.float32]:
        """(N,) float32: the ranges without noise."""
        return self.table["exact_ranges"]

    @property
    def beams(self) -> NDArray[np.uint32]:
        """(N,) uint32: each point's beam, from 0: row i / columns and column i % columns of the pattern."""
        return self.table["beams"]

    @property
    def parts(self) -> NDArray[np.uint16]:
        """(N,) uint16: the ids of the parts that the points lie on, the keys of `Picture.parts`."""
        return self.table["parts"]

    @property
    def targets(self) -> NDArray[np.uint16]:
        """(N,) uint16: the ids of the targets that the points lie on; 0 for no target."""
        return self.table["targets"]


@dataclass(frozen=True, kw_only=True)
class PictureFile:
    """A file of a picture."""

    path: str
    """Where it lies, relative to the dataset."""
    dtype: str | Mapping[str, str]
    """The type of its numbers, as numpy names it; of a table each column's, by its name."""
    channels: int
    """How many it has, or columns."""

    @classmethod
    def of(cls, file: RecordedFile) -> Self:
        """Make it of a record's entry."""
        return cls(path=file.path, dtype=file.dtype, channels=len(file.channels))


@dataclass(frozen=True, kw_only=True, eq=False)
class Picture:
    """One frame of one variant: its image, its labels and its record.

    The image and the labels are read on first access, and kept as long as the picture; `label` reads its file at each
    call. Arrays of files belong to the caller, who may change them. Arrays of geometry (pose, camera and keypoints) are
    read-only. Pickling leaves out the arrays that were read: the other process reads its own.

    Two pictures are equal if they have the same dataset's folder, variant and frame, and are the same part of it.

    Every pixel coordinate has (0, 0) at the corner of the image, so the first pixel's centre is (0.5, 0.5) and the
    pixel in row r and column c has its centre at (c + 0.5, r + 0.5). OpenCV's functions that look up pixels, such as
    `remap` and `undistort`, put (0, 0) at the first pixel's centre: subtract 0.5 from cx and cy for those.

    Metres, radians and pixels throughout. The camera's axes are OpenCV's: x right, y down, z forward. The body's axes
    are the axes of the target's model. `targets` has the pose of each of several targets; the picture's own pose and
    keypoints are the first target's, whose id is 1.

    Attributes:
        root: the dataset's folder.
        frame: the picture's name, such as "img000001"; the same in all variants.
        variant: the name of its variant, such as "nominal".
        index: the picture's place in the stage, from 0.
        files: its files by kind: "image", "depth" and so on.
        recorded: its record in the dataset, as types of spin_usd.records; of the whole picture, also
            if this is a part.
        record_text: the bytes of that record.
        camera: size in pixels and lens; `camera.project` gives pixels of points in the camera's axes.
        T_cam_body: (4, 4) float64, from the body's axes to the camera's: p_cam = T_cam_body @ (x, y, z, 1).
        description: common to all pictures of the dataset: the targets, with their keypoints, and the parts.
        window: the part that `crop` or `resize` took, None for the whole picture as rendered.
        labels: the only files to read, as chosen for its Dataset; None for all.
    """

    root: Path
    frame: str
    variant: str
    index: int
    files: Mapping[str, PictureFile]
    recorded: Record
    record_text: bytes
    camera: Camera
    T_cam_body: Float
    description: Description
    window: Window | None = None
    labels: tuple[str, ...] | None = None

    def __repr__(self) -> str:
        return f"Picture({self.frame!r} of {self.variant!r}, in {str(self.root)!r})"

    def __eq__(self, other: object) -> bool:
        return self._identity == other._identity if isinstance(other, Picture) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._identity)

    def __getstate__(self) -> dict[str, Any]:
        names = {field.name for field in fields(self)}
        return {name: value for name, value in self.__dict__.items() if name in names}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.T_cam_body.flags.writeable = False  # numpy forgets it on the way

    @property
    def _identity(self) -> tuple[Path, str, str, Window | None]:
        return self.root, self.variant, self.frame, self.window

    @property
    def camera_matrix(self) -> Float:
        """The camera's matrix K (3, 3) float64, pixels; (0, 0) is the corner of the image."""
        return frozen(self.camera.matrix)

    @property
    def distortion(self) -> Float:
        """The lens's k1, k2, p1, p2, k3 (5,) float64, as OpenCV orders them; k1, k2, k3, k4 (4,) of a fisheye, as its
        module fisheye has them."""
        return frozen(self.camera.distortion)

    @cached_property
    def record(self) -> Mapping[str, Any]:
        """Its whole record in the dataset, by schemas/record-1.schema.json; of the whole picture, also if this is a
        part."""
        said: dict[str, Any] = decode(self.record_text)
        return said

    @property
    def time_s(self) -> float | None:
        """Time of exposure, seconds since the start; None if unknown."""
        return None if self.recorded.time_s is UNSET else self.recorded.time_s

    @property
    def utc(self) -> str | None:
        """The same as UTC, such as "2026-11-26T12:00:00.5Z"; None if the start is unknown."""
        return None if self.recorded.utc is UNSET else self.recorded.utc

    @property
    def q_cam_body(self) -> Float:
        """The rotation of `T_cam_body` as a unit quaternion (4,) float64, scalar first, Hamilton."""
        return frozen(self.recorded.pose.q_cam_body)

    @property
    def t_cam_body(self) -> Float:
        """The origin of the body's axes in the camera's axes (3,) float64, metres."""
        return frozen(self.recorded.pose.t_cam_body)

    @property
    def parts(self) -> Mapping[int, DescribedPart]:
        """The bodies' parts by their ids, which are the numbers in `segmentation`."""
        return self.description.parts

    @cached_property
    def targets(self) -> Targets[PicturedTarget]:
        """The targets with their poses, in order of their ids; targets["tango"] is the one of that name. Raises
        InputError where the record has none, or others than dataset.json."""
        path = self.root / record_of(self.variant, self.frame)
        with _reading_record(path):
            found = Targets(map(PicturedTarget.of, self.recorded.targets))
        ids = [each.id for each in found]  # hidden ones are in no record
        if _named(found) != _named(each for each in self.description.targets if each.id in ids):
            said = f"has the targets {_named(found)}, and dataset.json {_named(self.description.targets)}"
            raise InputError(said, where=path, do=CHECK)
        return Targets(target.seen_in(self.window) for target in found) if self.window else found

    def crop(self, target: int | str | None = None, size: int | tuple[int, int] = 256, *, margin: float = 0.1) -> Self:
        """Return the square, or the rectangle, around the target of that id or name, the first if not given, in `size`
        pixels: one side, or (width, height).

        Its sides are longer than the box of the target's visible pixels by the share `margin`, half of it on each side,
        and 0 beyond the picture's edges. Everything in pixels refers to the crop: camera, keypoints, boxes, flow.
        Images are averaged, as by "bilinear with antialiasing"; labels are taken from the picture's pixel in which a
        pixel's centre lies. Raises InputError if the target is not visible.
        """
        margin = margin_of(margin)
        box = (self.targets[0] if target is None else self.target_of(target)).box_visible
        if np.isnan(box).any():
            where, do = f"{self.root}: {self.frame} of {self.variant}", 'leave it out: dataset.where("visible > 0")'
            raise InputError("shows nothing of the target to crop to", where=where, do=do)
        return self._part(Window.around(box, size_of(size), margin=margin))

    def resize(self, size: int | tuple[int, int]) -> Self:
        """Return the whole picture in `size` pixels, (width, height) or the side of a square, as `crop` does."""
        return self._part(Window.whole(self.camera, size_of(size)))

    def only(self, labels: Sequence[str] | None) -> Self:
        """Return the same picture with no other files than these labels', or with all that it has, None."""
        if labels is None:
            return self
        files = {kind: file for kind, file in self.files.items() if kind in labels}
        return replace(self, files=files, labels=tuple(labels))

    def _part(self, window: Window) -> Self:
        window = window.of(self.window)
        return replace(self, window=window, camera=window.camera(self._whole_camera))

    @property
    def _whole_camera(self) -> Camera:
        return self.recorded.camera.camera

    def target_of(self, target: int | str) -> PicturedTarget:
        """Return the target of that id or name. Raises InputError if there is none, or it is hidden in this
        picture."""
        found = self.description.target(target)
        shown = next((each for each in self.targets if each.id == found.id), None)
        if shown is None:
            where = f"{self.root}: {self.frame} of {self.variant}"
            raise InputError(
                f"does not show {found.name!r}: it is hidden there", where=where, do="take another picture"
            )
        return shown

    def mask(self, target: int | str) -> NDArray[np.bool_]:
        """Return (H, W) bool: the pixels that show the target of that id or name. Raises InputError if there is
        none."""
        target_id = self.description.target(target).id
        if INSTANCE in self.files:
            return np.asarray(self.label(INSTANCE) == target_id)
        own = np.zeros(np.iinfo(np.uint16).max + 1, bool)
        own[[part.id for part in self.parts.values() if part.target == target_id]] = True
        shown = np.flatnonzero(self.segmentation.any(1))
        mask = np.zeros(self.segmentation.shape, bool)
        if len(shown):  # to look up a number for each pixel costs more than all else
            rows = slice(shown[0], shown[-1] + 1)
            mask[rows] = own[self.segmentation[rows]]
        return mask

    @property
    def keypoints(self) -> Keypoints:
        """The first shown target's named points: names, and points (N, 3) float64 in the body's axes, metres."""
        return self.description.target(self.recorded.targets[0].id).keypoints

    @cached_property
    def keypoint_pixels(self) -> Float:
        """The keypoints in the picture, (N, 2) float64 pixels x and y, hidden ones too; NaN where the lens sees
        none, and for missing ones."""
        shaped = self.targets[0].shaped_keypoints
        drawn = self.keypoints.points
        points = (drawn if shaped is None else shaped) @ self.T_cam_body[:3, :3].T + self.T_cam_body[:3, 3]
        return frozen(self.camera.project(points))

    def heatmaps(self, size: tuple[int, int] = (192, 128), *, sigma: float = 2.0) -> NDArray[np.float32]:
        """Return (K, height, width) float32: for each keypoint a Gaussian of height 1 around its place, in maps of the
        whole frame of `size` (width, height).

        `sigma` is in pixels of the map. Hidden keypoints have one too; a map is 0 all over where the keypoint is
        outside the frame. Raises InputError for a size or a sigma that is not positive.
        """
        frame = (self.camera.width, self.camera.height)
        return heatmaps_of(self.keypoint_pixels, frame, size=size, sigma=sigma)

    def seen_by(self, camera: str) -> "Picture":
        """Return the whole picture, also of a crop, that the camera of that name took of the same frame, as
        `record["rig"]` names them, in the same augmentation. Raises InputError where the dataset has none."""
        augmentation, _ = augmentation_and_camera(self.variant)
        for variant in (variant_of(augmentation, camera), augmentation):
            with suppress(InputError):
                found = read_picture(self.root, record_of(variant, self.frame), self.description)
                if found.recorded.rig is not UNSET and found.recorded.rig.camera == camera:
                    return found.only(self.labels)
        raise InputError(f"{self.frame} has no picture by the camera {camera!r}", where=self.root, do="render it too")

    def relative_pose(self, other: "Picture") -> Float:
        """Return (4, 4) float64, from this picture's camera axes to those of the `other`, following the target: it
        takes a point of the target, (x, y, z, 1) in the camera's axes, to its position there. `dataset[i + 1]` is the
        next frame."""
        return frozen(other.T_cam_body @ np.linalg.inv(self.T_cam_body))

    @cached_property
    def image(self) -> NDArray[Any]:
        """The image that the sensor saw, (H, W) uint8, or (H, W, 3) of R, G and B; its curve is `encoding` in the
        record."""
        return self._array("image")

    @cached_property
    def depth(self) -> NDArray[np.float32]:
        """Depth (H, W) float32: planar z in the camera's axes, metres; 0 where nothing is."""
        return self._array("depth")

    @cached_property
    def segmentation(self) -> NDArray[np.uint16]:
        """Part ids (H, W) uint16, the keys of `parts`; 0 where nothing is."""
        return self._array("segmentation")

    @cached_property
    def dense_pose(self) -> NDArray[np.float32]:
        """The surface point seen in each pixel (H, W, 3) float32: x, y, z in the body's axes, metres; 0 where nothing
        is."""
        return self._array("dense_pose")

    @cached_property
    def lidar(self) -> PointCloud:
        """The points that the LiDAR measured, N of them, in its own axes: see PointCloud."""
        lidar = self.recorded.lidar
        pose = np.eye(4) if lidar is UNSET else lidar.lidar.T_cam_lidar.matrix
        return PointCloud(table=self._array("lidar"), T_cam_lidar=frozen(pose))

    def label(self, name: str, *, rows: range | None = None) -> NDArray[Any]:
        """Return the label of that name, such as "depth": (H, W), or (H, W, C), in the recorded number type; a LiDAR's
        points are a table (N,). For an image `rows` decodes only these.

        The file is read at each call. `record["files"]` describes the numbers. Raises InputError if the picture has no
        such label.
        """
        return self._array(name, rows)

    def _array(self, kind: str, rows: range | None = None) -> NDArray[Any]:
        """Return the numbers in the picture's file of that kind, of an image all `rows` or these. Raises InputError
        where it has none, or a damaged one."""
        if self.window is None or kind in CLOUD_LABELS:
            return self._read(kind, rows)
        needed = self.window.rows(self._whole_camera.height)
        array = self.window.cut(self._read(kind, needed), needed.start, smooth=kind not in LABELS)
        if kind in LABELS and LABELS[kind].channels.unit == "px":
            array[..., :2] *= self.window.scale
        return array if rows is None else array[rows.start : rows.stop : rows.step]

    def _read(self, kind: str, rows: range | None) -> NDArray[Any]:
        """Read them unchanged from the file."""
        if kind not in self.files:
            do = f"render {kind} too" if self.labels is None else f"open the dataset with {kind} among its labels"
            do = f"choose among {', '.join(self.files)}, or {do}" if self.files else do
            raise InputError(f"has no {kind}", where=f"{self.root}: {self.frame} of {self.variant}", do=do)
        file = FileIn(Folder(self.root), self.files[kind].path)
        array = read_picture_file(file, kind, self.files[kind].dtype, self.files[kind].channels, rows)
        camera = self._whole_camera
        height = camera.height if rows is None else len(rows)
        if kind not in CLOUD_LABELS and array.shape[:2] != (height, camera.width):
            raise InputError(f"is {array.shape[:2]}, and its camera is not", where=file.path, do=CHECK)
        return array


def read_picture(root: Path, name: str, description: Description) -> Picture:
    """Read the picture whose record is the file `name` in the dataset `root`. Raises InputError for a broken record."""
    text = Folder(root).read(name, MAX_RECORD)
    record = decoded_record(text, root / name)
    with _reading_record(root / name):
        return Picture(
            root=root,
            frame=record.frame,
            variant=record.variant,
            index=record.index,
            files={kind: PictureFile.of(file) for kind, file in record.files.items()},
            recorded=record,
            record_text=text,
            camera=record.camera.camera,
            T_cam_body=frozen(record.pose.T_cam_body.matrix),
            description=description,
        )


@contextmanager
def _reading_record(path: Path) -> Iterator[None]:
    """Raise InputError on the record at `path` where the block meets numbers that no camera and no pose has."""
    try:
        yield
    except GeometryError as e:
        raise InputError(f"is not a record of a picture ({e})", where=path, do=CHECK) from e


def _named(targets: Iterable[Named]) -> str:
    return ", ".join(f"{target.id} {target.name!r}" for target in targets) or "none"


def heatmaps_of(pixels: Float, frame: tuple[int, int], *, size: tuple[int, int], sigma: float) -> NDArray[np.float32]:
    """Return (K, height, width) float32: around each of the `pixels` (K, 2) of a `frame` (width, height) a Gaussian of
    height 1, in maps of `size` (width, height).

    `sigma`: in pixels of the map. A map is of the whole frame, and has its pixels' centres at (c + 0.5, r + 0.5). It is
    0 all over where the place is outside the frame, or NaN. Raises InputError for a size or a sigma that is not
    positive.
    """
    if min(size) < 1 or not 0 < sigma < np.inf:
        raise InputError(f"heatmaps cannot be of size {size} and sigma {sigma}", do="make both positive")
    places = pixels * np.divide(size, frame)
    inside = ((places >= 0) & (places < size)).all(-1)
    x, y = (_falloff(places[:, axis], size[axis], sigma) for axis in (0, 1))
    return np.asarray(np.where(inside[:, None, None], y[:, :, None] * x[:, None, :], 0), np.float32)


def _falloff(places: Float, length: int, sigma: float) -> Float:
    """Return (K, length) of the Gaussian along one axis."""
    away = np.arange(length) + 0.5 - np.nan_to_num(places)[:, None]
    fallen: Float = np.exp(-(away**2) / (2 * sigma**2))
    return fallen
