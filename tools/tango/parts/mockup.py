"""Parts that the mock-up in the test bed of SPEED+ has in another shape than the craft: plates, panel, domes."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tango import dimensions as d
from tango.mockup_textures import FILM_ORIGIN, PANEL_SIZE
from tango.parts.mockup_equipment import boxes, heads, mast, radiator, rods, trusses, whip
from tango.shapes.bevel import EDGE
from tango.shapes.shape import Array, Shape, area_vector, joined, projected
from tango.shapes.solids import box
from tango.shapes.turned import frame, turned

FILM, PAINT = "GoldMli", "BrushedAluminium"
WALLS = {
    "-x": ((-1.0, 0.0, 0.0), d.X),
    "+x": ((1.0, 0.0, 0.0), d.X),
    "-y": ((0.0, -1.0, 0.0), -d.Y_BACK),
    "+y": ((0.0, 1.0, 0.0), d.Y_FRONT),
    "-z": ((0.0, 0.0, -1.0), d.MOCKUP_FILM),
}
"""Each wall's outward normal, and its distance from the origin along that."""
REACH = 0.016  # metres from a wall: what lies on it


def body() -> Shape:
    """Flat plates: painted x walls, and taut film over the y walls and below."""
    walls = box((-d.X, d.Y_BACK, d.DECK + EDGE), (d.X, d.Y_FRONT, d.PANEL_BOTTOM + 0.001), PAINT)
    inset = 0.003  # bars begin 2 mm within the walls: not in one plane with them
    below = box((inset - d.X, d.Y_BACK + inset, -d.MOCKUP_FILM), (d.X - inset, d.Y_FRONT - inset, 0.005), FILM)
    return covered(joined([walls, below]))


def panel() -> Shape:
    """A painted plate, with a picture of the cells on its upper side."""
    plate = box((-d.X, -d.PANEL_Y, d.PANEL_BOTTOM), (d.X, d.PANEL_Y, d.PANEL_TOP), PAINT, keep=range(4, 8))
    above = _facing(plate)[:, 2] > 0.9
    materials = tuple("SolarCell" if one else PAINT for one in above)
    return replace(
        plate,
        st=plate.st + np.outer(_of_corners(plate, above.astype(float)), np.array(PANEL_SIZE)) / 2,
        materials=materials,
    )


def dome(side: int) -> Shape:
    """The domed antenna on an x wall, and its four screws."""
    r, h = d.MOCKUP_DOME
    angles = np.radians(np.linspace(0, 90, 7))
    profile = [(0.0, -0.002), (r, -0.002), *((r * np.cos(a), h * np.sin(a)) for a in angles[:-1]), (0.0, h)]
    x, y, z = d.MOCKUP_DOME_CENTRE
    out, far = (float(side), 0.0, 0.0), d.MOCKUP_DOME_SCREWS
    screw = turned([(0, 0.0), (0.0045, 0.0), (0.0045, h * 0.92), (0, h * 0.92)], 10, "BlackPaint")
    places = [(side * x, y + s * far, z + t * far) for s in (-1, 1) for t in (-1, 1)]
    whole = turned(profile, 28, "WhitePaint").moved((side * x, y, z), frame(out))
    whole = replace(whole, st=projected(whole.points, whole.faces, _facing(whole)))
    return joined([whole, *(screw.moved(place, frame(out)) for place in places)])


def feet() -> Shape:
    """Three black pads below and a block at the +y edge, without the craft's ring."""
    pads = (box((x - 0.032, y - 0.030, -0.014), (x + 0.032, y + 0.030, 0.002), "BlackPaint") for x, y in d.MOCKUP_FEET)
    return joined([*pads, box((-0.022, 0.262, -0.030), (0.022, 0.301, 0.002), "BlackPaint")])


SHAPES: dict[str, Callable[[], Shape]] = {
    "Body": body,
    "Brackets": trusses,
    "Radiator": radiator,
    "SolarPanel": panel,
    "AntennaMinusX": lambda: mast("antenna_tip_9"),
    "AntennaPlusX": lambda: mast("antenna_tip_10"),
    "AntennaMinusY": lambda: mast("antenna_tip_11"),
    "PatchPlusX": lambda: dome(1),
    "PatchMinusX": lambda: dome(-1),
    "WhipPlusX": lambda: whip(1),
    "WhipMinusX": lambda: whip(-1),
    "Harness": rods,
    "OpticalHeads": heads,
    "SunSensors": boxes,
    "SeparationRing": feet,
}


def covered(shape: Shape) -> Shape:
    """Each face with the material of the wall on which it lies, or which it faces; st of a film's are the film's."""
    facing, names = _facing(shape), []
    for face, towards in zip(shape.faces, facing, strict=True):
        middle = shape.points[list(face)].mean(axis=0)
        near = [name for name, (wall, far) in WALLS.items() if far - np.array(wall) @ middle < REACH]
        names.append(max(near or WALLS, key=lambda name: float(np.array(WALLS[name][0]) @ towards)))
    flat = [np.array(WALLS[name][0]) @ towards > 0.9 for name, towards in zip(names, facing, strict=True)]
    origins = [FILM_ORIGIN.get(name, (0.0, 0.0)) if one else (0.0, 0.0) for name, one in zip(names, flat, strict=True)]
    counts = [len(face) for face in shape.faces]
    materials = tuple(PAINT if name in ("-x", "+x") else FILM for name in names)
    return replace(shape, st=shape.st + np.repeat(origins, counts, axis=0), materials=materials)


def _facing(shape: Shape) -> Array:
    """Unit normals (F, 3) of faces."""
    normals = np.array([area_vector(shape.points[list(face)]) for face in shape.faces])
    return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))


def _of_corners(shape: Shape, of_faces: Array) -> Array:
    return np.repeat(of_faces, [len(face) for face in shape.faces])
