"""The solar panel: plate, cells, and what joins them into strings."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tango import dimensions as d
from tango.shapes.fasteners import head, heads
from tango.shapes.shape import HALF_TURN, Point, Shape, joined
from tango.shapes.solids import slab, tray

FLOOR = d.PANEL_TOP - d.PANEL_RECESS
SUNK = 0.00047  # metres by which the pieces on the panel are sunk into it


def solar_panel() -> Shape:
    """A plate whose upper corners are official points 1 to 4, with two fields of cells inside its rim."""
    plate = tray(
        (-d.X, -d.PANEL_Y, d.PANEL_BOTTOM),
        (d.X, d.PANEL_Y, d.PANEL_TOP),
        d.PANEL_RIM,
        d.PANEL_RECESS,
        "BrushedAluminium",
        "PanelSubstrate",
    )
    return joined([plate, *cells(), *interconnects(), *bus_bars(), *harness(), *rivets(), *inserts()])


def cells() -> Iterator[Shape]:
    """The solar cells on both halves of the panel, each with its two outer corners cropped, each a little different."""
    (a, b), crop = np.array(d.CELL_SIZE) / 2, d.CELL_CROP
    outline = [(-a, -b), (a - crop, -b), (a, -b + crop), (a, b - crop), (a - crop, b), (-a, b)]
    cell = slab(outline, -SUNK, d.CELL_THICKNESS, "SolarCell", bevel=d.COVERGLASS_EDGE)
    for column, row in np.ndindex(d.CELL_COLUMNS, d.CELL_ROWS):
        x, y = _centre(column, row)
        # Cropped sides of neighbouring columns face one another, so that their gaps form diamonds.
        turn = np.eye(3) if column % 2 == 0 else HALF_TURN
        for half, turned in ((1, turn), (-1, HALF_TURN @ turn)):
            yield _individual(cell, half * (1 + column + row * d.CELL_COLUMNS)).moved((half * x, y, FLOOR), turned)


def _centre(column: int, row: int) -> tuple[float, float]:
    """The middle of a cell on the +x half."""
    (x0, x1), (y0, y1) = d.CELL_AREA_X, d.CELL_AREA_Y
    return x0 + (column + 0.5) * (x1 - x0) / d.CELL_COLUMNS, y0 + (row + 0.5) * (y1 - y0) / d.CELL_ROWS


def _individual(cell: Shape, number: int) -> Shape:
    """A cell with its own shade of the texture, and normals that lean as if it were glued on not quite flat."""
    rng = np.random.default_rng([7, number + d.CELL_COLUMNS * d.CELL_ROWS])
    shade = (rng.integers(d.CELL_TONES) + 0.5) * d.CELL_SIZE
    lean = np.tan(np.radians(d.CELL_TILT)) * (2 * rng.random(2) - 1)
    normals = cell.normals + np.where(cell.normals[:, 2:] > 0.5, [*lean, 0.0], 0.0)
    return replace(cell, st=cell.st + shade, normals=normals / np.linalg.norm(normals, axis=1, keepdims=True))


def interconnects() -> Iterator[Shape]:
    """The silver tabs by which each cell of a string is welded to the next, across the gap between them."""
    x, y = d.TAB_SIZE
    tab = _rectangle(x, y, -SUNK, d.CELL_THICKNESS + 0.0002, "Silver")
    for column, row, number in np.ndindex(d.CELL_COLUMNS, d.CELL_ROWS - 1, d.TABS):
        middle, here = _centre(column, row)
        aside = ((number + 0.5) / d.TABS - 0.5) * (d.CELL_SIZE[0] - 2 * d.CELL_CROP)
        between = (here + _centre(column, row + 1)[1]) / 2
        yield from (tab.moved((half * (middle + aside), between, FLOOR)) for half in (1, -1))


def bus_bars() -> Iterator[Shape]:
    """Strips that collect the current at both ends of the strings, two strings to a strip, with a terminal each."""
    reach = d.CELL_AREA_X[1] - d.CELL_AREA_X[0]
    for half in (-1, 1):
        for pair in (0.25, 0.75):
            x = half * (d.CELL_AREA_X[0] + pair * reach)
            for sy in (-1, 1):
                bar = _rectangle(0.5 * reach - 0.008, 0.0030, -SUNK, 0.0004, "Silver")
                yield bar.moved((x, sy * d.BUS_BAR_Y, FLOOR))
                terminal = _rectangle(0.007, 0.0050, -SUNK, 0.0008, "Silver")
                yield terminal.moved((x, sy * (d.BUS_BAR_Y - 0.0002), FLOOR))


def harness() -> Iterator[Shape]:
    """Two flat conductors down the middle, and the tape that holds them."""
    for x in (-0.008, 0.008):
        yield _rectangle(0.0036, 0.716, -SUNK, 0.0005, "CableJacket").moved((x, 0.0, FLOOR))
    for number, y in enumerate(np.linspace(-0.330, 0.330, 6).tolist()):
        yield _rectangle(0.030, 0.011 + 0.002 * (number % 3), -SUNK, 0.0008, "KaptonTape").moved((0.0, y, FLOOR))


def rivets() -> Iterator[Shape]:
    """Rivets in the border around the cells; they stay below the rim."""
    x, y = d.RIVET_X, d.BUS_BAR_Y
    places: list[Point] = [(s * x, y0, FLOOR) for s in (-1, 1) for y0 in np.linspace(-0.35, 0.35, 13)]
    places += [(x0, s * y, FLOOR) for s in (-1, 1) for x0 in (-0.358, 0.0, 0.358)]
    yield from heads(places, (0.0, 0.0, 1.0), head(0.0022, 0.0009, "BrushedAluminium", sunk=SUNK))


def inserts() -> Iterator[Shape]:
    """The potted inserts on the panel's underside, and the screws in them."""
    places = [(x, y, d.PANEL_BOTTOM) for x in np.linspace(-0.33, 0.33, 7) for y in (-0.360, -0.295, 0.335, 0.365)]
    down = (0.0, 0.0, -1.0)
    yield from heads(places, down, head(0.0085, 0.0006, "PanelSubstrate", sides=8))
    yield from heads([(x, y, z - 0.0006) for x, y, z in places], down, head(0.0028, 0.0018, "BlackPaint"))


def _rectangle(x: float, y: float, z0: float, z1: float, material: str) -> Shape:
    """A flat piece around the origin."""
    outline = [(-x / 2, -y / 2), (x / 2, -y / 2), (x / 2, y / 2), (-x / 2, y / 2)]
    return slab(outline, z0, z1, material, bevel=0.0001)
