"""The box: deck, blankets with their seams and buttons, radiator, separation ring."""

from collections.abc import Iterator

import numpy as np

from tango import dimensions as d
from tango.shapes.blanket import Blanket
from tango.shapes.fasteners import head, heads
from tango.shapes.shape import Point, Shape, joined
from tango.shapes.solids import box, prism
from tango.shapes.tape import tape
from tango.shapes.turned import frame, turned


def body() -> Shape:
    """Crumpled gold blankets around the sides and below, the tape along their seams and the buttons that hold them."""
    inset = d.BLANKET_INSET
    walls = Blanket(
        low=(-d.X + inset, d.Y_BACK + inset, 0.004),
        high=(d.X - inset, d.Y_FRONT - inset, d.PANEL_BOTTOM + 0.001),
        cell=d.BLANKET_CELL,
        depth=d.BLANKET_WRINKLE,
        material="GoldMli",
        seams=(d.SEAM_X, (d.Y_MIDDLE,), ()),
        buttons=[place for _, places in _buttons() for place in places],
        plain=((2, 0), (2, 1)),
    )
    below = Blanket(
        low=(-0.335, d.Y_BACK + 0.030, -0.002),
        high=(0.335, d.Y_FRONT - 0.030, 0.006),
        cell=d.BLANKET_CELL_BELOW,
        depth=d.BLANKET_WRINKLE,
        material="GoldMli",
        seams=((0.0,), (d.Y_MIDDLE,), ()),
        plain=((2, 1),),
    )
    button = head(d.BUTTON_RADIUS, d.BUTTON_HEIGHT, "KaptonTape", sides=8, sunk=0.00213)
    buttons = (shape for towards, places in _buttons() for shape in heads(places, towards, button))
    return joined([walls.shape(), below.shape(), *corners(), *seams(), *seams_below(), *buttons])


def _buttons() -> Iterator[tuple[tuple[float, float, float], list[tuple[float, float, float]]]]:
    """Where the blankets' buttons are: for each wall the way it looks, and the places on the foil."""
    inset = d.BLANKET_INSET
    for sx in (-1, 1):
        yield (
            (float(sx), 0.0, 0.0),
            [(sx * (d.X - inset), y, z) for y in (-0.185, -0.075, 0.105, 0.205) for z in (0.075, 0.180)],
        )
    for sy, wall in ((-1.0, d.Y_BACK), (1.0, d.Y_FRONT)):
        places = [(x, wall - sy * inset, z) for x in (-0.270, -0.100, 0.100, 0.270) for z in (0.090, 0.205)]
        yield (0.0, sy, 0.0), places


def corners() -> Iterator[Shape]:
    """What the blankets' edges are folded over: a rounded bar of taped foil up each edge of the box."""
    low, high = d.DECK + 0.0005, d.PANEL_BOTTOM + 0.001
    for sx in (-1, 1):
        for y in (d.Y_BACK, d.Y_FRONT):
            x, inner = sx * d.X, np.sign(y) * d.TAPE_WIDTH
            (x0, x1), (y0, y1) = sorted((x, x - sx * d.TAPE_WIDTH)), sorted((y, y - inner))
            yield box((x0, y0, low), (x1, y1, high), "KaptonTape", bevel=0.003)


def seams() -> Iterator[Shape]:
    """Tape up the walls where two pieces of foil meet, and along their lower edges."""
    low, high, up = d.DECK + 0.0004, d.PANEL_BOTTOM - 0.002, d.SEAM_HEIGHT
    for sy, wall in ((-1.0, d.Y_BACK + d.BLANKET_INSET), (1.0, d.Y_FRONT - d.BLANKET_INSET)):
        for x in d.SEAM_X:
            yield tape((x, wall, low), (x, wall, high), (0.0, sy, 0.0), d.TAPE_WIDTH, up)
        yield tape((-0.352, wall, low + 0.004), (0.352, wall, low + 0.004), (0.0, sy, 0.0), 0.016, up - 0.0004)
    for sx in (-1.0, 1.0):
        x = sx * (d.X - d.BLANKET_INSET)
        yield tape((x, d.Y_MIDDLE, low), (x, d.Y_MIDDLE, high), (sx, 0.0, 0.0), d.TAPE_WIDTH, up)
        ends = [(x, y, low + 0.004) for y in (d.Y_BACK + 0.018, d.Y_FRONT - 0.018)]
        yield tape(ends[0], ends[1], (sx, 0.0, 0.0), 0.017, up - 0.0004)


def seams_below() -> Iterator[Shape]:
    """Tape across the blanket below, and around its rim on the deck."""
    down, z, rim = (0.0, 0.0, -1.0), -0.002, 0.020
    low, high = d.Y_BACK + 0.030, d.Y_FRONT - 0.030
    yield tape((0.0, low, z), (0.0, high, z), down, d.TAPE_WIDTH, d.SEAM_HEIGHT)
    yield tape((-0.335, d.Y_MIDDLE, z), (0.335, d.Y_MIDDLE, z), down, 0.015, d.SEAM_HEIGHT - 0.0004)
    for y in (low, high):
        yield tape((-0.340, y, z), (0.340, y, z), down, rim, 0.0010)
    for x in (-0.335, 0.335):
        yield tape((x, low - 0.006, z), (x, high + 0.006, z), down, 0.021, 0.0018)


def deck() -> Shape:
    """The bottom plate, whose lower corners are official points 5 to 8, and the bolts along its edge."""
    low, high = (-d.X, d.Y_BACK, 0.0), (d.X, d.Y_FRONT, d.DECK)
    plate = box(low, high, "BrushedAluminium", keep=range(4))
    bolt = head(0.0045, 0.0035, "BlackPaint")
    edge: list[Point] = [
        (x, y, 0.0) for x in np.linspace(-0.31, 0.31, 8) for y in (d.Y_BACK + 0.010, d.Y_FRONT - 0.010)
    ]
    edge += [(x, y, 0.0) for x in (-0.358, 0.358) for y in np.linspace(-0.15, 0.19, 4)]
    return joined([plate, *heads(edge, (0.0, 0.0, -1.0), bolt)])


def radiator() -> Shape:
    """Two white plates on the +y wall, screwed down along their rims, and the rail between them."""
    y, screw = d.Y_FRONT - 0.005, head(0.0028, 0.0016, "BrushedAluminium")
    pieces: list[Shape] = []
    for x0, x1, z0, z1 in d.RADIATOR:
        front = y + 0.005 + d.RADIATOR_THICKNESS
        pieces.append(box((x0, y, z0), (x1, front, z1), "WhitePaint", bevel=0.001))
        rim: list[Point] = [
            (x, front, z) for z in (z0 + 0.007, z1 - 0.007) for x in np.linspace(x0 + 0.007, x1 - 0.007, 5)
        ]
        rim += [(x, front, (z0 + z1) / 2) for x in (x0 + 0.007, x1 - 0.007)]
        pieces += heads(rim, (0.0, 1.0, 0.0), screw)
    return joined(pieces)


def separation_ring() -> Shape:
    """A flanged ring below the deck with its bolts, and three release feet around it."""
    (r0, r1), h = d.RING_RADII, d.RING_HEIGHT
    profile = [(r1, 0.002), (r0, 0.002), (r0, -h + 0.0005), (r0 + 0.0005, -h), (r0 + 0.0065, -h)]
    profile += [(r0 + 0.007, -h + 0.0005), (r1 - 0.002, -0.0055), (r1 + 0.0055, -0.0055), (r1 + 0.006, -0.005)]
    ring = turned(profile, 48, "BrushedAluminium", ring=True)
    angles = 2 * np.pi * (np.arange(24) + 0.5) / 24
    places = [(0.1440 * np.cos(a), 0.1440 * np.sin(a), -0.0055) for a in angles]
    bolts = heads(places, (0.0, 0.0, -1.0), head(0.0026, 0.0022, "BlackPaint", sunk=0.00313))
    middle = joined([ring, *bolts]).moved((0.0, d.Y_MIDDLE, 0.0))
    return joined([middle, *(shape for angle in (30, 150, 270) for shape in foot(np.radians(angle)))])


def foot(angle: float) -> Iterator[Shape]:
    """One release foot, its point towards the middle: a plate, two hooks, a pin between them, four screws."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    at = (d.FOOT_RADIUS * c, d.Y_MIDDLE + d.FOOT_RADIUS * s, 0.0)
    outline = [(0.042, -0.028), (0.042, 0.028), (-0.022, 0.042), (-0.060, 0.012), (-0.060, -0.012), (-0.022, -0.042)]
    yield prism(outline, -d.FOOT_HEIGHT, 0.002, "BlackMli").moved(at, turn)
    for y in (-0.020, 0.020):
        hook = box((-0.046, y - 0.008, -d.HOOK_HEIGHT), (-0.026, y + 0.008, -0.004), "BrushedAluminium")
        yield hook.moved(at, turn)
    pin = turned([(0, -0.030), (0.003, -0.030), (0.003, 0.030), (0, 0.030)], 8, "BrushedAluminium")
    yield pin.moved((-0.036, 0.0, -0.0155), frame((0.0, 1.0, 0.0))).moved(at, turn)
    places = [(x, y, -d.FOOT_HEIGHT) for x in (0.032, -0.010) for y in (-0.020, 0.020)]
    screws = heads(places, (0.0, 0.0, -1.0), head(0.0032, 0.0022, "BrushedAluminium"))
    yield from (screw.moved(at, turn) for screw in screws)
