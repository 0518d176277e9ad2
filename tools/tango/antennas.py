"""The three large antennas that end at official points, and the patches and whips on the x walls."""

import numpy as np

from tango import dimensions as d
from tango.shape import Shape, joined
from tango.solids import prism
from tango.turned import frame, rod, turned


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


def _distance(a: tuple[float, float, float], b: tuple[float, float, float]) -> float:
    return float(np.linalg.norm(np.subtract(a, b)))
