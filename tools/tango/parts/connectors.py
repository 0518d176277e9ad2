"""Connectors, each on the plane z = 0 and looking along +z: D-shaped, round and coaxial ones."""

from tango.shapes.fasteners import head, heads
from tango.shapes.shape import Shape, joined
from tango.shapes.solids import box, prism
from tango.shapes.turned import turned

UP = (0.0, 0.0, 1.0)


def d_connector(width: float) -> Shape:
    """A D-subminiature socket of this flange width, along x: flange, shell, insert, two jack screws."""
    flange = box((-width / 2, -0.0062, -0.001), (width / 2, 0.0062, 0.0012), "BrushedAluminium", bevel=0.0003)
    a, b = width / 2 - 0.0070, width / 2 - 0.0084
    outline = [(-b, -0.0042), (b, -0.0042), (a, 0.0042), (-a, 0.0042)]
    shell = prism(outline, -0.0023, 0.0060, "BrushedAluminium", bevel=0.0004)
    insert = prism([(0.9 * x, 0.75 * y) for x, y in outline], -0.0017, 0.0063, "BlackPaint", bevel=0.0002)
    places = [(s * (width / 2 - 0.0030), 0.0, 0.0012) for s in (-1, 1)]
    return joined([flange, shell, insert, *heads(places, UP, head(0.0025, 0.0040, "BrushedAluminium"))])


def round_connector() -> Shape:
    """A circular connector under its cap: square flange, four screws, barrel, knurled ring."""
    flange = box((-0.015, -0.015, -0.001), (0.015, 0.015, 0.0022), "BrushedAluminium", bevel=0.0004)
    ring = [(0.0115, -0.0027), (0.0115, 0.006), (0.0125, 0.007), (0.0125, 0.013), (0.0118, 0.0138), (0.008, 0.0138)]
    barrel = turned([(0, -0.0027), *ring, (0.007, 0.0125), (0, 0.0125)], 18, "BlackPaint")
    places = [(0.0118 * x, 0.0118 * y, 0.0022) for x in (-1, 1) for y in (-1, 1)]
    return joined([flange, barrel, *heads(places, UP, head(0.0018, 0.0014, "BrushedAluminium"))])


def coaxial_connector() -> Shape:
    """A threaded coaxial socket and the nut of the plug on it."""
    flange = box((-0.0064, -0.0064, -0.002), (0.0064, 0.0064, 0.0016), "BrushedAluminium", bevel=0.0003)
    barrel = turned([(0, 0.0), (0.0032, 0.0), (0.0032, 0.014), (0.0022, 0.016), (0, 0.016)], 10, "BrushedAluminium")
    return joined([flange, barrel, head(0.0044, 0.0095, "Silver", sunk=-0.0045)])
