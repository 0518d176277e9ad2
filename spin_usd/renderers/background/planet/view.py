"""A planet as a camera sees it, block by block: nodes where it is smooth, each pixel of its own along the limb."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from spin_usd.geometry.camera import Camera
from spin_usd.geometry.region import Region
from spin_usd.renderers.background.arithmetic.enlarge import enlarged
from spin_usd.renderers.background.planet.globe import AIR_HEIGHTS, Globe, Rays
from spin_usd.renderers.background.planet.grid import (
    PATCH,
    SPACING,
    blocks,
    node_coordinates,
    on_nodes,
)
from spin_usd.renderers.background.planet.points import Points
from spin_usd.renderers.background.planet.radiance import PlanetRadiance, fine_radiance
from spin_usd.scene.light import DistantLight

WIDE = 0.03  # radians between nodes, above which they are too far apart
Hidden = NDArray[np.bool_] | None
"""The pixels (H, W) of which nothing behind the target is seen; None where that is not known."""
Lit = tuple[Region, PlanetRadiance]
"""Pixels of the frame, and the light (H, W) that comes from there."""


class PlanetView:
    """`globe` in the light of `suns`, as far as it lies in the `region` of the camera's frame."""

    def __init__(self, camera: Camera, globe: Globe, suns: tuple[DistantLight, ...], region: Region) -> None:
        self._camera, self._globe, self._suns = camera, globe, suns
        self._whole = on_nodes(region)
        xy = node_coordinates(camera)[:, *_nodes(self._whole)]
        self._points = Points.of(globe, suns, Rays.through(camera, xy)).on_grid()
        planet = globe.planet
        self._air = AIR_HEIGHTS * planet.atmosphere * 3 / sum(planet.radii) if globe.air else 0.0

    def radiance(self, block: Region, hidden: Hidden) -> Iterator[Lit]:
        """Yield the light of the block's pixels, as far as they are in the frame, not `hidden`, and meet the planet or
        its air."""
        if not self._seen(block, hidden):
            return
        if self._spacing(block) == SPACING:
            yield self._cut(block, fine_radiance(self.part(block), SPACING))
            return
        for patch in blocks(block, PATCH):
            if self._seen(patch, hidden):
                yield self._cut(patch, self._along_limb(patch))

    def part(self, block: Region) -> Points:
        """Return the nodes of the block."""
        return self._points.part(self._at(block))

    def _along_limb(self, patch: Region) -> PlanetRadiance:
        spacing = self._spacing(patch)
        if spacing == SPACING:
            return fine_radiance(self.part(patch), SPACING)
        xy = np.stack(enlarged(list(node_coordinates(self._camera)[:, *_nodes(patch)]), SPACING // spacing))
        # Slow noise is that of the nodes, also along the limb.
        weather = self._points.weather and self._points.weather.part(self._at(patch), SPACING // spacing)
        points = Points.of(self._globe, self._suns, Rays.through(self._camera, xy)).on_grid(weather)
        return fine_radiance(points, spacing)

    def _seen(self, block: Region, hidden: Hidden) -> bool:
        meeting, at = self._points.meeting, self._at(block)
        near = meeting.inside[at].max() > -2 * SPACING
        if not near and meeting.height[at].min() >= self._air:
            return False
        return hidden is None or not hidden[(block & self._camera.frame).slices].all()

    def _spacing(self, block: Region) -> int:
        """Return the pixels between nodes: interpolated, a point is then off by a sixteenth of a pixel at most.

        From a limb so many pixels away, pixels grow by a half of that part from one to the next.
        """
        meeting, at, spacing = self._points.meeting, self._at(block), SPACING
        inside, widest = meeting.inside[at].min() - SPACING, meeting.footprint[at].max()
        while spacing > 1 and (inside < spacing * spacing or spacing * widest > WIDE):
            spacing //= 2
        return spacing

    def _cut(self, block: Region, light: PlanetRadiance) -> Lit:
        own = block & self._camera.frame
        rows, columns = own.shape
        cut = [[plane[:rows, :columns] for plane in planes] for planes in (light.radiance, light.transmittance)]
        return own, PlanetRadiance(radiance=cut[0], transmittance=cut[1])

    def _at(self, block: Region) -> tuple[slice, slice]:
        rows, columns = _nodes(block)
        top, left = self._whole.y0 // SPACING, self._whole.x0 // SPACING
        return slice(rows.start - top, rows.stop - top), slice(columns.start - left, columns.stop - left)


def _nodes(region: Region) -> tuple[slice, slice]:
    """Return the nodes of a box whose edges are nodes, the last ones included."""
    rows = slice(region.y0 // SPACING, region.y1 // SPACING + 1)
    return rows, slice(region.x0 // SPACING, region.x1 // SPACING + 1)


def filling_rays(globe: Globe, steps: int) -> tuple[Rays, float]:
    """Rays (N,) that fill the cone in which the planet and its air are seen, and the solid angle of each, sr."""
    axis = globe.centre / globe.distance
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    across /= np.linalg.norm(across)
    up = np.cross(axis, across)
    # Rings of equal solid angle: 1 - cos grows evenly.
    versine = globe.angular_radius_sine**2 / (1 + np.sqrt(1 - globe.angular_radius_sine**2))
    v = (np.arange(steps) + 0.5) / steps * versine
    turn = (np.arange(2 * steps) + 0.5) / (2 * steps) * 2 * np.pi
    sine = np.sqrt(v * (2 - v))
    d = (
        (1 - v)[:, None, None] * axis
        + (sine[:, None] * np.cos(turn))[..., None] * across
        + (sine[:, None] * np.sin(turn))[..., None] * up
    ).reshape(-1, 3)
    solid_angle = 2 * np.pi * versine / len(d)
    # They span nothing: each meets the planet or does not.
    rays = Rays(x=d[:, 0], y=d[:, 1], z=d[:, 2], length=np.ones(len(d), np.float32), angle=np.zeros(len(d), np.float32))
    return rays, solid_angle
