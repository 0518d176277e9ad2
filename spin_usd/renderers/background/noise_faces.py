"""Points of a sphere as the faces of a cube around it have them, on each of which noise lies flat.

Where faces meet, one fades into the other.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from spin_usd.arrays import Float
from spin_usd.renderers.background.elementary import Float32, arctan

FADE = 0.06  # of a direction's largest component: within it two faces overlap


@dataclass(frozen=True, kw_only=True, eq=False)
class Face:
    """Points as a face of the cube has them: a and b, radians from its middle; share: the part it has in the noise;
    ways: for each of some directions, how far they move in a and in b along the sphere, per radian."""

    number: int
    a: Float
    b: Float
    share: Float32 | None
    ways: tuple[tuple[Float, Float], ...] = ()

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
