"""Points on a target's surface, taken from pictures of it, and their visibility in other pictures.

A point is a pixel's position in body axes from the label "dense_pose". It has a normal, from the pixels to the right
and below, to distinguish the two sides of a thin plate.
"""

from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.exchange.layout.export_format import MadeFile
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.images import eight_bits
from spin_usd.exchange.layout.rectified_picture import as_exported
from spin_usd.files.new_file import write_whole

DENSE_POSE = "dense_pose"
MAX_PICTURES = 200  # that points are taken from, so that an export of many pictures does not read them all twice
GRAZING = 0.2  # cosine of the angle to the normal below which a surface is seen at too shallow an angle
NEAR = 2.0  # footprints of a pixel between a point and the pixels around it, which are a diagonal apart at most
FLAT = 0.5  # footprints of a pixel that those may lie off the point's plane
CLOUD = np.dtype([("point", "<f4", 3), ("normal", "<f4", 3), ("colour", "u1", 3)])
HEADER = """ply
format binary_little_endian 1.0
comment metres, in the body's axes
element vertex {points}
property float x
property float y
property float z
property float nx
property float ny
property float nz
property uchar red
property uchar green
property uchar blue
end_header
"""


@dataclass(frozen=True, kw_only=True, eq=False)
class SurfacePoints:
    """Points of a target's surface, N of them."""

    points: Float
    """(N, 3) float64, body axes, metres."""
    normals: Float
    """(N, 3) float64, body axes, outwards."""
    colours: NDArray[np.uint8]
    """(N, 3): R, G and B of the image that each was taken from."""

    def seen_in(self, picture: ExportedPicture) -> tuple[Float, NDArray[np.bool_]]:
        """Return pixels (N, 2) of the points in the picture, NaN outside the lens's view, and (N,) whether each is
        visible: the four pixels around it show the target's surface as near to it as pixels allow."""
        pose, camera = picture.target.T_cam_body, picture.camera
        places = self.points @ pose[:3, :3].T + pose[:3, 3]
        pixels = camera.project(places)
        cosines = _cosines(places, self.normals @ pose[:3, :3].T)
        within = (pixels >= 0.5).all(-1) & (pixels < (camera.width - 0.5, camera.height - 0.5)).all(-1)
        seen = (cosines > GRAZING) & within
        columns, rows = (pixels[seen] - 0.5).astype(np.int64).T
        footprint = _footprint(picture, places[seen])
        reach = NEAR * footprint / cosines[seen]
        surface, mask = picture.label(DENSE_POSE), picture.mask()
        found = np.ones(len(rows), bool)
        for row, column in ((rows, columns), (rows, columns + 1), (rows + 1, columns), (rows + 1, columns + 1)):
            apart = surface[row, column] - self.points[seen]
            found &= mask[row, column] & (np.linalg.norm(apart, axis=-1) <= reach)
            found &= np.abs((apart * self.normals[seen]).sum(-1)) <= FLAT * footprint
        seen[seen] = found
        return pixels, seen


@lru_cache(maxsize=1)
def surface_points(dataset: ExportedDataset, count: int) -> SurfacePoints:
    """Return at most `count` points, equally many from each source picture, evenly over its surface: the same in
    every run."""
    numbers = _some(np.arange(len(dataset)), min(MAX_PICTURES, count))
    found = [
        _points_in(as_exported(dataset, dataset.picture(number)), count // len(numbers)) for number in numbers.tolist()
    ]
    return SurfacePoints(
        points=np.concatenate([each.points for each in found]),
        normals=np.concatenate([each.normals for each in found]),
        colours=np.concatenate([each.colours for each in found]),
    )


def cloud_file(dataset: ExportedDataset, path: str, count: int) -> MadeFile:
    """Return a PLY file of `count` points or fewer at `path`: binary, float32, with normals and colours."""
    return MadeFile(path=path, write=partial(_write_cloud, dataset, count))


def _write_cloud(dataset: ExportedDataset, count: int, path: Path) -> None:
    found = surface_points(dataset, count)
    cloud = np.empty(len(found.points), CLOUD)
    cloud["point"], cloud["normal"], cloud["colour"] = found.points, found.normals, found.colours
    write_whole(path, HEADER.format(points=len(cloud)).encode("ascii") + cloud.tobytes())


def _points_in(picture: ExportedPicture, count: int) -> SurfacePoints:
    """Return `count` points that the picture shows, or all that there are, where the surface goes on to the right and
    below."""
    surface, mask = picture.label(DENSE_POSE).astype(np.float64), picture.mask()
    rows, columns = np.nonzero(mask[:-1, :-1] & mask[:-1, 1:] & mask[1:, :-1])
    points = surface[rows, columns]
    right, down = surface[rows, columns + 1] - points, surface[rows + 1, columns] - points
    pose = picture.target.T_cam_body
    places = points @ pose[:3, :3].T + pose[:3, 3]
    normals = np.cross(down, right)  # towards the camera, whose x is right and y down
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    normals = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
    cosines = _cosines(places, normals @ pose[:3, :3].T)
    longest = np.maximum(np.linalg.norm(right, axis=-1), np.linalg.norm(down, axis=-1))
    flat = np.flatnonzero((cosines > GRAZING) & (longest <= NEAR * _footprint(picture, places) / GRAZING))
    chosen = _some(flat, count)
    image = eight_bits(picture.image)[rows[chosen], columns[chosen]]
    colours = np.repeat(image[:, None], 3, axis=1) if image.ndim == 1 else image
    return SurfacePoints(points=points[chosen], normals=normals[chosen], colours=colours)


def _some(numbers: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Return `count` of the numbers or fewer, at even steps."""
    return numbers[:: max(-(-len(numbers) // count), 1)]


def _cosines(places: Float, normals: Float) -> Float:
    """Return (N,) cosines of the angles between the directions to the camera and the normals (N, 3), at the `places`
    (N, 3), all in the camera's axes."""
    return np.asarray(-(places * normals).sum(-1) / np.linalg.norm(places, axis=-1))


def _footprint(picture: ExportedPicture, places: Float) -> Float:
    """Return (N,) how wide a pixel is at the places (N, 3) in the camera's axes, metres, where it is seen square on."""
    return np.asarray(places[:, 2] / min(picture.camera.fx, picture.camera.fy))
