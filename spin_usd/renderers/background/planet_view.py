"""A planet as a camera sees it: interpolated between nodes where it is smooth, pixel by pixel along the limb."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float, frozen
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.region import Region
from spin_usd.renderers.background.elementary import Float32
from spin_usd.renderers.background.enlarge import Cells, in_cells
from spin_usd.renderers.background.globe import AIR_HEIGHTS, Globe, Meeting, Rays
from spin_usd.renderers.background.node_grid import NodeGrid
from spin_usd.renderers.background.planet_points import Points
from spin_usd.renderers.background.planet_radiance import fine_radiance
from spin_usd.scene.light import DistantLight

Hidden = NDArray[np.bool_] | None
"""The pixels (H, W) without visible background; None if unknown."""

WIDE = 0.05  # radians between nodes, above which they are too far apart
LIMB = 32.0  # pixels from the limb, from which on a point between nodes is off by an eighth of a pixel at most
Mask = NDArray[np.bool_]

SPACING = 8  # pixels from node to node
BLOCK = (128, 512)  # rows and columns worked on at once: fewer waste time on calls, more do not fit a core's cache
STRIP = (32, 512)  # the same beside the limb


class PlanetView:
    """`globe` in the light of `suns`, as far as it lies in the `region` of the camera's frame."""

    def __init__(self, camera: Camera, globe: Globe, suns: tuple[DistantLight, ...], region: Region) -> None:
        self._camera, self._globe, self._suns, self._region = camera, globe, suns, region
        self._whole = on_nodes(region)
        self._xy = node_coordinates(camera)[:, *nodes_of(self._whole, camera.frame)]
        self._points = Points.of(globe, suns, Rays.through(camera, self._xy)).with_weather()
        self._kinds = CellKinds.of(globe, self._points.meeting)

    def add_to(self, frame: Float32, hidden: Hidden) -> bool:
        """Put the planet in front of the radiances (H, W, 3) of the frame, except in blocks that are all `hidden`.
        Return whether any of it is visible."""
        seen = False
        for block in blocks(self._region, BLOCK):
            if hidden is None or not hidden[(block & self._camera.frame).slices].all():
                smooth = self._add_smooth(frame, block)
                rough = self._add_rough(frame, block, self._kinds.rough, ground=True)
                air = self._add_rough(frame, block, self._kinds.air, ground=False)
                seen = seen or smooth or rough or air
        return seen

    def nodes(self, block: Region) -> NodeGrid:
        """Return the nodes of the block."""
        return NodeGrid(points=self._points.part(nodes_of(block, self._whole)), spacing=SPACING)

    def _add_smooth(self, frame: Float32, block: Region) -> bool:
        """Put the smooth cells of the block into the frame; return whether there are any."""
        smooth = self._smooth(block)
        if smooth.all():
            self._add_nodes(frame, block)
        elif smooth.any():
            for strip in blocks(block, STRIP):
                columns = np.flatnonzero(self._smooth(strip).any(0)) * SPACING + strip.x0
                if len(columns):
                    self._add_nodes(frame, replace(strip, x0=int(columns[0]), x1=int(columns[-1]) + SPACING))
        return bool(smooth.any())

    def _add_nodes(self, frame: Float32, block: Region) -> None:
        own, smooth = block & self._camera.frame, self._smooth(block)
        rows, columns = own.shape
        there = smooth.all() or smooth.repeat(SPACING, 0).repeat(SPACING, 1)[:rows, :columns]
        for channel, light in enumerate(fine_radiance(self.nodes(block))):
            # The planet fills these pixels and hides their contents.
            np.copyto(frame[own.slices][..., channel], light[:rows, :columns], where=there)

    def _smooth(self, block: Region) -> Mask:
        return self._kinds.smooth[cells_of(block, self._whole)]

    def _add_rough(self, frame: Float32, block: Region, kind: Mask, *, ground: bool) -> bool:
        """Put cells of the block into the frame, pixel by pixel; `ground`: whether they may show more than air. Return
        whether there are any."""
        cells = cells_in(kind, cells_of(block, self._whole))
        if not len(cells[0]):
            return False
        points = self._points_in(cells, ground=ground)
        light, passed = fine_radiance(NodeGrid(points=points, spacing=1)), points.transmittance
        at, own = pixels_of(cells, self._whole, self._camera.frame)
        pixels = frame.reshape(-1, 3)
        for channel in range(3):
            pixels[at, channel] = pixels[at, channel] * passed[channel][own] + light[channel][own]
        return True

    def _points_in(self, cells: Cells, *, ground: bool) -> Points:
        xy = np.stack(in_cells(list(self._xy), cells, SPACING))
        if self._camera.fisheye:  # whose rays between nodes do not follow straight lines
            starts, counts = (self._whole.x0, self._whole.y0), self._xy.shape[:0:-1]
            nodes = (start + SPACING * np.arange(n) + 0.5 for start, n in zip(starts, counts, strict=True))
            xy = self._camera.normalised(np.stack(in_cells(np.meshgrid(*nodes), cells, SPACING), -1)).T
        points = Points.of(self._globe, self._suns, Rays.through(self._camera, xy))
        if not ground:
            return points
        # Slow noise comes from the nodes, also along the limb.
        return points.with_weather(self._points.weather and self._points.weather.in_cells(cells, SPACING))


@dataclass(frozen=True, kw_only=True, eq=False)
class CellKinds:
    """Which cells (R - 1, C - 1) between the nodes (R, C) show a planet."""

    smooth: Mask
    """Cells full of the planet that can be interpolated between their nodes."""
    rough: Mask
    """Others that may show its ground."""
    air: Mask
    """Cells that show only its air."""

    @classmethod
    def of(cls, globe: Globe, meeting: Meeting) -> "CellKinds":
        """Return the kinds of the cells between the points of `meeting`.

        At N pixels from a limb, pixels grow by 1 / (2 N) from one to the next.
        """
        narrow = _of_corners(np.maximum, meeting.footprint) * SPACING <= WIDE
        smooth = narrow & (_of_corners(np.minimum, meeting.inside) >= SPACING + LIMB)
        near = _of_corners(np.maximum, meeting.inside) > -2 * SPACING
        air_height = AIR_HEIGHTS * globe.scale_height if globe.air else 0.0
        air = _of_corners(np.minimum, meeting.height) < air_height
        return cls(smooth=smooth, rough=near & ~smooth, air=air & ~near)


def _of_corners(choose: Callable[[Float32, Float32], Float32], plane: Float32) -> Float32:
    rows = choose(plane[:-1], plane[1:])
    return choose(rows[:, :-1], rows[:, 1:])


def cells_in(kind: Mask, slices: tuple[slice, slice]) -> Cells:
    """Return the cells of a kind that lie in `slices` of all."""
    rows, columns = np.nonzero(kind[slices])
    return rows + slices[0].start, columns + slices[1].start


def pixels_of(cells: Cells, whole: Region, frame: Region) -> tuple[NDArray[np.intp], Mask]:
    """Return the places of the cells' pixels among all of the `frame`, those beyond it left out, and which of them,
    (N * SPACING * SPACING,), are not; the first cell of all has the first pixel of `whole`."""
    rows, columns = (cell[:, None, None] * SPACING for cell in cells)
    steps = np.arange(SPACING)
    y, x = np.broadcast_arrays(whole.y0 + rows + steps[:, None], whole.x0 + columns + steps)
    inside = (y < frame.height) & (x < frame.width)
    return (y * frame.width + x)[inside], inside.ravel()


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
