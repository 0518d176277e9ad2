"""The box: deck, blankets and their seams, radiator, separation ring."""

from collections.abc import Iterator

import numpy as np

from tango import dimensions as d
from tango.blanket import blanket
from tango.shape import Shape, joined
from tango.solids import box, prism
from tango.turned import turned


def body() -> Shape:
    """Crumpled gold blankets around the sides and below, and the tape along their seams."""
    inset = d.BLANKET_INSET
    walls = blanket(
        (-d.X + inset, d.Y_BACK + inset, 0.004),
        (d.X - inset, d.Y_FRONT - inset, d.PANEL_BOTTOM + 0.001),
        d.BLANKET_CELL,
        d.BLANKET_WRINKLE,
        "GoldMli",
        plain=((2, 0), (2, 1)),
    )
    below = blanket(
        (-0.335, d.Y_BACK + 0.030, -0.002),
        (0.335, d.Y_FRONT - 0.030, 0.006),
        d.BLANKET_CELL,
        d.BLANKET_WRINKLE,
        "GoldMli",
        plain=((2, 1),),
    )
    return joined([walls, below, *seams()])


def seams() -> Iterator[Shape]:
    """Strips of tape: down the four edges, and across the walls where two blankets meet."""
    low, high, half = d.DECK, d.PANEL_BOTTOM + 0.001, d.TAPE_WIDTH / 2
    for sx in (-1, 1):
        for y in (d.Y_BACK, d.Y_FRONT):
            x, inner = sx * d.X, np.sign(y) * d.TAPE_WIDTH
            (x0, x1), (y0, y1) = sorted((x, x - sx * d.TAPE_WIDTH)), sorted((y, y - inner))
            yield box((x0, y0, low), (x1, y1, high), "KaptonTape")
    for x in (-0.185, 0.185):
        yield box((x - half, d.Y_BACK, low), (x + half, d.Y_BACK + 0.006, high), "KaptonTape")
        yield box((x - half, d.Y_FRONT - 0.006, low), (x + half, d.Y_FRONT, high), "KaptonTape")
    for x0, x1 in ((-d.X, -d.X + 0.006), (d.X - 0.006, d.X)):
        yield box((x0, d.Y_MIDDLE - half, low), (x1, d.Y_MIDDLE + half, high), "KaptonTape")


def deck() -> Shape:
    """The bottom plate, whose lower corners are official points 5 to 8, and the bolts along its edge."""
    plate = box((-d.X, d.Y_BACK, 0.0), (d.X, d.Y_FRONT, d.DECK), "BrushedAluminium")
    hexagon = [(0.005 * np.cos(a), 0.005 * np.sin(a)) for a in np.pi / 3 * np.arange(6)]
    bolt = prism(hexagon, -0.0035, 0.001, "BlackPaint")
    edge = [(x, y) for x in np.linspace(-0.31, 0.31, 6) for y in (d.Y_BACK + 0.014, d.Y_FRONT - 0.014)]
    return joined([plate, *(bolt.moved((x, y, 0.0)) for x, y in edge)])


def radiator() -> Shape:
    """Two white plates on the +y wall."""
    y = d.Y_FRONT - 0.005
    return joined(
        box((x0, y, z0), (x1, y + 0.005 + d.RADIATOR_THICKNESS, z1), "WhitePaint", bevel=0.003)
        for x0, x1, z0, z1 in d.RADIATOR
    )


def separation_ring() -> Shape:
    """A flanged ring below the deck, and three release feet around it."""
    (r0, r1), h = d.RING_RADII, d.RING_HEIGHT
    profile = [(r1, 0.002), (r0, 0.002), (r0, -h), (r0 + 0.007, -h), (r1 - 0.002, -0.006), (r1 + 0.006, -0.005)]
    ring = turned(profile, 36, "BrushedAluminium", ring=True)
    return joined([ring, *(shape for angle in (30, 150, 270) for shape in _foot(np.radians(angle)))])


def _foot(angle: float) -> Iterator[Shape]:
    """One release foot, its point towards the middle."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    at = (d.FOOT_RADIUS * c, d.Y_MIDDLE + d.FOOT_RADIUS * s, 0.0)
    outline = [(0.042, -0.028), (0.042, 0.028), (-0.022, 0.042), (-0.060, 0.012), (-0.060, -0.012), (-0.022, -0.042)]
    yield prism(outline, -d.FOOT_HEIGHT, 0.002, "BlackMli").moved(at, turn)
    for y in (-0.020, 0.020):
        hook = box((-0.046, y - 0.008, -d.HOOK_HEIGHT), (-0.026, y + 0.008, -0.004), "BrushedAluminium")
        yield hook.moved(at, turn)
