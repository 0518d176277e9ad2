"""Cells of equal area on the unit sphere: two caps, and collars of cells between them.

Source of the construction: P. Leopardi, "A partition of the unit sphere into regions of equal area and small diameter",
Electronic Transactions on Numerical Analysis 25 (2006).
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float


@dataclass(frozen=True, kw_only=True)
class SphereCells:
    """A partition of the unit sphere into `count` cells, numbered from the south pole, eastwards in each collar."""

    count: int

    @cached_property
    def rings(self) -> tuple[int, ...]:
        """The number of cells between each two latitudes, from the south: 1 of a cap; they sum to `count`."""
        if self.count < 3:
            return (1,) * self.count
        cap = 2 * np.arcsin(self.count**-0.5)
        collars = max(round((np.pi - 2 * cap) / (4 * np.pi / self.count) ** 0.5), 1)
        colatitudes = np.linspace(cap, np.pi - cap, collars + 1)
        ends = np.rint(self.count * (1 - np.cos(colatitudes)) / 2).astype(int)  # cells up to each of them
        return (1, *(int(n) for n in np.diff(ends)), 1)

    @cached_property
    def heights(self) -> Float:
        """(R + 1,) z of the latitudes between which the rings are: a share of the area is a share of the height."""
        return 2 * np.concatenate([[0], np.cumsum(self.rings)]) / self.count - 1

    def places(self, directions: Float) -> NDArray[np.intp]:
        """Return (N,) the cell of each unit direction (N, 3)."""
        ring = np.clip(np.searchsorted(self.heights, directions[:, 2], side="right") - 1, 0, len(self.rings) - 1)
        turn = np.arctan2(directions[:, 1], directions[:, 0]) % (2 * np.pi) / (2 * np.pi)
        cells = np.array(self.rings)
        across = np.minimum((turn * cells[ring]).astype(int), cells[ring] - 1)
        return np.asarray(np.concatenate([[0], np.cumsum(cells)])[ring] + across)

    def bounds(self, cell: int) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the latitudes and the longitudes of a cell, degrees."""
        firsts = np.concatenate([[0], np.cumsum(self.rings)])
        ring = int(np.searchsorted(firsts, cell, side="right")) - 1
        south, north = list(pairwise(np.degrees(np.arcsin(np.clip(self.heights, -1, 1))).tolist()))[ring]
        step = 360 / self.rings[ring]
        west = (cell - int(firsts[ring])) * step
        return (south, north), (west, west + step)

    def inside(self, cell: int) -> tuple[Float, float]:
        """Return a direction (3,) in the middle of a cell, and an angle, degrees, within which of it all is the
        cell's."""
        (south, north), (west, east) = self.bounds(cell)
        if south <= -90 or north >= 90:
            return np.array([0, 0, -1.0 if south <= -90 else 1.0]), north - south
        latitude, longitude = np.radians((south + north) / 2), np.radians((west + east) / 2)
        flat = np.cos(latitude)
        middle = np.array([flat * np.cos(longitude), flat * np.sin(longitude), np.sin(latitude)])
        aside = np.degrees(np.arcsin(flat * np.sin(min(np.radians(east - west) / 2, np.pi / 2))))
        return middle, float(min((north - south) / 2, aside))
