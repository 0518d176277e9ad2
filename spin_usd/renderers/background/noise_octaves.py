"""Noise on a sphere, octave by octave, none finer than its pixels, and each no denser than its waves need.

One tile that repeats is laid over the six faces of a cube around the sphere again for each octave, turned and shifted
anew, so that no repeat shows.
"""

from collections.abc import Sequence

import numpy as np

from spin_usd.arrays import Float
from spin_usd.renderers.background.elementary import Float32
from spin_usd.renderers.background.enlarge import enlarged
from spin_usd.renderers.background.noise_faces import Face
from spin_usd.renderers.background.noise_tile import MEAN_WAVE, TILE, sampled

TURNS = ((0.8, 0.6), (0.28, 0.96), (-0.6, 0.8), (0.96, -0.28), (0.0, 1.0), (-0.8, -0.6), (0.6, -0.8))
"""Cosine and sine of the angle by which the tile is turned, one octave after the other."""
UNSEEN = 0.15  # of its amplitude, which is not missed


def octave(faces: Sequence[Face], wave: float, number: int, stretch: float = 1.0, finer: int = 1) -> Float32:
    """Return noise of variance 1, by waves of about `wave` radians, at the points of `faces`; of those of a grid (R, C)
    also at `finer` - 1 between each and the next. `number` chooses how the tile lies; the waves are `stretch` times as
    long along its columns."""
    total = None
    for face in faces:
        u, v = _on_tile(face, wave, number, stretch)
        if finer > 1:
            u, v = enlarged([u, v], finer)
        own = sampled(u, v)
        if face.share is not None:
            own *= enlarged([face.share], finer)[0]
        total = own if total is None else total + own
    return np.zeros(1, np.float32) if total is None else total


def resolved(footprint: Float32, wave: float) -> Float32:
    """Return the share of the amplitude of waves of about `wave` that pixels of `footprint`, radians, resolve: a half
    of waves of six pixels, nothing of waves of three."""
    ratio = footprint * np.float32(5.5 / wave)
    ratio *= ratio
    share = np.float32(1 + UNSEEN) / (1 + ratio * ratio) - np.float32(UNSEEN)
    return np.asarray(np.maximum(share, 0), np.float32)


def _on_tile(face: Face, wave: float, number: int, stretch: float) -> tuple[Float32, Float32]:
    """Return columns and rows on the tile, at least 0, of the points of `face`."""
    cosine, sine = TURNS[number % len(TURNS)]
    scale = MEAN_WAVE / wave
    shift = 37.0 * number + 101.0 * face.number
    u = (face.a * cosine - face.b * sine) * (scale / stretch) + shift
    v = (face.a * sine + face.b * cosine) * scale + 1.7 * shift
    return _positive(u), _positive(v)


def _positive(w: Float) -> Float32:
    return np.asarray(w - np.floor(w.min() * (1 / TILE)) * TILE, np.float32)
