"""Faces numbered through all bodies of a scene, one body after the other, taken apart again."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spin_usd.scene.model import Scene


@dataclass(frozen=True, kw_only=True, eq=False)
class BodyFaces:
    """Those of some faces that are one body's. place: of the body in Scene.bodies · alone: the scene with it alone ·
    rows (N,): where they are among all · face (N,): their numbers in its own mesh."""

    place: int
    alone: Scene
    rows: NDArray[np.intp]
    face: NDArray[np.int32]


def by_body(scene: Scene, face: NDArray[np.int32]) -> Iterator[BodyFaces]:
    """Yield for each body that has some its faces among `face` (N,), numbered through all bodies, -1 for none."""
    first = 0
    for place, one in enumerate(scene.one_body_scenes):
        count = one.target.mesh.count
        rows = np.flatnonzero((face >= first) & (face < first + count) if scene.several else face >= 0)
        if len(rows):
            yield BodyFaces(place=place, alone=one, rows=rows, face=face[rows] - np.int32(first))
        first += count
