"""Points of a grid, and interpolation between them: each octave of noise at as few points as its waves need."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from spin_usd.renderers.background.elementary import Float32
from spin_usd.renderers.background.enlarge import enlarged
from spin_usd.renderers.background.noise_octaves import resolved
from spin_usd.renderers.background.planet_points import Points

RATIO = 2.03  # of the wavelengths of neighbouring octaves
MAX_OCTAVES = 16
STEPS = 8  # points in a wave, at least, between which it is interpolated


@dataclass(frozen=True, kw_only=True, eq=False)
class Octave:
    """Noise by waves of about `wave` radians."""

    number: int
    """0 for the coarsest."""
    wave: float
    amplitude: Float32
    """Amplitude at the nodes, as far as pixels resolve it, for a variance of 1 of all octaves."""
    stride: int
    """Pixels from one to the next of the points that it needs."""


@dataclass(frozen=True, kw_only=True, eq=False)
class NodeGrid:
    """Points of a grid (R, C), `spacing` pixels from one to the next. Of a spacing of 1 they are pixels, and may have
    any shape."""

    points: Points
    spacing: int

    def enlarged(self, values: Sequence[Float32], to: int = 1) -> list[Float32]:
        """Return `values` at the nodes interpolated at points that are `to` pixels from one another."""
        return enlarged(values, self.spacing // to)

    def stride(self, length: float) -> int:
        """Return the pixels between points that are `length` apart at most, radians; 1 where pixels are wider."""
        stride = self.spacing
        while stride > 1 and stride * float(self.points.meeting.footprint.max()) > length:
            stride //= 2
        return stride

    def octaves(self, coarsest: float, gain: float, finest: float = 0.0) -> Iterator[Octave]:
        """Yield the octaves that pixels resolve, from waves of `coarsest` to `finest` radians, each `gain` times as
        high as the one before."""
        for number in range(MAX_OCTAVES):
            wave = coarsest / RATIO**number
            seen = resolved(self.points.meeting.footprint, wave)
            if wave < finest or not seen.any():
                return
            share = (1 - gain**2) * gain ** (2 * number)
            amplitude = seen * np.float32(np.sqrt(share))
            yield Octave(number=number, wave=wave, amplitude=amplitude, stride=self.stride(wave / STEPS))
