"""Meshes as Embree is given them: around the target's centre, in units of the target's radius, as rays are."""

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from spin_usd.renderers.embree.rays import Float32
from spin_usd.scene.mesh import Mesh

Faces = NDArray[np.int32]


def in_target_units(mesh: Mesh) -> tuple[Float32, Faces]:
    """Return points (P, 3) and faces (F, 3) of all of `mesh`.

    Embree's binding places nothing twice, so instances are made out for it, in its own 70 bytes a face.
    """
    points, faces, first = [], [], 0
    for placed, indices in mesh.placed:
        points.append(((placed - mesh.centre) / mesh.radius).astype(np.float32))
        faces.append(indices + np.int32(first))
        first += len(placed)
    return np.concatenate(points), np.concatenate(faces)


def mesh_scene(points: Float32, faces: Faces) -> EmbreeScene:
    """Return Embree's scene of the triangles `faces` (F, 3) between `points` (P, 3)."""
    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, points, faces)
    return scene
