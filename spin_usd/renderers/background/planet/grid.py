"""Pixels seen at a few of them: nodes, between which all that varies slowly is interpolated."""

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from spin_usd.arrays import Float, frozen
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.region import Region

SPACING = 8  # pixels from node to node
BLOCK = (128, 512)  # rows and columns worked on at once: fewer waste time on calls, more do not fit a core's cache
STRIP = (32, 512)  # the same beside the limb


def blocks(region: Region, size: tuple[int, int]) -> Iterator[Region]:
    """Yield the blocks that `region` meets, of a pattern of this `size` (rows, columns) that lies the same in every
    frame; their edges are nodes."""
    rows, columns = size
    for y0 in range(region.y0 // rows * rows, region.y1, rows):
        for x0 in range(region.x0 // columns * columns, region.x1, columns):
            yield on_nodes(Region(x0=x0, y0=y0, x1=x0 + columns, y1=y0 + rows) & region)


def on_nodes(region: Region) -> Region:
    """Return the smallest box around `region` whose edges are nodes; it may reach beyond the frame."""
    x1, y1 = (-(-edge // SPACING) * SPACING for edge in (region.x1, region.y1))
    return Region(x0=region.x0 // SPACING * SPACING, y0=region.y0 // SPACING * SPACING, x1=x1, y1=y1)


def nodes_of(block: Region, whole: Region) -> tuple[slice, slice]:
    """Return where the nodes of a block, those of its far edges included, are among all of `whole`; the edges of both
    are nodes."""
    rows, columns = cells_of(block, whole)
    return slice(rows.start, rows.stop + 1), slice(columns.start, columns.stop + 1)


def cells_of(block: Region, whole: Region) -> tuple[slice, slice]:
    """Return where the squares between the nodes of a block are among all of `whole`."""
    top, left = (block.y0 - whole.y0) // SPACING, (block.x0 - whole.x0) // SPACING
    return slice(top, top + block.height // SPACING), slice(left, left + block.width // SPACING)


@lru_cache(maxsize=4)
def node_coordinates(camera: Camera) -> Float:
    """Return undistorted normalised coordinates (2, R, C) of the nodes: the centres of each SPACING-th pixel, one more
    than the frame holds in each direction. Beyond the frame, where a lens may have no inverse, they go on along a
    line."""
    columns, rows = (np.arange(0, size, SPACING) + 0.5 for size in (camera.width, camera.height))
    xy = np.moveaxis(camera.normalised(np.stack(np.meshgrid(columns, rows), -1)), -1, 0)
    across, down = (-(-size // SPACING) + 1 for size in (camera.width, camera.height))
    xy = _extended(_extended(xy, 1, down, SPACING / camera.fy), 2, across, SPACING / camera.fx)
    return frozen(xy)


def _extended(xy: Float, axis: int, size: int, single: float) -> Float:
    """Return `xy` with up to `size` rows (axis 1) or columns (axis 2); `single`: the step where there is but one."""
    last = np.take(xy, [-1], axis)
    step = last - np.take(xy, [-2], axis) if xy.shape[axis] > 1 else _unit(2 - axis) * single
    beyond = [last + step * (i + 1) for i in range(size - xy.shape[axis])]
    return np.concatenate([xy, *beyond], axis)


def _unit(component: int) -> Float:
    direction: Float = np.eye(2)[component].reshape(2, 1, 1)
    return direction
