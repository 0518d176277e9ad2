"""The nearest of several bodies: on each ray the visible face among the faces that each body would show alone.

Exact depths in double precision decide which is nearer: the same for all renderers and at any range.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.scene.derived.surface import surface_points
from spin_usd.scene.passes import Visibility
from spin_usd.scene.scene import Scene


def nearest_faces(scene: Scene, alone: Sequence[NDArray[np.int32]], xy: Float) -> NDArray[np.int32]:
    """Return (N,) the faces seen along the rays (x, y, 1) of `xy` (N, 2), numbered through all bodies, -1 for none.
    alone: the face (N,) of each of `scene.one_body_scenes`. Of faces at the same depth the first body's is seen."""
    if len(alone) == 1:
        return alone[0]
    seen, depth, first = np.full(len(xy), -1, np.int32), np.full(len(xy), np.inf), 0
    for one, face in zip(scene.one_body_scenes, alone, strict=True):
        rows = np.flatnonzero(face >= 0)
        z, _ = surface_points(one, face[rows], xy[rows])
        nearer = z < depth[rows]
        seen[rows[nearer]], depth[rows[nearer]] = face[rows[nearer]] + np.int32(first), z[nearer]
        first += one.target.mesh.count
    return seen


def nearest(scene: Scene, alone: Sequence[Visibility]) -> Visibility:
    """Return the visibility of all bodies, from the visibility of each of `scene.one_body_scenes`."""
    if len(alone) == 1:
        return alone[0]
    region = scene.region
    faces = np.full((len(alone), *region.shape), -1, np.int32)
    for face, own in zip(faces, alone, strict=True):
        top, left = own.region.y0 - region.y0, own.region.x0 - region.x0
        face[top : top + own.region.height, left : left + own.region.width] = own.face
    rows, columns = np.nonzero((faces >= 0).any(0))
    face = np.full(region.shape, -1, np.int32)
    xy = scene.camera.centres(region)[rows, columns]
    face[rows, columns] = nearest_faces(scene, [own[rows, columns] for own in faces], xy)
    return Visibility(region=region, face=face, bodies=tuple(alone))
