"""Inputs of a planet's clouds and ground at each point, independent of the viewpoint: for slow noise, at the nodes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from spin_usd.renderers.background.elementary import Float32
from spin_usd.renderers.background.enlarge import Cells, in_cells
from spin_usd.renderers.background.noise_octaves import Face, octave, resolved
from spin_usd.renderers.background.planet_maps import ramp

SWIRLS = ((0.045, 0.0012), (0.016, 0.0003))  # waves by which clouds are stirred, and how far; radians
CELL_WAVES = (0.16, 0.05)  # waves, radians, over which cells close, open and give way to sheets
VEILS = (0.35, 0.14, 0.06)  # of thin high clouds
RANGES = (0.11, 0.04)  # of mountains
FOLDED = 0.36  # the variance of the absolute value of a normally distributed number


@dataclass(frozen=True, kw_only=True, eq=False)
class Weather:
    """Noise at points of any shape."""

    plain: Float32
    """Share of the finer noise with unchanged waves."""
    cells: Float32
    """How much is their absolute value, which makes cells, open ones where it is negative."""
    veil: Float32
    """Thickness of high clouds."""
    ranges: Float32
    """How mountainous land is."""
    swirl: tuple[Float32, Float32]
    """Two ways by which the points are stirred, radians."""

    @classmethod
    def of(cls, faces: Sequence[Face], footprint: Float32) -> "Weather":
        """Return the weather at points as they lie on `faces`."""

        def noise(waves: Sequence[float], number: int, stretch: float = 1.0) -> Float32:
            total = np.zeros_like(footprint)
            for i, wave in enumerate(waves):
                total += octave(faces, wave, number + i, stretch) * resolved(footprint, wave)
            return total

        def swirl(number: int) -> Float32:
            total = np.zeros_like(footprint)
            for i, (wave, way) in enumerate(SWIRLS):
                total += octave(faces, wave, number + i) * resolved(footprint, wave) * np.float32(way)
            return total

        cells = np.clip(noise(CELL_WAVES, 60) * np.float32(0.8) + np.float32(0.35), -1, 1)
        return cls(
            plain=np.sqrt(1 - np.float32(FOLDED) * cells * cells),
            cells=cells,
            veil=noise(VEILS, 70, 2.5),
            ranges=ramp(noise(RANGES, 80), 0.4, 2.0),
            swirl=(swirl(40), swirl(47)),
        )

    def stirred(self, faces: Sequence[Face]) -> tuple[Face, ...]:
        """Return the points as the swirls move them."""
        a, b = self.swirl
        return tuple(replace(face, a=face.a + a, b=face.b + b) for face in faces)

    def part(self, slices: tuple[slice, ...]) -> "Weather":
        """Return the weather at the points of `slices` alone."""
        return self._of(*(plane[slices] for plane in self._planes))

    def in_cells(self, cells: Cells, factor: int) -> "Weather":
        """Return the weather at `factor` by `factor` points (N,) of each of the `cells` between points of a grid."""
        return self._of(*in_cells(self._planes, cells, factor))

    @property
    def _planes(self) -> tuple[Float32, ...]:
        return self.plain, self.cells, self.veil, self.ranges, *self.swirl

    @classmethod
    def _of(cls, plain: Float32, cells: Float32, veil: Float32, ranges: Float32, a: Float32, b: Float32) -> "Weather":
        return cls(plain=plain, cells=cells, veil=veil, ranges=ranges, swirl=(a, b))
