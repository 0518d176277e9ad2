"""Controls: our exact depth, fused as a truncated signed distance, or put back into space as points.

They bound how well the export, the score and the sampling of pixels let a shape be known.
Source: Curless and Levoy 1996, "A volumetric method for building complex models from range images".
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from shape.exported import Exported, Floats, centres_of, write_cloud, write_surface
from spin_usd.reading.dataset import Dataset
from spin_usd.reading.picture import Picture

CELLS = 250  # along the longest edge of the target
REACH = 3.0  # cells before and behind a surface, within which it is averaged
MARGIN = 4  # cells around the target's box


def reconstruct(export: Exported, dataset: Dataset, out: Path) -> Path:
    """Write the fused mesh in the folder `out`."""
    box = dataset.targets[0].box
    step = float((box[1] - box[0]).max()) / CELLS
    low = box[0] - MARGIN * step
    shape = np.ceil((box[1] - box[0]) / step).astype(int) + 2 * MARGIN
    centres = centres_of(low, step, shape)
    sums, weights = np.zeros(len(centres), np.float32), np.zeros(len(centres), np.float32)
    for picture in dataset:
        number, ahead = _distances(picture, centres, REACH * step)
        sums[number] += np.minimum(ahead, REACH * step)
        weights[number] += 1
    values = np.where(weights > 0, sums / np.maximum(weights, 1), -REACH * step).reshape(shape)
    return write_surface(out / "fusion.ply", values, low, step)


def _distances(picture: Picture, centres: Floats, reach: float) -> tuple[NDArray[np.intp], Floats]:
    """The numbers (K,) of the `centres` (N, 3) of which the picture says something, and how far each is before the
    surface along the camera's axis, metres: those before it, and those up to `reach` behind it.

    Inverse depth, which is linear over the pixels of a plane, is interpolated between four pixels of one surface.
    """
    places = centres @ picture.T_cam_body[:3, :3].T + picture.t_cam_body
    pixels = picture.camera.project(places) - 0.5
    camera = picture.camera
    seen = np.flatnonzero((pixels >= 0).all(-1) & (pixels < (camera.width - 1, camera.height - 1)).all(-1))
    column, row = pixels[seen].astype(int).T
    right, down = (pixels[seen] % 1).T
    depth = picture.depth.astype(np.float64)
    inverse = np.divide(1, depth, out=np.zeros_like(depth), where=depth > 0)  # 0 where nothing is: far away
    four = np.stack([inverse[row + y, column + x] for y in (0, 1) for x in (0, 1)])
    shares = np.stack([(1 - right) * (1 - down), right * (1 - down), (1 - right) * down, right * down])
    z = places[seen, 2]
    nearest, farthest = four.max(0), four.min(0)
    with np.errstate(divide="ignore", invalid="ignore"):
        one_surface = 1 / farthest - 1 / nearest < 4 * reach
        ahead = np.where(one_surface, 1 / (four * shares).sum(0), 1 / nearest) - z
    told = np.where(one_surface, ahead > -reach, ahead > reach)
    return seen[told], ahead[told]


def reconstruct_points(export: Exported, dataset: Dataset, out: Path) -> Path:
    """Write the points of all depth images in the folder `out`."""
    found = []
    for picture in dataset:
        row, column = np.nonzero(picture.depth)
        places = picture.camera.rays(np.stack([column, row], -1) + 0.5) * picture.depth[row, column, None]
        found.append((places - picture.t_cam_body) @ picture.T_cam_body[:3, :3])
    path = out / "points.ply"
    write_cloud(path, np.concatenate(found))
    return path
