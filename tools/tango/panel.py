"""The solar panel and its cells."""

from collections.abc import Iterator
from dataclasses import replace

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
    """The solar cells on both halves of the panel, each with its two outer corners cropped, each a little different."""
    (x0, x1), (y0, y1) = d.CELL_AREA_X, d.CELL_AREA_Y
    pitch_x, pitch_y = (x1 - x0) / d.CELL_COLUMNS, (y1 - y0) / d.CELL_ROWS
    (a, b), crop = np.array(d.CELL_SIZE) / 2, d.CELL_CROP
    outline = [(-a, -b), (a - crop, -b), (a, -b + crop), (a, b - crop), (a - crop, b), (-a, b)]
    cell = prism(outline, 0.0, d.CELL_THICKNESS, "SolarCell")
    for column, row in np.ndindex(d.CELL_COLUMNS, d.CELL_ROWS):
        x, y = x0 + (column + 0.5) * pitch_x, y0 + (row + 0.5) * pitch_y
        # Cropped sides of neighbouring columns face one another, so that their gaps form diamonds.
        turn = np.eye(3) if column % 2 == 0 else HALF_TURN
        for half, turned in ((1, turn), (-1, HALF_TURN @ turn)):
            yield _individual(cell, half * (1 + column + row * d.CELL_COLUMNS)).moved((half * x, y, floor), turned)


def _individual(cell: Shape, number: int) -> Shape:
    """A cell with its own shade of the texture, and normals that lean as if it were glued on not quite flat."""
    rng = np.random.default_rng([7, number + d.CELL_COLUMNS * d.CELL_ROWS])
    shade = (rng.integers(d.CELL_TONES) + 0.5) * d.CELL_SIZE
    lean = np.tan(np.radians(d.CELL_TILT)) * (2 * rng.random(2) - 1)
    normals = cell.normals + np.where(cell.normals[:, 2:] > 0.5, [*lean, 0.0], 0.0)
    return replace(cell, st=cell.st + shade, normals=normals / np.linalg.norm(normals, axis=1, keepdims=True))
