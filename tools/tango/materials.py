"""The two looks of Tango: inputs of UsdPreviewSurface, one line a material.

matt: one colour a material, on large faces worn by 4 % (root mean square), and nothing but diffuse reflection (an index
of refraction of 1 reflects nothing), as simple simulators draw it.

reflective: metals, coverglass, crinkled foil, guided by the values that SPIN ships for its own Tango (solar cells
0.154, metallic 0.43, roughness 0.15, clear-coat 1; gold 0.82, 0.65, 0.058, metallic 1, roughness 0.355; galvanised
metal 0.179, metallic 1, roughness 0.49; black parts metallic 0.507, roughness 0.313) and by pictures of the flight
model and its mock-up. What a surface reflects of sunlight is held near 1 minus its solar absorptance: aluminised
Kapton with the Kapton outside 0.40, black paint 0.95, white paint 0.12 (silicate) to 0.26 (silicone), polished
aluminium 0.24, GaAs cells 0.88 (Fortescue, Swinerd and Stark, Spacecraft Systems Engineering, 4th edition, 2011, table
11.3). Dust and fingerprints are in the roughness, and as far as they are seen straight on, in the colour.
"""

from materials.values import MaterialValues, Picture, Sample, worn
from materials.wear import METRES

from tango import dimensions as d

CELLS = Picture(file="solar_cell.png", metres=d.CELL_ATLAS, raw=False)
BARS = Picture(file="solar_cell_metal.png", metres=d.CELL_ATLAS)
STREAKS = Picture(file="brushed_roughness.png", metres=(0.12, 0.12))
BRUSHED = Picture(file="brushed_normal.png", metres=(0.12, 0.12))


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

REFLECTIVE: dict[str, MaterialValues] = {
    "SolarCell": MaterialValues(
        colour=Sample(picture=CELLS, output="rgb"),
        metallic=Sample(picture=BARS, output="r", scale=0.57, bias=0.43),
        roughness=Sample(picture=BARS, output="r", scale=0.25, bias=0.15),
        clearcoat=1.0,
        clearcoat_roughness=0.03,
    ),
    "PanelSubstrate": MaterialValues(colour=(0.52, 0.50, 0.46), roughness=worn(0.45, 0.30)),
    "GoldMli": MaterialValues(
        colour=(0.83, 0.60, 0.20),
        metallic=1.0,
        roughness=worn(0.34, 0.30, size=0.43),
        normal=Picture(file="foil_normal.png", metres=(0.42, 0.42), degrees=17.0),
    ),
    "KaptonTape": MaterialValues(
        colour=(0.62, 0.38, 0.10),
        metallic=0.6,
        roughness=worn(0.32, 0.30, size=0.29, degrees=41.0),
        normal=Picture(file="foil_normal.png", metres=(0.30, 0.30)),
    ),
    "Silver": MaterialValues(colour=(0.88, 0.87, 0.84), metallic=1.0, roughness=0.30),
    "BlackMli": MaterialValues(
        colour=(0.030, 0.030, 0.032),
        roughness=0.28,
        normal=Picture(file="foil_normal.png", metres=(0.36, 0.36), degrees=-31.0),
    ),
    "CableJacket": MaterialValues(colour=(0.66, 0.65, 0.61), roughness=0.38),
    "BlackPaint": MaterialValues(
        colour=worn(0.043, 0.050, size=0.23, output="rgb"), roughness=worn(0.42, 0.36, size=0.23)
    ),
    "BrushedAluminium": MaterialValues(
        colour=(0.66, 0.67, 0.68),
        metallic=1.0,
        roughness=Sample(picture=STREAKS, output="r", scale=0.30, bias=0.27),
        normal=BRUSHED,
    ),
    "WhitePaint": MaterialValues(
        colour=worn(0.77, -0.22, size=0.37, degrees=61.0, output="rgb"),
        roughness=worn(0.52, 0.30, size=0.37, degrees=61.0),
    ),
    "Glass": MaterialValues(colour=(0.010, 0.010, 0.014), roughness=0.05, clearcoat=1.0, clearcoat_roughness=0.01),
}

LOOKS: dict[str, dict[str, MaterialValues]] = {"matt": MATT, "reflective": REFLECTIVE}
DEFAULT_LOOK = "reflective"
