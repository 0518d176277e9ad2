"""Radiance between two renders, taken from them: a point of a body looks the same as in the nearest render.

Rays alone give the body and its point in each pixel at any time. That point lies somewhere in each render, and there
its radiance is taken, with the coverage, so that an edge moves with its body by parts of a pixel. Renders have finer
pixels than the picture, whose pixels are means of theirs: interpolation at the pixels' own size would blur. A render
serves if it saw the same point; areas that neither render saw are filled from neighbouring pixels, and counted.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.geometry.region import Region
from spin_usd.scene.derived.light_groups import UnitLight, gains_in
from spin_usd.scene.derived.surface import Surface
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene

RIM = 2  # pixels beside a body that may show some of its light
NEAR = 3.0  # pixels: a point so near to the one that was seen there is that one
BEYOND = -1e6  # a place far from all pixels
UNSEEN = 1e-3  # weight of filled areas, against seen ones
PAD = 4  # fine pixels around a render, which are black
OFFSETS = (0.0, 0.5)
"""From a fine pixel's left edge to the middle of the square, of an even and of an odd number, that it averages."""
Float32 = NDArray[np.float32]
Index = NDArray[np.intp]
_NEIGHBOURS = sorted(
    ((dy, dx) for dy in range(-RIM, RIM + 1) for dx in range(-RIM, RIM + 1) if dy or dx),
    key=lambda d: d[0] ** 2 + d[1] ** 2,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class ShownPixels:
    """The pixels of a `surface`, and the pixels beside them: P pixels, whose first N are the surface's own.

    row, column (P,): in the frame. of (P,): the surface's point; for a pixel beside it, the nearest one.
    """

    surface: Surface
    row: Index
    column: Index
    of: Index

    @classmethod
    def of_surface(cls, surface: Surface) -> "ShownPixels":
        """Find the pixels beside the surface's."""
        region = surface.region.padded(RIM) & surface.scene.camera.frame
        index = np.full(region.shape, -1, np.intp)
        index[surface.rows - region.y0, surface.columns - region.x0] = np.arange(len(surface.rows))
        nearest = spread_index(index)
        row, column = np.nonzero((index < 0) & (nearest >= 0))
        own = np.arange(len(surface.rows))
        return cls(
            surface=surface,
            row=np.concatenate([surface.rows, row + region.y0]),
            column=np.concatenate([surface.columns, column + region.x0]),
            of=np.concatenate([own, nearest[row, column]]),
        )

    @cached_property
    def region(self) -> Region:
        """The box of all of the pixels."""
        if not len(self.row):
            return Region(x0=0, y0=0, x1=0, y1=0)
        (y0, x0), (y1, x1) = (each(np.stack([self.row, self.column]), axis=1).tolist() for each in (np.min, np.max))
        return Region(x0=x0, y0=y0, x1=x1 + 1, y1=y1 + 1)


def spread_index(index: Index) -> Index:
    """Return an image (H, W) of numbers, -1 for none, with each pixel that has none given the nearest within RIM."""
    found = index.copy()
    height, width = index.shape
    for dy, dx in _NEIGHBOURS:
        to = slice(max(-dy, 0), height - max(dy, 0)), slice(max(-dx, 0), width - max(dx, 0))
        of = slice(max(dy, 0), height + min(dy, 0)), slice(max(dx, 0), width + min(dx, 0))
        found[to] = np.where(found[to] < 0, index[of], found[to])
    return found


class KeyRender:
    """A render of the `surface` in unit light, by pixels `fine` times finer than the picture's, from which other times
    take radiance.

    scene: the rendered scene.
    """

    def __init__(self, surface: Surface, light: UnitLight, radiance: Radiance, fine: int) -> None:
        self.scene, self.surface = surface.scene, surface
        self._unit, self._fine, self._radiance = light, fine, radiance
        self._weights: tuple[float, ...] = ()
        self._light, self._coverage = np.zeros((0, 0), np.float32), _pixel_means(radiance.coverage, fine)
        self._index = np.full(self.scene.camera.frame.shape, -1, np.int32)
        self._index[surface.rows, surface.columns] = np.arange(len(surface.rows))

    @property
    def whole(self) -> Radiance:
        """All of its radiance, where its pixels are the picture's own."""
        return self._radiance.relit(self._unit.gains)

    def taken(self, seen: ShownPixels) -> tuple[Float32, Float32, NDArray[np.bool_]]:
        """Return the light and the coverage (P,) of the pixels as they were here, and which of their points were
        seen."""
        u, v = self._places(seen.surface).T
        known = self._shows(seen.surface, u, v)
        where = _beside(seen.surface, known)  # a hidden point looks like its neighbour
        du, dv = u[where] - (seen.surface.columns[where] + 0.5), v[where] - (seen.surface.rows[where] + 0.5)
        count = len(known)
        at_u = np.concatenate([u[where], seen.column[count:] + 0.5 + du[seen.of[count:]]])
        at_v = np.concatenate([v[where], seen.row[count:] + 0.5 + dv[seen.of[count:]]])
        light, coverage = self._sampled((self._lit(seen.surface.scene), self._coverage), at_u, at_v)
        return light, np.minimum(coverage, 1), known[seen.of]

    def _lit(self, scene: Scene) -> Float32:
        """Return the signal of a detector of one channel at each fine pixel, with the strengths and colours of the
        lights of `scene`: the mean over the square of a pixel around it."""
        sensor = self.scene.sensor
        gains = gains_in(self._unit, scene) or self._unit.gains
        channel = np.array(sensor.quantum_efficiency) * np.array(sensor.panchromatic)
        weights = tuple((np.array(gains).reshape(-1, 3) * channel).ravel().tolist())
        if weights != self._weights:
            of_groups = np.array(weights, np.float32).reshape(-1, 3)
            light = np.asarray(np.einsum("gijc,gc->ij", self._radiance.groups, of_groups), np.float32)
            self._light, self._weights = _pixel_means(light, self._fine), weights
        return self._light

    def _places(self, surface: Surface) -> Float:
        """Return the pixels (N, 2) at which the points of the surface lie here."""
        places = np.full((len(surface.rows), 2), np.nan)
        for place in np.unique(surface.place):
            own = surface.place == place
            places[own] = self.scene.camera.project(self.scene.bodies[place].T_cam_body.points(surface.body[own]))
        return np.asarray(np.nan_to_num(places, nan=BEYOND))

    def _shows(self, surface: Surface, u: Float, v: Float) -> NDArray[np.bool_]:
        """Return which of the points (N,) are seen here in one of the four pixels around their places."""
        if not len(self.surface.rows):
            return np.zeros(len(u), bool)
        height, width = self._index.shape
        near = NEAR / max(self.scene.camera.fx, self.scene.camera.fy) * surface.z
        found = np.zeros(len(u), bool)
        column, row = np.floor(u - 0.5).astype(np.intp), np.floor(v - 0.5).astype(np.intp)
        for dy, dx in ((0, 0), (0, 1), (1, 0), (1, 1)):
            y, x = row + dy, column + dx
            there = (y >= 0) & (y < height) & (x >= 0) & (x < width)
            point = np.where(there, self._index[np.where(there, y, 0), np.where(there, x, 0)], -1)
            own = point >= 0
            apart = surface.body - self.surface.body[point]
            close = np.einsum("ij,ij->i", apart, apart) <= near**2
            same = (self.surface.face[point] == surface.face) | close
            found |= own & (self.surface.place[point] == surface.place) & same
        return found

    def _sampled(self, images: Sequence[Float32], u: Float, v: Float) -> list[Float32]:
        """Return each of the images of fine pixels at the picture's pixels; beyond the frame, the value at its rim.
        Interpolation is Catmull and Rom's cubic, clipped at 0."""
        frame, region, fine = self.scene.camera.frame, self._radiance.region, self._fine
        x = np.clip(u, 0.5, frame.width - 0.5) * fine - region.x0 - OFFSETS[fine % 2]
        y = np.clip(v, 0.5, frame.height - 0.5) * fine - region.y0 - OFFSETS[fine % 2]
        column, row = np.floor(x).astype(np.intp), np.floor(y).astype(np.intp)
        across, down = _cubic((x - column).astype(np.float32)), _cubic((y - row).astype(np.float32))
        found = []
        for image in images:
            total = np.zeros(len(u), np.float32)
            padded = np.pad(image, PAD)
            r, c = (
                np.clip(each + PAD - 1, 0, size + 2 * PAD - 4)
                for each, size in zip((row, column), image.shape, strict=True)
            )
            for dy in range(4):
                line = sum(across[dx] * padded[r + dy, c + dx] for dx in range(4))
                total += down[dy] * line
            found.append(np.maximum(total, 0))
        return found


def _cubic(share: Float32) -> tuple[Float32, ...]:
    """Return the weights of the four around a place, `share` of the way between the two in the middle."""
    t, t2, t3 = share, share**2, share**3
    weights = -t3 + 2 * t2 - t, 3 * t3 - 5 * t2 + 2, -3 * t3 + 4 * t2 + t, t3 - t2
    return tuple(np.asarray(each / 2, np.float32) for each in weights)


def _pixel_means(image: Float32, fine: int) -> Float32:
    """Return at each fine pixel the mean of `fine` x `fine`: around it, or, of an even number, around its corner above
    on the left."""
    import cv2  # not above: cv2 is slow to load

    padded = cv2.copyMakeBorder(image, fine, fine, fine, fine, cv2.BORDER_CONSTANT)
    return np.asarray(cv2.blur(padded, (fine, fine))[fine : -fine or None, fine : -fine or None], np.float32)


def _beside(surface: Surface, known: NDArray[np.bool_]) -> Index:
    """Return each point (N,) itself if it is known, else the nearest known one, if any is near."""
    own = np.arange(len(known))
    if known.all() or not known.any():
        return own
    region = surface.region
    index = np.full(region.shape, -1, np.intp)
    rows, columns = surface.rows - region.y0, surface.columns - region.x0
    index[rows[known], columns[known]] = own[known]
    nearest = spread_index(index)[rows, columns]
    return np.where(nearest >= 0, nearest, own)


@dataclass(frozen=True, kw_only=True, eq=False)
class Between:
    """The light and coverage (P,) of the pixels of `seen`, and which of the surface's points (N,) no render saw."""

    seen: ShownPixels
    light: Float32
    coverage: Float32
    unseen: NDArray[np.bool_]

    def radiance(self, scene: Scene) -> Radiance:
        """Return it as radiance of grey light, with the same signal in a detector of one channel."""
        region, sensor = self.seen.region, scene.sensor
        grey = float(np.dot(sensor.quantum_efficiency, sensor.panchromatic))
        rgba = np.zeros((*region.shape, 4), np.float32)
        at = self.seen.row - region.y0, self.seen.column - region.x0
        rgba[at] = np.concatenate([np.repeat(self.light[:, None] / np.float32(grey), 3, 1), self.coverage[:, None]], 1)
        return Radiance.of(region, rgba)


def between(seen: ShownPixels, before: KeyRender, after: KeyRender, share: float) -> Between:
    """Return the light of the pixels of `seen` at a time between two renders, `share` of the way."""
    total, light, coverage, known = (np.zeros(len(seen.row), np.float32) for _ in range(4))
    for key, weight in ((before, 1 - share), (after, share)):
        own_light, own_coverage, own = key.taken(seen)
        own_weight = (np.where(own, 1, UNSEEN) * weight).astype(np.float32)
        light += own_weight * own_light
        coverage += own_weight * own_coverage
        total += own_weight
        known += own
    return Between(
        seen=seen, light=light / total, coverage=coverage / total, unseen=known[: len(seen.surface.rows)] == 0
    )
