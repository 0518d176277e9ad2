"""The visual hull: all that no mask rules out, by space carving with the distances from the masks' outlines.

Source: Laurentini 1994; Kutulakos and Seitz 2000 for carving. The surface is found by marching cubes.
"""

from pathlib import Path

import numpy as np
from scipy.ndimage import distance_transform_edt

from shape.exported import Exported, Floats, camera_of, centres_of, pose_of, write_surface

CELLS = 200  # of the grid along an edge
OUTSIDE = 3.0  # cells outside a silhouette, beyond which a place is not looked at again


def reconstruct(export: Exported, out: Path) -> Path:
    """Write the hull as a mesh in the folder `out`."""
    low, high = _bounds(export, np.full((2, 3), [[-np.inf], [np.inf]]), 40)
    low, high = _bounds(export, np.stack([low, high]), 40)
    values, step = _carved(export, low, high, CELLS)
    return write_surface(out / "hull.ply", values, low, step)


def _bounds(export: Exported, known: Floats, cells: int) -> tuple[Floats, Floats]:
    """The corners of a box around the hull, from one around it, or from the cameras' distances alone."""
    low, high = known
    if not np.isfinite(known).all():
        reach = max(float(np.linalg.norm(pose_of(view)[:3, 3])) for view in export.views)
        low, high = np.full(3, -reach / 2), np.full(3, reach / 2)
    values, step = _carved(export, low, high, cells)
    inside = np.argwhere(values > -step)
    if not len(inside):
        raise SystemExit("no place is within all masks: check the poses")
    return low + (inside.min(0) - 1) * step, low + (inside.max(0) + 2) * step


def _carved(export: Exported, low: Floats, high: Floats, cells: int) -> tuple[Floats, float]:
    """(X, Y, Z) the least distance of each cell's centre within all silhouettes, metres, below 0 outside; and the edge
    of a cell."""
    step = float((high - low).max()) / cells
    shape = np.maximum(np.ceil((high - low) / step).astype(int), 2)
    centres = centres_of(low, step, shape)
    values, left = np.full(len(centres), np.inf), np.arange(len(centres))
    for view in export.views:
        mask, camera, pose = export.mask(view), camera_of(view), pose_of(view)
        depth = distance_transform_edt(mask) - distance_transform_edt(~mask)  # pixels, below 0 outside
        places = centres[left] @ pose[:3, :3].T + pose[:3, 3]
        pixels = camera.project(places)
        seen = (pixels >= 0).all(-1) & (pixels < (camera.width, camera.height)).all(-1)
        if not (mask[[0, -1]].any() or mask[:, [0, -1]].any()):  # else it may go on beyond the frame
            values[left[~seen]] = -OUTSIDE * step
        column, row = np.nan_to_num(pixels[seen]).astype(int).T
        found = (depth[row, column] - np.sign(depth[row, column]) / 2) * places[seen, 2] / camera.fx
        values[left[seen]] = np.minimum(values[left[seen]], found)
        left = left[values[left] > -OUTSIDE * step]
    return np.minimum(values, OUTSIDE * step).reshape(shape), step
