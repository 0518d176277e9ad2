"""The Blender meshes of a target: its own faces, and each instance's shape once for all of its places."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from spin_usd.arrays import Float
from spin_usd.renderers.blender.shape import EVERY, Faces
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.shape import Shape


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshCopy:
    """One object of a shared mesh. matrix (4, 4) from its axes around its centre to the body's around the target's,
    metres · group: of faces, 0 where nobody asks · first: how many faces are numbered before its own."""

    matrix: Float
    group: int = 0
    first: int = 0


@dataclass(frozen=True, kw_only=True, eq=False)
class SharedMesh:
    """The `chosen` faces of `shape`, metres from `centre`, and the objects that show them."""

    shape: Shape
    centre: Float
    copies: tuple[MeshCopy, ...]
    chosen: Faces = EVERY


def shared_meshes(mesh: Mesh, *, split: bool) -> Iterator[SharedMesh]:
    """Yield all of `mesh`; `split` by face groups."""
    if len(mesh.faces) and not split:
        yield SharedMesh(shape=mesh, centre=mesh.centre, copies=(MeshCopy(matrix=np.eye(4)),))
    elif len(mesh.faces):
        of_face = np.asarray(mesh.face_group)
        for group in np.unique(of_face):
            copy = MeshCopy(matrix=np.eye(4), group=int(group))
            yield SharedMesh(shape=mesh, centre=mesh.centre, copies=(copy,), chosen=np.flatnonzero(of_face == group))
    for first, each in mesh.numbered:
        used = each.shape.used_points
        centre = (used.min(0) + used.max(0)) / 2
        copies = []
        for number, (linear, group) in enumerate(zip(each.matrices[..., :3], each.groups, strict=True)):
            matrix = np.eye(4)
            matrix[:3, :3], matrix[:3, 3] = linear, each.moved(centre, number) - mesh.centre
            before = first + number * len(each.shape.faces)
            copies.append(MeshCopy(matrix=matrix, group=int(group) if split else 0, first=before))
        yield SharedMesh(shape=each.shape, centre=centre, copies=tuple(copies))
