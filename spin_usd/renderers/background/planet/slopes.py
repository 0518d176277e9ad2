"""Slopes of a planet's relief, by which light and shadow fall on clouds and mountains."""

import numpy as np

from spin_usd.renderers.background.arithmetic.elementary import Float32
from spin_usd.renderers.background.arithmetic.enlarge import enlarged
from spin_usd.renderers.background.noise.octaves import octave
from spin_usd.renderers.background.noise.tile import MEAN_WAVE
from spin_usd.renderers.background.planet.maps import ramp
from spin_usd.renderers.background.planet.node_grid import NodeGrid, Octave
from spin_usd.renderers.background.planet.sunlight import SunAtPoints

RELIEF_GAIN = 0.75  # of the octaves' heights, besides their own: finer detail is thickness and colour, hardly slope
FINEST_RELIEF = 0.25  # scale heights of the air: the waves by which relief has a half of its height
STRIDE = 2  # pixels, at least, from one to the next of the points at which slopes are looked up
LOW = np.float32(0.15)  # the cosine of a Sun's zenith angle, below which slopes gain no more contrast
HIGH = (0.2, 0.5)  # the tangents of that angle, below and above which slopes show nothing and all


class Slopes:
    """How much the relief of octaves of noise rises toward each Sun, over a scale height of the air and times the
    tangent of the Sun's zenith angle.

    Each octave is looked up again a little way toward the Sun: differences between pixels would show the facets of what
    is interpolated between points.
    """

    def __init__(self, nodes: NodeGrid) -> None:
        self._nodes, self._stride = nodes, nodes.spacing
        self._height = nodes.points.globe.scale_height
        self._steep = [_steep(sun) for sun in nodes.points.suns]
        self._totals: dict[int, Float32] = {}

    def add(self, found: Octave, values: Float32, plain: Float32, folded: Float32) -> None:
        """Add an octave of those `values`: `plain` of them as they are, `folded` of their absolute value."""
        finest, step = FINEST_RELIEF * self._height, found.wave / MEAN_WAVE
        if not 2 * found.wave > finest > 0:
            return
        to = max(found.stride, min(STRIDE, self._stride))
        values, plain, folded = (_every(plane, to // found.stride) for plane in (values, plain, folded))
        height = self._height * RELIEF_GAIN**found.number * found.wave**2 / (found.wave**2 + finest**2)
        for sun, steep in enumerate(self._steep):
            if steep.any():
                moved = [face.moved(sun, step) for face in self._nodes.points.faces]
                ahead = octave(moved, found.wave, found.number, finer=self._nodes.spacing // to)
                rise = (ahead - values) * plain + (np.abs(ahead) - np.abs(values)) * folded
                self._add(sun, np.asarray(rise * np.float32(height / step)), to)
        self._stride = to

    def _add(self, sun: int, rise: Float32, stride: int) -> None:
        if sun in self._totals:
            (before,) = enlarged([self._totals[sun]], self._stride // stride)
            rise += before
        self._totals[sun] = rise

    def at_pixels(self) -> list[Float32 | None]:
        """Return the sum of all octaves for each Sun; None where it is 0 everywhere."""
        found: list[Float32 | None] = [None] * len(self._steep)
        for sun, total in self._totals.items():
            (steep,) = self._nodes.enlarged([self._steep[sun]], to=self._stride)
            (found[sun],) = enlarged([total * steep], self._stride)
        return found


def _every(plane: Float32, step: int) -> Float32:
    return plane if step == 1 else plane[::step, ::step]


def _steep(sun: SunAtPoints) -> Float32:
    """Return the tangent of the Sun's zenith angle, as far as it says how bright slopes are."""
    tangent = np.sqrt(np.maximum(1 - sun.cosine * sun.cosine, 0)) / np.maximum(sun.cosine, LOW)
    return np.asarray(tangent * ramp(tangent, *HIGH), np.float32)
