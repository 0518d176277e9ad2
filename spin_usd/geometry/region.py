"""Boxes of whole pixels."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

BAND_PIXELS = 16384  # worked on at once: the dozen temporaries of a formula fit a core's cache


@dataclass(frozen=True, kw_only=True)
class Region:
    """Pixels with x0 <= column < x1 and y0 <= row < y1; (0, 0) is the top left pixel."""

    x0: int
    y0: int
    x1: int
    y1: int

    @classmethod
    def full(cls, width: int, height: int) -> "Region":
        return cls(x0=0, y0=0, x1=width, y1=height)

    @property
    def width(self) -> int:
        return max(self.x1 - self.x0, 0)

    @property
    def height(self) -> int:
        return max(self.y1 - self.y0, 0)

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns), as numpy orders them."""
        return self.height, self.width

    @property
    def empty(self) -> bool:
        return self.width == 0 or self.height == 0

    @property
    def slices(self) -> tuple[slice, slice]:
        """Index of this box in an array of the whole frame."""
        return slice(self.y0, self.y0 + self.height), slice(self.x0, self.x0 + self.width)

    def __and__(self, other: "Region") -> "Region":
        return Region(
            x0=max(self.x0, other.x0),
            y0=max(self.y0, other.y0),
            x1=min(self.x1, other.x1),
            y1=min(self.y1, other.y1),
        )

    def within(self, other: "Region") -> "Region":
        """Return the same pixels, counted from the other's first; an empty one where there are none."""
        x0, y0 = self.x0 - other.x0, self.y0 - other.y0
        return Region(x0=x0, y0=y0, x1=x0 + self.width, y1=y0 + self.height) if not self.empty else NOWHERE

    def padded(self, pixels: int) -> "Region":
        return Region(x0=self.x0 - pixels, y0=self.y0 - pixels, x1=self.x1 + pixels, y1=self.y1 + pixels)

    def bands(self) -> "Iterator[Region]":
        """Yield the box cut into bands of whole rows, of about BAND_PIXELS each."""
        rows = max(BAND_PIXELS // max(self.width, 1), 1)
        for y0 in range(self.y0, self.y1, rows):
            yield Region(x0=self.x0, y0=y0, x1=self.x1, y1=min(y0 + rows, self.y1))


NOWHERE = Region(x0=0, y0=0, x1=0, y1=0)


def union(regions: Iterable[Region]) -> Region:
    """Return the smallest box that holds all `regions`; an empty one where all are empty."""
    held = [region for region in regions if not region.empty]
    if not held:
        return NOWHERE
    return Region(
        x0=min(each.x0 for each in held),
        y0=min(each.y0 for each in held),
        x1=max(each.x1 for each in held),
        y1=max(each.y1 for each in held),
    )
