"""Squares of pixels between four nodes, and which of them need more than what is interpolated between those."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spin_usd.geometry.region import Region
from spin_usd.renderers.background.arithmetic.elementary import Float32
from spin_usd.renderers.background.arithmetic.enlarge import Cells
from spin_usd.renderers.background.planet.globe import AIR_HEIGHTS, Globe, Meeting
from spin_usd.renderers.background.planet.grid import SPACING

WIDE = 0.05  # radians between nodes, above which they are too far apart
LIMB = 32.0  # pixels from the limb, from which on a point between nodes is off by an eighth of a pixel at most
Mask = NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True, eq=False)
class CellKinds:
    """Which cells (R - 1, C - 1) between the nodes (R, C) show a planet. smooth: it fills them, and can be interpolated
    between their nodes · rough: others that may show its ground · air: those that show its air alone."""

    smooth: Mask
    rough: Mask
    air: Mask

    @classmethod
    def of(cls, globe: Globe, meeting: Meeting) -> "CellKinds":
        """Return the kinds of the cells between the points of `meeting`.

        From a limb so many pixels away, pixels grow by a half of that part from one to the next.
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
