"""The solar panel and its cells."""

from collections.abc import Iterator

import numpy as np

from tango import dimensions as d
from tango.shape import HALF_TURN, Shape, joined
from tango.solids import box, prism, tray


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
