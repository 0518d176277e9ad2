"""Faces that lie in one another: of two, Embree's kernels for some processors see the one, those for others the other.

So that labels have the same bytes on all processors, the one with the lowest number is seen.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from spin_usd.renderers.embree.mesh_scene import Faces, mesh_scene
from spin_usd.renderers.embree.overlaps import Pairs, overlapping
from spin_usd.renderers.embree.rays import Float32

MAX_FACES = 1 << 20  # of a mesh: with more, instances made out, it takes too long to look
MAX_LAYERS = 16  # each is a scene of Embree's, and a process that opens a thousand crashes


@dataclass(frozen=True, kw_only=True, eq=False)
class OverlappingFaces:
    """The faces of a mesh that overlap others, in layers: none overlaps another of its layer, and of faces that lie in
    one another the lowest number is in the lowest layer. The highest layer has all that are above MAX_LAYERS others,
    and may overlap itself.

    layer (F,): of each face; -1 of one that overlaps none · scenes, numbers: of each layer but the highest Embree's
    scene, and the numbers of its faces · pairs (P,), sorted: of two that overlap the higher times F, plus the lower.
    """

    layer: NDArray[np.int32]
    scenes: Sequence[EmbreeScene]
    numbers: Sequence[NDArray[np.int32]]
    pairs: NDArray[np.int64]

    @classmethod
    def among(cls, points: Float32, faces: Faces) -> "OverlappingFaces | None":
        """Return those of the mesh with these points (P, 3) and faces (F, 3); None where there are none, or too many
        faces to look."""
        found = overlapping(points[faces].astype(np.float64)) if len(faces) <= MAX_FACES else np.zeros((0, 2), np.intp)
        if not len(found):
            return None
        layer = _layers(found, len(faces))
        numbers = [np.flatnonzero(layer == each).astype(np.int32) for each in range(layer.max())]
        scenes = [mesh_scene(points, faces[own]) for own in numbers]
        pairs = np.unique(found[:, 1] * np.int64(len(faces)) + found[:, 0])
        return cls(layer=layer, scenes=scenes, numbers=numbers, pairs=pairs)

    def lowest(self, face: NDArray[np.int32], origins: Float32, directions: Float32) -> NDArray[np.int32]:
        """Return (N,) the lowest of the faces that lie where each ray meets its first one, `face` (N,), -1 for none."""
        found, rays = face.copy(), np.flatnonzero((face >= 0) & (self.layer[face] > 0))
        for place, (scene, numbers) in enumerate(zip(self.scenes, self.numbers, strict=True)):
            rays = rays[self.layer[found[rays]] > place]
            if not len(rays):
                break
            hit = np.asarray(scene.run(origins[rays], directions[rays]), np.int32)
            lower, higher = numbers[np.maximum(hit, 0)], found[rays]
            same = (hit >= 0) & self._overlap(lower, higher)
            found[rays[same]] = lower[same]
        return found

    def _overlap(self, lower: NDArray[np.int32], higher: NDArray[np.int32]) -> NDArray[np.bool_]:
        wanted = higher * np.int64(len(self.layer)) + lower
        at = np.minimum(np.searchsorted(self.pairs, wanted), len(self.pairs) - 1)
        return np.asarray(self.pairs[at] == wanted)


def _layers(pairs: Pairs, count: int) -> NDArray[np.int32]:
    """Return (count,) the layer of each face: one above all lower ones that it overlaps, up to MAX_LAYERS; -1 where
    there are none."""
    layer = np.full(count, -1, np.int32)
    layer[pairs] = 0
    for _ in range(MAX_LAYERS):
        before = layer.copy()
        np.maximum.at(layer, pairs[:, 1], layer[pairs[:, 0]] + 1)
        if np.array_equal(layer, before):
            break
    return layer
