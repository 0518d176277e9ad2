"""The looks of Tango: inputs of UsdPreviewSurface, one line a material.

matt: one colour a material, on large faces worn by 4 % (root mean square), and nothing but diffuse reflection (an index
of refraction of 1 reflects nothing), as simple simulators draw it.

reflective: the library's materials (tools/materials/table.py), but where Tango differs from them: colours guided by the
values that SPIN ships for its own Tango (solar cells 0.154, gold 0.82, 0.65, 0.058, galvanised metal 0.179), by
pictures of the flight model and its mock-up, and by dust and fingerprints, as far as they are seen straight on.

mockup: greys by the ratios of parts in real pictures of the mock-up in SPEED+'s test bed, and by the fit of light to
them (`spin-usd gap --fit light`): one white paint, film that mirrors and scatters a little, so that it is grey under
wide light, cells 25 times darker than the paint between them and glossier. The strength of light is fitted too, so that
only ratios count.
"""

from dataclasses import replace
from typing import Any

from materials.table import LIBRARY
from materials.values import MaterialValues, Picture, Sample, worn
from materials.wear import METRES

from tango import dimensions as d
from tango.mockup_textures import FILM_SIZE, PAINT, PANEL_SIZE

CELLS = Picture(file="solar_cell.png", metres=d.CELL_ATLAS, raw=False)
BARS = Picture(file="solar_cell_metal.png", metres=d.CELL_ATLAS)


def _matt(grey: float, wear: float = 0.0, *, size: float = METRES, degrees: float = 0.0) -> MaterialValues:
    """One grey, or one that wear changes by so large a part of it."""
    colour = worn(grey, grey * wear, size=size, degrees=degrees, output="rgb") if wear else (grey, grey, grey)
    return MaterialValues(colour=colour, roughness=1.0, ior=1.0)


MATT: dict[str, MaterialValues] = {
    "SolarCell": _matt(0.035),
    "PanelSubstrate": _matt(0.38, 0.3),
    "GoldMli": _matt(0.60, 0.3, size=0.43),
    "KaptonTape": _matt(0.45),
    "Silver": _matt(0.70),
    "BlackMli": _matt(0.05),
    "CableJacket": _matt(0.55),
    "BlackPaint": _matt(0.06),
    "BrushedAluminium": _matt(0.50, 0.3, size=0.29),
    "WhitePaint": _matt(0.80, -0.3, size=0.37, degrees=61.0),
    "Glass": _matt(0.02),
}

OF_LIBRARY = {
    "SolarCell": "solar_cell",
    "PanelSubstrate": "solar_panel_substrate",
    "GoldMli": "gold_foil",
    "KaptonTape": "kapton_tape",
    "Silver": "silver",
    "BlackMli": "black_foil",
    "CableJacket": "cable_jacket",
    "BlackPaint": "black_paint",
    "BrushedAluminium": "brushed_aluminium",
    "WhitePaint": "white_paint",
    "Glass": "glass",
}
"""The library's material that each of Tango's is of, in the reflective look."""

DIFFERENT: dict[str, dict[str, Any]] = {
    "SolarCell": {
        "colour": Sample(picture=CELLS, output="rgb"),
        "metallic": Sample(picture=BARS, output="r", scale=0.57, bias=0.43),
        "roughness": Sample(picture=BARS, output="r", scale=0.25, bias=0.15),
        "ior": 1.5,
    },
    "PanelSubstrate": {"colour": (0.52, 0.50, 0.46), "roughness": worn(0.45, 0.30), "ior": 1.5},
    "GoldMli": {"colour": (0.83, 0.60, 0.20)},
    "KaptonTape": {"colour": (0.62, 0.38, 0.10), "metallic": 0.6},
    "Silver": {"colour": (0.88, 0.87, 0.84)},
    "BlackPaint": {"colour": worn(0.043, 0.050, size=0.23, output="rgb")},
    "BrushedAluminium": {"colour": (0.66, 0.67, 0.68)},
    "WhitePaint": {
        "colour": worn(0.77, -0.22, size=0.37, degrees=61.0, output="rgb"),
        "roughness": worn(0.52, 0.30, size=0.37, degrees=61.0),
        "ior": 1.5,
    },
}
"""The inputs in which Tango's differ from it."""

REFLECTIVE: dict[str, MaterialValues] = {
    name: replace(LIBRARY[of].values, **DIFFERENT.get(name, {})) for name, of in OF_LIBRARY.items()
}


def _paint(grey: float, roughness: float, ior: float = 1.5) -> MaterialValues:
    return MaterialValues(colour=(grey, grey, grey), roughness=roughness, ior=ior)


MOCKUP: dict[str, MaterialValues] = {
    "SolarCell": MaterialValues(
        colour=Sample(picture=Picture(file="mockup_panel.png", metres=PANEL_SIZE), output="rgb"), roughness=0.4, ior=2.4
    ),
    "PanelSubstrate": _paint(PAINT, 0.5),
    "GoldMli": MaterialValues(
        colour=(0.8, 0.8, 0.8),
        metallic=0.85,
        roughness=0.22,
        normal=Picture(file="mockup_film_normal.png", metres=FILM_SIZE),
    ),
    "KaptonTape": _paint(PAINT, 0.5),
    "Silver": _paint(PAINT, 0.5),
    "BlackMli": _paint(0.03, 0.6),
    "CableJacket": _paint(PAINT, 0.5),
    "BlackPaint": _paint(0.03, 0.6),
    "BrushedAluminium": _paint(PAINT, 0.5),
    "WhitePaint": _paint(PAINT, 0.5),
    "Glass": _paint(0.02, 0.2),
    "BlackPlate": _paint(0.015, 0.25, 1.8),
    "MastPaint": _paint(0.04, 0.45),
}

LOOKS: dict[str, dict[str, MaterialValues]] = {"matt": MATT, "reflective": REFLECTIVE, "mockup": MOCKUP}
DEFAULT_LOOK = "reflective"
