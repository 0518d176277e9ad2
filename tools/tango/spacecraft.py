"""Tango, part by part: what it is made of, and where everything sits. Numbers come from `dimensions`."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tango import dimensions as d
from tango.blanket import blanket
from tango.shape import Shape, joined
from tango.solids import box, prism, tray
from tango.structure import brackets
from tango.turned import frame, rod, turned

HALF_TURN = np.diag([-1.0, -1.0, 1.0])
TOWARDS_Y = frame((0.0, 1.0, 0.0))


@dataclass(frozen=True, kw_only=True)
class Part:
    """One Mesh prim: its name, the label of its class, and its surface."""

    name: str
    kind: str
    shape: Shape


def parts() -> tuple[Part, ...]:
    """The whole spacecraft, in a fixed order."""
    return (
        Part(name="Body", kind="main_body", shape=body()),
        Part(name="Deck", kind="main_body", shape=deck()),
        Part(name="Brackets", kind="main_body", shape=brackets()),
        Part(name="Radiator", kind="main_body", shape=radiator()),
        Part(name="SolarPanel", kind="solar_panel", shape=solar_panel()),
        Part(name="AntennaMinusX", kind="omni_antenna", shape=corner_antenna("antenna_tip_9")),
        Part(name="AntennaPlusX", kind="omni_antenna", shape=corner_antenna("antenna_tip_10")),
        Part(name="AntennaMinusY", kind="omni_antenna", shape=wall_antenna("antenna_tip_11")),
        Part(name="PatchPlusX", kind="omni_antenna", shape=patch()),
        Part(name="PatchMinusX", kind="omni_antenna", shape=patch().moved((0, 0, 0), HALF_TURN)),
        Part(name="WhipPlusX", kind="omni_antenna", shape=whip()),
        Part(name="WhipMinusX", kind="omni_antenna", shape=whip().moved((0, 0, 0), HALF_TURN)),
        Part(name="OpticalHeads", kind="payload", shape=optical_heads()),
        Part(name="SunSensors", kind="payload", shape=sun_sensors()),
        Part(name="SeparationRing", kind="adapter_ring", shape=separation_ring()),
    )


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


def solar_panel() -> Shape:
    """A plate whose upper corners are official points 1 to 4, with two fields of cells inside its rim."""
    floor = d.PANEL_TOP - d.PANEL_RECESS
    plate = tray(
        (-d.X, -d.PANEL_Y, d.PANEL_BOTTOM),
        (d.X, d.PANEL_Y, d.PANEL_TOP),
        d.PANEL_RIM,
        d.PANEL_RECESS,
        "BrushedAluminium",
        "PanelSubstrate",
    )
    harness = [
        box((x - 0.003, -0.355, floor), (x + 0.003, 0.355, floor + 0.0008), "KaptonTape") for x in (-0.008, 0.008)
    ]
    return joined([plate, *cells(floor), *harness])


def cells(floor: float) -> Iterator[Shape]:
    """The solar cells on both halves of the panel, each with its two outer corners cropped."""
    (x0, x1), (y0, y1) = d.CELL_AREA_X, d.CELL_AREA_Y
    pitch_x, pitch_y = (x1 - x0) / d.CELL_COLUMNS, (y1 - y0) / d.CELL_ROWS
    a, b, crop = (pitch_x - d.CELL_GAP) / 2, (pitch_y - d.CELL_GAP) / 2, d.CELL_CROP
    outline = [(-a, -b), (a - crop, -b), (a, -b + crop), (a, b - crop), (a - crop, b), (-a, b)]
    cell = prism(outline, 0.0, d.CELL_THICKNESS, "SolarCell")
    for column, row in np.ndindex(d.CELL_COLUMNS, d.CELL_ROWS):
        x, y = x0 + (column + 0.5) * pitch_x, y0 + (row + 0.5) * pitch_y
        # Cropped sides of neighbouring columns face one another, so that their gaps form diamonds.
        turn = np.eye(3) if column % 2 == 0 else HALF_TURN
        yield cell.moved((x, y, floor), turn)
        yield cell.moved((-x, y, floor), HALF_TURN @ turn)


def corner_antenna(name: str) -> Shape:
    """A tapered rod from a corner of the panel outwards; its cap's middle is the official tip."""
    start, tip = d.ANTENNA_BASE[name], d.POINT[name]
    (r0, r1), length = d.ANTENNA_RADII[name], _distance(start, tip)
    collar = [(0, -0.004), (r0 - 0.002, -0.004), (r0, -0.002), (r0, d.COLLAR_HEIGHT), (0, d.COLLAR_HEIGHT)]
    mast = [(0, 0.02), (r0 - 0.003, 0.02), (r0 - 0.003, 0.045), *_tapered(r0 - 0.003, r1, 0.045, length)]
    return joined([rod(start, tip, collar, 18, "BrushedAluminium"), rod(start, tip, mast, 18, "BlackPaint")])


def wall_antenna(name: str) -> Shape:
    """The antenna that stands on the -y wall: shaft, collar, tapered rod."""
    start, tip = d.ANTENNA_BASE[name], d.POINT[name]
    (r0, r1), length = d.ANTENNA_RADII[name], _distance(start, tip)
    shaft = [(0, -0.050), (r0 - 0.004, -0.050), (r0 - 0.004, 0.080), (0, 0.080)]
    collar = [(0, 0.072), (r0 - 0.002, 0.072), (r0, 0.074), (r0, 0.074 + d.COLLAR_HEIGHT), (0, 0.074 + d.COLLAR_HEIGHT)]
    mast = [(0, 0.09), (r0 - 0.001, 0.09), (r0 - 0.001, 0.11), *_tapered(r0 - 0.001, r1, 0.11, length)]
    return joined(
        [
            rod(start, tip, shaft, 18, "BlackPaint"),
            rod(start, tip, collar, 18, "BrushedAluminium"),
            rod(start, tip, mast, 18, "BlackPaint"),
        ]
    )


def _tapered(r0: float, r1: float, z0: float, z1: float) -> list[tuple[float, float]]:
    """The rest of a profile: a taper that flattens towards its end, a bevelled cap, the axis at z1."""
    t = np.linspace(0, 1, 5)[1:]
    wall = [(r1 + (r0 - r1) * (1 - s) ** 1.4, z0 + (z1 - 0.003 - z0) * s) for s in t.tolist()]
    return [*wall, (r1 - 0.003, z1), (0.0, z1)]


def patch() -> Shape:
    """A round patch antenna on the +x wall: flange, white radome, four screws."""
    r, h = d.PATCH_RADIUS, d.PATCH_HEIGHT
    flange = turned([(0, -0.006), (r, -0.006), (r, 0.0035), (r - 0.0015, 0.005), (0, 0.005)], 20, "BrushedAluminium")
    radome = turned([(0, 0), (0.026, 0), (0.026, 0.007), (0.023, 0.0095), (0.012, h), (0, h)], 16, "WhitePaint")
    screw = turned([(0, 0.004), (0.0028, 0.004), (0.0028, 0.007), (0, 0.007)], 6, "BlackPaint")
    ring = [(0.0312 * np.cos(a), 0.0312 * np.sin(a), 0.0) for a in np.pi * (np.arange(4) / 2 + 0.25)]
    whole = joined([flange, radome, *(screw.moved(at) for at in ring)])
    return whole.moved(d.PATCH_CENTRE, frame((1.0, 0.0, 0.0)))


def whip() -> Shape:
    """A thin monopole on the +x wall: a three-cornered foot, an insulator, the wire."""
    r, length = d.WHIP_RADIUS, d.WHIP_TIP_X - d.X
    foot = prism(
        [(-0.019, -0.018), (0.019, -0.018), (0.003, 0.022), (-0.003, 0.022)], -0.006, 0.006, "BrushedAluminium"
    )
    insulator = turned([(0, 0.0), (0.009, 0.0), (0.009, 0.010), (0.004, 0.024), (0, 0.024)], 8, "WhitePaint")
    wire = turned([(0, 0.0), (r, 0.0), (r, length - r), (0, length)], 6, "BrushedAluminium")
    upright = np.stack([(0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)], axis=1)
    return joined([foot, insulator, wire]).moved(d.WHIP_BASE, upright)


def optical_heads() -> Shape:
    """Three baffled heads that look along +y from a bracket below the panel's edge."""
    return joined(shape for x, y in zip(d.HEAD_X, d.HEAD_END_Y, strict=True) for shape in _head(x, y))


def _head(x: float, end: float) -> Iterator[Shape]:
    r, z = d.HEAD_RADIUS, d.HEAD_Z
    yield box((x - 0.022, d.Y_FRONT - 0.005, z - 0.008), (x + 0.022, end - 0.006, z - 0.004), "BlackPaint")
    yield box((x - 0.016, 0.330, z - 0.006), (x + 0.016, end - 0.040, z + 0.010), "WhitePaint")
    baffle = [(r - 0.001, -0.042), (r, -0.040), (r, 0.0), (r - 0.0015, 0.0), (r - 0.0015, -0.030), (0, -0.030)]
    yield turned([(0, -0.042), *baffle], 12, "WhitePaint").moved((x, end, z + 0.004), TOWARDS_Y)
    lens = [(0, -0.032), (r - 0.002, -0.032), (r - 0.002, -0.028), (0.005, -0.026), (0, -0.0255)]
    yield turned(lens, 12, "Glass").moved((x, end, z + 0.004), TOWARDS_Y)


def sun_sensors() -> Shape:
    """Small boxes with a round window, two on each of the free walls."""
    base = box((-0.017, -0.017, -0.006), (0.017, 0.017, 0.007), "BrushedAluminium")
    window = turned([(0, 0.0), (0.009, 0.0), (0.009, 0.008), (0.005, 0.0092), (0, 0.0095)], 10, "Glass")
    sensor = joined([base, window])
    places: list[tuple[tuple[float, float, float], tuple[float, float, float]]] = [
        ((d.X - 0.002, 0.125, 0.110), (1.0, 0.0, 0.0)),
        ((-d.X + 0.002, -0.100, 0.110), (-1.0, 0.0, 0.0)),
        ((-0.060, d.Y_BACK + 0.002, 0.160), (0.0, -1.0, 0.0)),
        ((0.060, d.Y_BACK + 0.002, 0.160), (0.0, -1.0, 0.0)),
        ((0.250, d.Y_FRONT - 0.002, 0.240), (0.0, 1.0, 0.0)),
    ]
    return joined(sensor.moved(at, frame(axis)) for at, axis in places)


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


def _distance(a: tuple[float, float, float], b: tuple[float, float, float]) -> float:
    return float(np.linalg.norm(np.subtract(a, b)))
