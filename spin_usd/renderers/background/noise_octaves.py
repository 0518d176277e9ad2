"""Noise on a sphere, octave by octave, none finer than its pixels, and each no denser than its waves need.

One tile that repeats is laid over the six faces of a cube around the sphere again for each octave, turned and shifted
anew, so that no repeat shows.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.renderers.background.elementary import TURN, Float32, arctan, cosines
from spin_usd.renderers.background.enlarge import blended, enlarged

TURNS = ((0.8, 0.6), (0.28, 0.96), (-0.6, 0.8), (0.96, -0.28), (0.0, 1.0), (-0.8, -0.6), (0.6, -0.8))
"""Cosine and sine of the angle by which the tile is turned, one octave after the other."""
UNSEEN = 0.15  # of its amplitude, which is not missed

FADE = 0.06  # of a direction's largest component: within it two faces overlap

TILE = TURN  # texels
MEAN_WAVE = 8.0  # texels
WAVES = 360  # that the tile is made of
LEAST_CYCLES, MOST_CYCLES = 24, 44  # of each, over the tile
SPREAD = 1.0199618  # of a tile of these waves, in place of 1: a sum of them would differ between processors


@dataclass(frozen=True, kw_only=True, eq=False)
class Face:
    """Points of a sphere as one face of the cube around it has them, on which noise lies flat.

    Where faces meet, one fades into the other.
    """

    number: int
    a: Float
    """Radians from the middle of the face."""
    b: Float
    """Radians from the middle of the face."""
    share: Float32 | None
    """The part that the face has in the noise."""
    ways: tuple[tuple[Float, Float], ...] = ()
    """For each of some directions, how far the points move in a and in b along the sphere, per radian."""

    def part(self, slices: tuple[slice, ...]) -> "Face":
        """Return the face's points at `slices` alone."""
        share = None if self.share is None else self.share[slices]
        ways = tuple((a[slices], b[slices]) for a, b in self.ways)
        return replace(self, a=self.a[slices], b=self.b[slices], share=share, ways=ways)

    def moved(self, way: int, step: float) -> "Face":
        """Return the points moved by `step`, radians, in the direction of that number."""
        a, b = self.ways[way]
        return replace(self, a=self.a + a * step, b=self.b + b * step)


def faces_of(normal: Sequence[Float], ways: Sequence[Sequence[Float]] = ()) -> list[Face]:
    """Return the faces on which the unit vectors x, y, z lie; `ways`: unit vectors across them."""
    size = [np.abs(n) for n in normal]
    most = np.maximum(np.maximum(size[0], size[1]), size[2])
    shares = [np.clip((s / most - (1 - FADE)) / FADE, 0, 1) for s in size]
    scale = 1 / np.sqrt(shares[0] * shares[0] + shares[1] * shares[1] + shares[2] * shares[2])
    found = []
    for axis in range(3):
        for sign in (1, -1):
            there = (shares[axis] > 0) & (normal[axis] * sign > 0)
            if there.any():
                depth = np.maximum(size[axis], 0.3)
                a, b = (arctan(np.clip(normal[(axis + i) % 3] / depth, -2, 2)) for i in (1, 2))
                share = None if there.all() and (scale == 1).all() else (np.where(there, shares[axis] * scale, 0))
                share = None if share is None else share.astype(np.float32)
                turned = tuple((_turned(normal, way, axis, 1), _turned(normal, way, axis, 2)) for way in ways)
                found.append(Face(number=2 * axis + (sign < 0), a=a, b=b, share=share, ways=turned))
    return found


def _turned(normal: Sequence[Float], way: Sequence[Float], axis: int, i: int) -> Float:
    """Return how fast the arctangent of the ratio of another component to that of the axis grows along `way`; the
    latter's sign is left out, as a face's a and b leave it out."""
    deep, wide, other = normal[axis], normal[(axis + i) % 3], (axis + i) % 3
    size = np.maximum(deep * deep + wide * wide, 0.1)
    return np.asarray((way[other] * deep - wide * way[axis]) * np.sign(deep) / size)


def present(faces: Sequence[Face], slices: tuple[slice, ...]) -> list[Face]:
    """Return the faces that have a share in the points at `slices`, as they have them."""
    return [face.part(slices) for face in faces if face.share is None or face.share[slices].any()]


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


@lru_cache(maxsize=1)
def tile() -> Float32:
    """Return (TILE + 1, TILE + 1): repeats; mean 0, variance 1, normally distributed."""
    wave = cosines().astype(np.float32)
    steps, total = np.arange(TILE), np.zeros((TILE, TILE), np.float32)
    for across, down, phase in _waves():
        a, b = (steps * across + phase) % TURN, steps * down % TURN
        quarter = TURN // 4
        total += wave[b][:, None] * wave[a] - wave[b - quarter][:, None] * wave[a - quarter]
    total *= np.float32((2 / WAVES) ** 0.5 / SPREAD)
    return np.pad(total, (0, 1), mode="wrap")


def _waves() -> list[tuple[int, int, int]]:
    """Return cycles across and down, and phase, of each wave: by a generator of whole numbers of 64 bits (Knuth's
    MMIX)."""
    state, found = 20, list[tuple[int, int, int]]()
    while len(found) < WAVES:
        numbers = []
        for _ in range(3):
            state = (state * 6364136223846793005 + 1442695040888963407) % 2**64
            numbers.append(state >> 40)
        across, down = numbers[0] % (MOST_CYCLES + 1), numbers[1] % (2 * MOST_CYCLES + 1) - MOST_CYCLES
        if LEAST_CYCLES**2 <= across * across + down * down <= MOST_CYCLES**2:
            found.append((across, down, numbers[2] % TURN))
    return found


def sampled(u: Float32, v: Float32) -> Float32:
    """Return the tile bilinearly at columns and rows from 0 up, wherever they repeat."""
    table = tile().ravel()
    column, row = u.astype(np.int32), v.astype(np.int32)
    fx, fy = u - column.astype(np.float32), v - row.astype(np.float32)
    column &= TILE - 1
    row &= TILE - 1
    row *= TILE + 1
    row += column
    return blended(table, TILE + 1, row.astype(np.intp), fx, fy)
