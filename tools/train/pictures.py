"""Pictures that a network learns from or is tried on: grey image, camera, pose; and the part of them that it sees."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

import spin_usd
from spin_usd.basics.arrays import Float
from spin_usd.exchange.cameras.speed_camera import read_camera_file
from spin_usd.exchange.read_pose_list import read_pose_list
from spin_usd.formats.chosen_frames import slice_of
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.fisheye import Fisheye
from spin_usd.geometry.rotation import matrices_from_quaternions

MARGIN = 1.3  # of the keypoints' box: the target's own outline goes beyond them
LUMA = (0.299, 0.587, 0.114)  # of R, G and B, as ITU-R BT.601 has them
CAMERA = Path(__file__).parent / "camera.json"  # of SPEED+, for pictures without a camera file
PACK = ".npz"  # ends the name of what `tools/train/pack` writes


@dataclass(frozen=True, kw_only=True, eq=False)
class PosedPicture:
    """name: as `spin-usd score` knows the picture · T_cam_body (4, 4) · image: reads it, (H, W) uint8."""

    name: str
    camera: Camera
    T_cam_body: Float
    image: Callable[[], NDArray[np.uint8]]


@dataclass(frozen=True, kw_only=True, eq=False)
class PictureSet:
    """pictures, in order · points (K, 3): the target's keypoints in its own axes, metres."""

    pictures: Sequence[PosedPicture]
    points: Float


@dataclass(frozen=True, kw_only=True)
class Crop:
    """The square of a picture whose upper left corner is the pixel (x, y), `side` pixels wide; it may go beyond."""

    x: int
    y: int
    side: int

    def moved(self, across: float, down: float, factor: float) -> "Crop":
        """Return one `factor` times as wide, its middle moved by these shares of the side."""
        side = max(8, round(self.side * factor))
        middle = (self.x + self.side * (0.5 + across), self.y + self.side * (0.5 + down))
        return Crop(x=round(middle[0] - side / 2), y=round(middle[1] - side / 2), side=side)

    def of_image(self, image: NDArray[np.uint8], size: int, way: int | None = None) -> NDArray[np.uint8]:
        """Return (size, size) of the square; black where there is no picture. way: OpenCV's interpolation, by default
        the mean of areas or linear."""
        seen = np.zeros((self.side, self.side), np.uint8)
        rows, columns = (
            range(max(0, at), min(n, at + self.side)) for at, n in zip((self.y, self.x), image.shape, strict=True)
        )
        if len(rows) and len(columns):
            part = image[rows.start : rows.stop, columns.start : columns.stop]
            seen[rows.start - self.y :, columns.start - self.x :][: len(rows), : len(columns)] = part
        if way is None:
            way = cv2.INTER_AREA if self.side > size else cv2.INTER_LINEAR
        return np.asarray(cv2.resize(seen, (size, size), interpolation=way), np.uint8)

    def to_crop(self, pixels: Float, size: int) -> Float:
        """Return pixels (K, 2) of the picture as pixels of the crop, `size` wide; (0, 0) is each one's corner."""
        return np.asarray((pixels - (self.x, self.y)) * size / self.side)

    def from_crop(self, pixels: Float, size: int) -> Float:
        """Return pixels (K, 2) of the crop as pixels of the picture."""
        return np.asarray(pixels * self.side / size + (self.x, self.y))


def keypoint_pixels(picture: PosedPicture, points: Float) -> Float:
    """Return where the points are in the picture, (K, 2); NaN where the lens sees none."""
    return picture.camera.project(points @ picture.T_cam_body[:3, :3].T + picture.T_cam_body[:3, 3])


def crop_of(pixels: Float) -> Crop:
    """Return the square around the keypoints' box, as a detector of the target would give it."""
    low, high = np.nanmin(pixels, axis=0), np.nanmax(pixels, axis=0)
    side = max(8, round(float((high - low).max()) * MARGIN))
    x, y = np.rint((low + high - side) / 2).astype(int).tolist()
    return Crop(x=x, y=y, side=side)


def datasets_in(folder: Path) -> list[Path]:
    """Return the dataset of that folder, or all datasets FOLDER/NAME/dataset. Ends the program where there is none."""
    if (folder / "dataset.json").is_file():
        return [folder]
    if not (found := sorted(folder.glob("*/dataset"))):
        raise SystemExit(f"{folder} is no dataset, and has none in NAME/dataset")
    return found


def read_set(
    path: Path, *, frames: str | None = None, appearances: int | None = None, keypoints: Path | None = None
) -> PictureSet:
    """Read a dataset of spin_usd, a pack, or a list of poses as SPEED+ has it. A list's pictures are in the folder
    `images` beside it, else in its own folder; camera.json is beside it or in the folder above, else the camera is
    SPEED+'s; `keypoints` are a JSON list of points.

    frames: some of the frames, A:B:STEP · appearances: of a dataset's variants as many for each frame, of frame i those
    from i on, in turn, so that each number of appearances shows as much of every variant.
    """
    if path.is_dir():
        return _of_dataset(spin_usd.Dataset(path), frames, appearances)
    if path.suffix == PACK:
        return _of_pack(path, frames)
    return _of_speedplus(path, frames, keypoints)


def read_sets(paths: Sequence[Path], **options: Any) -> PictureSet:
    """Read sets of one target as one set. options: of `read_set`, for each of them."""
    sets = [read_set(path, **options) for path in paths]
    if any(not np.array_equal(each.points, sets[0].points) for each in sets):
        raise SystemExit(f"{', '.join(map(str, paths))} have different keypoints; give sets of one target")
    return PictureSet(pictures=[picture for each in sets for picture in each.pictures], points=sets[0].points)


def _of_dataset(dataset: spin_usd.Dataset, frames: str | None, appearances: int | None) -> PictureSet:
    variants, every = dataset.variants, sorted({frame for frame, _ in dataset.names})
    count = len(variants) if appearances is None else appearances
    if not 1 <= count <= len(variants):
        raise SystemExit(f"{dataset.root} has {len(variants)} variants, not the {count} appearances that are asked for")
    step = len(variants) / count
    names = [
        (every[place], variants[(place + int(turn * step)) % len(variants)])
        for place in _chosen(frames, len(every))
        for turn in range(count)
    ]
    several = len(variants) > 1
    pictures = [
        PosedPicture(
            name=f"{frame}-{variant}" if several else frame,
            camera=(picture := dataset.picture(frame, variant)).camera,
            T_cam_body=picture.T_cam_body,
            image=partial(_dataset_image, dataset, frame, variant),
        )
        for frame, variant in names
    ]
    return PictureSet(pictures=pictures, points=dataset.keypoints.points)


def _chosen(frames: str | None, count: int) -> range:
    return range(count) if frames is None else range(count)[slice_of(frames)]


def _dataset_image(dataset: spin_usd.Dataset, frame: str, variant: str) -> NDArray[np.uint8]:
    return grey(dataset.picture(frame, variant).image)


def _of_speedplus(path: Path, frames: str | None, keypoints: Path | None) -> PictureSet:
    if keypoints is None:
        raise SystemExit(f"{path} has no keypoints of its target: give --keypoints, a JSON list of points in metres")
    places = (path.parent / CAMERA.name, path.parent.parent / CAMERA.name)
    camera = read_camera_file(next(filter(Path.is_file, places), CAMERA)).camera
    folder = images if (images := path.parent / "images").is_dir() else path.parent
    poses = read_pose_list(path)
    rotations = matrices_from_quaternions(poses.q_cam_body)
    pictures = []
    for place in _chosen(frames, len(poses.names)):
        T_cam_body = np.eye(4)
        T_cam_body[:3, :3], T_cam_body[:3, 3] = rotations[place], poses.t_cam_body[place]
        file = folder / poses.files[place]
        pictures.append(
            PosedPicture(
                name=poses.names[place], camera=camera, T_cam_body=T_cam_body, image=partial(_image_file, file)
            )
        )
    points: Any = json.loads(keypoints.read_text())
    return PictureSet(pictures=pictures, points=np.array(points, np.float64))


def _image_file(path: Path) -> NDArray[np.uint8]:
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise SystemExit(f"{path} is no image")
    return np.asarray(image, np.uint8)


def _of_pack(path: Path, frames: str | None) -> PictureSet:
    with np.load(path) as found:
        pack = dict(found)
    pictures = [
        PosedPicture(
            name=str(pack["names"][place]),
            camera=_camera_of(json.loads(str(pack["cameras"][place]))),
            T_cam_body=pack["poses"][place],
            image=partial(_same, pack[f"image{place}"]),
        )
        for place in _chosen(frames, len(pack["names"]))
    ]
    return PictureSet(pictures=pictures, points=pack["points"])


def _camera_of(found: Mapping[str, Any]) -> Camera:
    lens = found["distortion"]
    return Camera(**{**found, "distortion": Fisheye(*lens) if len(lens) == len(Fisheye._fields) else tuple(lens)})


def grey(image: NDArray[Any]) -> NDArray[np.uint8]:
    """Return an image of 8 or 16 bits, grey or coloured, as a grey one (H, W)."""
    if image.dtype == np.uint8 and image.ndim == 2:
        return image
    if image.dtype == np.uint16:
        image = image / 257
    if image.ndim == 3:
        image = image @ np.array(LUMA)
    return np.asarray(np.rint(image), np.uint8)


def kept(pictures: PictureSet) -> PictureSet:
    """Return the same set with its images in memory."""
    return replace(
        pictures,
        pictures=[replace(each, image=partial(_same, each.image())) for each in pictures.pictures],
    )


def _same(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return image
