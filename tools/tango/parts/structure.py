"""The black struts outside the body: corner trusses, panel brackets, side trusses. All are flat bars on the walls."""

from collections.abc import Iterator, Sequence
from itertools import count
from typing import TypeAlias

import numpy as np

from tango import dimensions as d
from tango.shapes.fasteners import head, heads
from tango.shapes.shape import Shape, joined
from tango.shapes.solids import box, strut

Segments: TypeAlias = Sequence[tuple[tuple[float, float], tuple[float, float]]]
Place: TypeAlias = tuple[float, float, float]

PAINT = "BlackPaint"


def brackets() -> Shape:
    """Every bar and plate of the structure, as one part."""
    pieces: list[Shape] = []
    for sx in (-1, 1):
        pieces += side_truss(sx)
        for wall in (d.Y_BACK, d.Y_FRONT):
            sy = 1 if wall > 0 else -1
            pieces += [*corner_truss(sx, sy, wall), *panel_bracket(sx, sy, wall)]
    return joined([*pieces, *antenna_plate()])


def corner_truss(sx: int, sy: int, wall: float) -> Iterator[Shape]:
    """A triangle over the lower corner of a y wall, its foot below the deck, its heel around on the x wall."""
    bars = [((0.195, 0.002), (0.370, 0.177)), ((0.195, -0.004), (0.282, -0.004)), ((0.280, 0.0), (0.280, 0.088))]
    bars += [((0.282, 0.090), (0.370, 0.090)), ((0.3735, 0.090), (0.3735, 0.180))]
    yield from on_y_wall([((sx * x0, z0), (sx * x1, z1)) for (x0, z0), (x1, z1) in bars], wall, sy)
    edge, inner, middle = wall + sy * 0.003, wall - sy * 0.022, 0.135
    heel = [((edge, 0.090), (edge, 0.180)), ((inner, 0.090), (edge, 0.090)), ((inner, 0.180), (edge, 0.180))]
    heel += [((inner, 0.090), (edge, middle)), ((inner, 0.180), (edge, middle))]
    yield from on_x_wall(heel, sx, width=0.006)
    yield plate((sx * 0.191, wall - sy * 0.024, -0.0095), (sx * 0.286, wall + sy * 0.0085, 0.0012))


def panel_bracket(sx: int, sy: int, wall: float) -> Iterator[Shape]:
    """What carries the overhanging panel at a corner: a triangle on the x wall and a frame out to the panel's edge."""
    apex, upright, end = wall - sy * 0.098, wall - sy * 0.046, sy * 0.379
    bars = [((apex, 0.253), (upright, 0.291)), ((apex, 0.253), (upright, 0.216)), ((upright, 0.216), (upright, 0.291))]
    bars += [((upright, 0.291), (end, 0.291)), ((upright, 0.216), (end, 0.216)), ((end, 0.216), (end, 0.291))]
    yield from on_x_wall(bars, sx)
    yield plate((sx * 0.372, wall + sy * 0.004, 0.212), (sx * 0.379, wall + sy * 0.040, 0.295))
    yield plate((sx * 0.352, wall - sy * 0.002, 0.290), (sx * 0.376, sy * 0.383, 0.300))
    yield plate((sx * 0.353, sy * 0.377, 0.2125), (sx * 0.375, sy * 0.382, 0.3005))


def side_truss(sx: int) -> Iterator[Shape]:
    """A small trapezium in the middle of an x wall's lower edge."""
    bars = [((-0.056, -0.004), (0.056, -0.004)), ((-0.028, 0.047), (0.028, 0.047))]
    bars += [((s * 0.056, 0.0), (s * 0.028, 0.047)) for s in (-1, 1)]
    bars += [((0.0, 0.0), (s * 0.024, 0.045)) for s in (-1, 1)]
    yield from on_x_wall(bars, sx, width=0.008)
    yield plate((sx * 0.320, -0.059, -0.0085), (sx * 0.374, 0.059, 0.0012))


def antenna_plate() -> Iterator[Shape]:
    """The plate at the panel's -y edge through which the -y antenna passes."""
    yield plate((0.255, -0.3835, 0.2135), (0.374, -0.373, 0.296))
    yield from (plate((x, -0.376, 0.285), (x + 0.008, d.Y_BACK + 0.004, 0.300)) for x in (0.258, 0.340))


def on_x_wall(bars: Segments, sx: int, width: float = d.STRUT_WIDTH, *, bolts: bool = True) -> Iterator[Shape]:
    """Bars given by their ends (y, z), lying on the wall at x = sx X."""
    x = sx * (d.X - 0.002)
    ends = [((x, y0, z0), (x, y1, z1)) for (y0, z0), (y1, z1) in bars]
    yield from _bars(ends, (float(sx), 0.0, 0.0), width, bolts=bolts)


def on_y_wall(
    bars: Segments, wall: float, sy: int, width: float = d.STRUT_WIDTH, *, bolts: bool = True
) -> Iterator[Shape]:
    """Bars given by their ends (x, z), lying on the wall at this y, which looks along sy."""
    y = wall - sy * 0.002
    ends = [((x0, y, z0), (x1, y, z1)) for (x0, z0), (x1, z1) in bars]
    yield from _bars(ends, (0.0, float(sy), 0.0), width, bolts=bolts)


def _bars(bars: Sequence[tuple[Place, Place]], outwards: Place, width: float, *, bolts: bool) -> Iterator[Shape]:
    """Bars along a wall, each a little thicker than the last, and perhaps a bolt wherever bars end.

    Bars that cross may not end in one plane, where it would be chance which of two coincident faces a ray meets.
    """
    for (start, end), more in zip(bars, count(0.0, 0.0002), strict=False):
        yield strut(start, end, outwards, width + more, d.STRUT_THICKNESS + more, PAINT)
    if not bolts:
        return
    ends = dict.fromkeys(end for bar in bars for end in bar)
    top = d.STRUT_THICKNESS + 0.0002 * (len(bars) - 1)
    places = np.array(list(ends)) + top * np.array(outwards)
    yield from heads(places, outwards, head(0.32 * width, 0.0016, "BrushedAluminium", sunk=0.00313))


def plate(a: Place, b: Place) -> Shape:
    """A box between any two opposite corners."""
    low, high = zip(*(sorted(pair) for pair in zip(a, b, strict=True)), strict=True)
    return box(low, high, PAINT)
