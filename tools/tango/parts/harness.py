"""The harness outside the body: cables along the walls and below the panel, and the connectors that they end in."""

from collections.abc import Iterator, Sequence
from typing import TypeAlias

import numpy as np

from tango import dimensions as d
from tango.parts.connectors import coaxial_connector, d_connector, round_connector
from tango.shapes.cables import cable, ties
from tango.shapes.fasteners import head, heads
from tango.shapes.shape import Point, Shape, joined
from tango.shapes.solids import box
from tango.shapes.tape import tape
from tango.shapes.turned import frame

Place: TypeAlias = tuple[float, float, float]

COAX, WIRE, BUNDLE = 0.0020, 0.0016, 0.0042  # metres: radii
BLACK, WHITE = "BlackPaint", "CableJacket"
# (y, z) on an x wall, for x > 0; the other wall has them turned half around z.
PATCH_COAX = ((-0.0870, 0.246), (-0.0700, 0.252), (-0.0560, 0.268), (-0.0520, 0.298))
SENSOR_WIRES = {
    1: ((0.125, 0.124), (0.128, 0.160), (0.116, 0.215), (0.121, 0.262), (0.120, 0.298)),
    -1: ((-0.100, 0.124), (-0.104, 0.170), (-0.091, 0.225), (-0.096, 0.268), (-0.094, 0.298)),
}
GROMMETS = ((-0.030, -0.345), (0.034, -0.352), (-0.110, 0.358))  # (x, y) on the panel's underside


def harness() -> Shape:
    """Every cable and connector, as one part."""
    pieces = [*side_wires(), *antenna_cables(), *back_wall(), *below_panel(), *head_wires(), *below_deck()]
    return joined(pieces)


def side_wires() -> Iterator[Shape]:
    """On the x walls: from the patches and the sun sensors up to the panel, taped to the foil."""
    for sx, wires in SENSOR_WIRES.items():
        x = sx * (d.X - 0.001)
        turned = [(sx * y, z) for y, z in PATCH_COAX]
        yield cable([(x + sx * COAX, y, z) for y, z in turned], COAX, BLACK)
        for aside in (-0.0017, 0.0017):
            yield cable([(x, y + aside, z) for y, z in wires], WIRE, WHITE)
        for y, z in (wires[1], wires[3]):
            yield _saddle((x, y, z), (0.0, 0.032, 0.0), (float(sx), 0.0, 0.0), WIRE)


def antenna_cables() -> Iterator[Shape]:
    """A coaxial cable from each corner antenna to a socket on the +y wall, in a loop that leaves it some play."""
    socket = coaxial_connector()
    for sx in (-1, 1):
        path = [(0.350, 0.352, 0.262), (0.336, 0.340, 0.276), (0.312, 0.330, 0.270), (0.286, 0.328, 0.242)]
        path += [(0.290, 0.330, 0.214), (0.300, 0.320, 0.206)]
        yield cable([(sx * x, y, z) for x, y, z in path], COAX, BLACK)
        yield socket.moved((sx * 0.300, d.Y_FRONT - 0.001, 0.206), frame((0.0, 1.0, 0.0)))


def back_wall() -> Iterator[Shape]:
    """The umbilical plate on the -y wall with its connectors, the bundle from the panel to it, the sensors' wires."""
    y, back = d.Y_BACK, (0.0, -1.0, 0.0)
    turn = frame(back)
    plate = d.Y_BACK - 0.004
    yield box((-0.095, plate, 0.030), (0.095, y + 0.008, 0.096), "BrushedAluminium", bevel=0.0008)
    corners = [(x, plate, z) for x in (-0.088, 0.0, 0.088) for z in (0.037, 0.089)]
    yield from heads(corners, back, head(0.0030, 0.0020, BLACK))
    for x, z, width in ((-0.045, 0.078, 0.053), (-0.045, 0.048, 0.053), (0.018, 0.063, 0.039)):
        yield d_connector(width).moved((x, plate, z), turn)
    yield round_connector().moved((0.062, plate, 0.062), turn)
    path = [(-0.150, y, 0.298), (-0.149, y, 0.262), (-0.138, y, 0.205), (-0.142, y, 0.150), (-0.120, y, 0.095)]
    yield from _bundle([*path, (-0.090, y + 0.001, 0.070)], BUNDLE, back)
    for sx in (-1, 1):
        path = [(sx * 0.060, y, 0.174), (sx * 0.064, y, 0.205), (sx * 0.052, y, 0.255), (sx * 0.055, y, 0.298)]
        yield cable(path, WIRE, WHITE)
        yield _saddle(path[1], (0.028, 0.0, 0.0), back, WIRE)


def below_panel() -> Iterator[Shape]:
    """Bundles from the panel's underside to the walls, each from a grommet, and one along the +y edge."""
    z, grommet = d.PANEL_BOTTOM, head(0.0095, 0.0030, BLACK, sides=12)
    for x, out in GROMMETS:
        sy, wall = (1, d.Y_FRONT) if out > 0 else (-1, d.Y_BACK)
        path = [(x, out, z + 0.004), (x, out - sy * 0.002, z - 0.007), (x + 0.004, out - sy * 0.018, z - 0.008)]
        path += [(x + 0.006, wall + sy * 0.016, z - 0.008), (x + 0.007, wall + sy * 0.002, z - 0.022)]
        yield from _bundle([*path, (x + 0.006, wall - sy * 0.002, z - 0.050)], 0.0032, None)
        yield from heads([(x, out, z)], (0.0, 0.0, -1.0), grommet)
    edge = [(-0.110, 0.350, z - 0.004), (-0.170, 0.352, z - 0.0035), (-0.240, 0.349, z - 0.004), (-0.330, 0.353, z)]
    yield from _bundle(edge, 0.0028, None)


def head_wires() -> Iterator[Shape]:
    """From each optical head back to the wall."""
    for x, aside in zip(d.HEAD_X, (-0.019, 0.020, 0.021), strict=True):
        path = [(x + 0.6 * aside, 0.342, 0.281), (x + aside, 0.332, 0.270), (x + 0.9 * aside, 0.312, 0.262)]
        yield cable([*path, (x + 0.8 * aside, d.Y_FRONT - 0.006, 0.250)], WIRE, WHITE)


def below_deck() -> Iterator[Shape]:
    """From foot to foot around the separation ring, and on to a connector at the deck's -y edge."""
    z, down = -0.0085, (0.0, 0.0, -1.0)
    for first, last in ((14, -72), (164, 252)):
        around = np.radians(np.linspace(first, last, 8))
        radius = 0.186 + 0.004 * np.sin(5 * around)
        path = [(r * np.cos(a), d.Y_MIDDLE + r * np.sin(a), z) for r, a in zip(radius, around, strict=True)]
        yield from _bundle(path, 0.0022, down)
    path = [(-0.034, -0.190, z), (-0.062, -0.198, z), (-0.088, -0.214, z), (-0.120, -0.219, z)]
    yield from _bundle(path, 0.0022, None)
    yield box((-0.142, -0.226, -0.0140), (-0.118, -0.212, 0.001), "BrushedAluminium")


def _bundle(path: Sequence[Place], radius: float, outwards: Place | None) -> Iterator[Shape]:
    """A bundle in white braid with black ties; taped down in two places where it lies on a wall."""
    yield cable(path, radius, WHITE, sides=8)
    yield from ties(path, radius, 0.045, BLACK)
    if outwards:
        for here, there in ((path[1], path[2]), (path[-3], path[-2])):
            middle, along = (np.array(here) + there) / 2, np.subtract(there, here)
            across = np.cross(along, outwards) / np.linalg.norm(along)
            yield _saddle(middle, 0.040 * across, outwards, radius)


def _saddle(at: Point, span: Point, outwards: Point, radius: float) -> Shape:
    """A piece of tape across a cable of this radius."""
    foot = np.array(at) - 0.0045 * np.array(outwards)
    ends = [foot + s * np.array(span) for s in (-0.5, 0.5)]
    return tape(ends[0], ends[1], outwards, 0.016, 0.0022, over=0.0030 + radius)
