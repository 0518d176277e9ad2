"""A planet as a camera sees it: between nodes where it is smooth, each pixel of its own along the limb."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spin_usd.geometry.camera import Camera
from spin_usd.geometry.region import Region
from spin_usd.renderers.background.arithmetic.elementary import Float32
from spin_usd.renderers.background.arithmetic.enlarge import Cells, in_cells
from spin_usd.renderers.background.planet.cells import CellKinds, Mask, cells_in, pixels_of
from spin_usd.renderers.background.planet.globe import Globe, Rays
from spin_usd.renderers.background.planet.grid import (
    BLOCK,
    SPACING,
    STRIP,
    blocks,
    cells_of,
    node_coordinates,
    nodes_of,
    on_nodes,
)
from spin_usd.renderers.background.planet.node_grid import NodeGrid
from spin_usd.renderers.background.planet.points import Points
from spin_usd.renderers.background.planet.radiance import fine_radiance
from spin_usd.scene.light import DistantLight

Hidden = NDArray[np.bool_] | None
"""The pixels (H, W) of which nothing behind the target is seen; None where that is not known."""


class PlanetView:
    """`globe` in the light of `suns`, as far as it lies in the `region` of the camera's frame."""

    def __init__(self, camera: Camera, globe: Globe, suns: tuple[DistantLight, ...], region: Region) -> None:
        self._camera, self._globe, self._suns, self._region = camera, globe, suns, region
        self._whole = on_nodes(region)
        self._xy = node_coordinates(camera)[:, *nodes_of(self._whole, camera.frame)]
        self._points = Points.of(globe, suns, Rays.through(camera, self._xy)).with_weather()
        self._kinds = CellKinds.of(globe, self._points.meeting)

    def add_to(self, frame: Float32, hidden: Hidden) -> bool:
        """Put the planet before the radiances (H, W, 3) of the frame, except in blocks that are all `hidden`. Return
        whether any of it is seen."""
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
            # The planet fills these pixels and hides what was there.
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
        points = Points.of(self._globe, self._suns, Rays.through(self._camera, xy))
        if not ground:
            return points
        # Slow noise is that of the nodes, also along the limb.
        return points.with_weather(self._points.weather and self._points.weather.in_cells(cells, SPACING))
