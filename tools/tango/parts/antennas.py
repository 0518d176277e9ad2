"""The three large antennas that end at official points, and the patches and whips on the x walls."""

from collections.abc import Iterator

import numpy as np

from tango import dimensions as d
from tango.shapes.fasteners import head, heads
from tango.shapes.shape import Shape, joined
from tango.shapes.solids import prism
from tango.shapes.turned import Profile, frame, rod, turned

SEGMENTS = 24
BANDS = (0.30, 0.66)  # where raised bands join the pieces of a mast, as shares of its length
BAND = 0.0009  # metres by which they stand out


def corner_antenna(name: str) -> Shape:
    """A tapered rod from a corner of the panel outwards; its cap's middle is the official tip."""
    (r0, r1), length = d.ANTENNA_RADII[name], _length(name)
    mast = [(0, 0.02), (r0 - 0.003, 0.02), (r0 - 0.003, 0.045), *_tapered(r0 - 0.003, r1, 0.045, length)]
    return joined([*_collar(name, -0.004), _rod(name, mast, "BlackPaint")])


def wall_antenna(name: str) -> Shape:
    """The antenna that stands on the -y wall: shaft, collar, tapered rod."""
    (r0, r1), length = d.ANTENNA_RADII[name], _length(name)
    shaft = [(0, -0.050), (r0 - 0.004, -0.050), (r0 - 0.004, 0.080), (0, 0.080)]
    mast = [(0, 0.09), (r0 - 0.001, 0.09), (r0 - 0.001, 0.11), *_tapered(r0 - 0.001, r1, 0.11, length)]
    return joined([_rod(name, shaft, "BlackPaint"), *_collar(name, 0.072), _rod(name, mast, "BlackPaint")])


def _collar(name: str, at: float) -> Iterator[Shape]:
    """The metal collar at a mast's base, with a groove and a ring of screws."""
    r, top = d.ANTENNA_RADII[name][0], at + d.COLLAR_HEIGHT + 0.004
    groove = [(r, top - 0.010), (r - 0.001, top - 0.009), (r - 0.001, top - 0.008), (r, top - 0.007)]
    profile = [(0, at), (r - 0.001, at), (r, at + 0.001), *groove, (r, top - 0.001), (r - 0.001, top), (0, top)]
    yield _rod(name, profile, "BrushedAluminium")
    axes = frame(np.subtract(d.POINT[name], d.ANTENNA_BASE[name]))
    for angle in 2 * np.pi * (np.arange(8) + 0.25) / 8:
        outwards = axes @ (np.cos(angle), np.sin(angle), 0.0)
        place = d.ANTENNA_BASE[name] + axes[:, 2] * (at + 0.013) + outwards * (r - 0.0006)
        yield from heads([place], outwards, head(0.0030, 0.0020, "BlackPaint"))


def _tapered(r0: float, r1: float, z0: float, z1: float) -> Profile:
    """The rest of a profile: a taper that flattens towards its end, its bands, a rounded rim, a dished cap."""

    def at(s: float, more: float = 0.0) -> tuple[float, float]:
        return r1 + (r0 - r1) * (1 - s) ** 1.4 + more, z0 + (z1 - 0.003 - z0) * s

    wall = {s: at(s) for s in np.linspace(0, 1, 7)[1:].tolist()}
    for band in BANDS:
        wall |= {band + s: at(band + s, more) for s, more in ((-0.03, 0), (-0.026, BAND), (0.026, BAND), (0.03, 0))}
    cap = [(r1 - 0.001, z1 - 0.001), (r1 - 0.003, z1), (r1 - 0.006, z1), (r1 - 0.007, z1 - 0.0015)]
    return [*(wall[s] for s in sorted(wall)), *cap, (0.006, z1 - 0.0015), (0.005, z1), (0.0, z1)]


def patch() -> Shape:
    """A round patch antenna on the +x wall: flange, white radome, eight screws."""
    r, h = d.PATCH_RADIUS, d.PATCH_HEIGHT
    rim = [(r, -0.006), (r, 0.004), (r - 0.0005, 0.0046), (r - 0.0015, 0.005)]
    flange = turned([(0, -0.006), *rim, (0, 0.005)], 32, "BrushedAluminium")
    dome = [(0.026, 0), (0.026, 0.0065), (0.0255, 0.0078), (0.024, 0.0088), (0.020, 0.0094), (0.012, h), (0, h)]
    radome = turned([(0, 0), *dome], 28, "WhitePaint")
    ring = [(0.0312 * np.cos(a), 0.0312 * np.sin(a), 0.005) for a in np.pi * (np.arange(8) / 4 + 0.125)]
    screws = heads(ring, (0.0, 0.0, 1.0), head(0.0026, 0.0018, "BlackPaint"))
    return joined([flange, radome, *screws]).moved(d.PATCH_CENTRE, frame((1.0, 0.0, 0.0)))


def whip() -> Shape:
    """A thin monopole on the +x wall: a three-cornered foot with screws, an insulator, a ferrule, the wire."""
    r, length = d.WHIP_RADIUS, d.WHIP_TIP_X - d.X
    outline = [(-0.019, -0.018), (0.019, -0.018), (0.003, 0.022), (-0.003, 0.022)]
    foot = prism(outline, -0.006, 0.006, "BrushedAluminium")
    places = [(s * 0.012, -0.013, 0.006) for s in (-1, 1)]
    screws = heads(places, (0.0, 0.0, 1.0), head(0.0024, 0.0018, "BlackPaint"))
    cone = [(0.009, 0.0), (0.009, 0.0095), (0.0085, 0.010), (0.0045, 0.023), (0.004, 0.024), (0, 0.024)]
    insulator = turned([(0, 0.0), *cone], 14, "WhitePaint")
    wire = [(0.003, 0.0), (0.003, 0.030), (r, 0.031), (r, length - 0.001), (r - 0.0008, length)]
    monopole = turned([(0, 0.0), *wire, (0, length)], 8, "BrushedAluminium")
    upright = np.stack([(0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)], axis=1)
    return joined([foot, *screws, insulator, monopole]).moved(d.WHIP_BASE, upright)


def _rod(name: str, profile: Profile, material: str) -> Shape:
    return rod(d.ANTENNA_BASE[name], d.POINT[name], profile, SEGMENTS, material)


def _length(name: str) -> float:
    return float(np.linalg.norm(np.subtract(d.POINT[name], d.ANTENNA_BASE[name])))
