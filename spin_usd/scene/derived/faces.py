"""Attributes of a mesh's faces by their numbers: of its own faces, and of its instances', which are computed on demand.

Faces numbered through all bodies of a scene, one body after the other, are separated again. `take` needs a third of the
time of an index in brackets for many rows.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.scene.instances import Instances
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.scene import OneBody, Scene

Numbers = NDArray[np.integer]


def corners_of(mesh: Mesh, face: Numbers) -> Float:
    """Return the corners (N, 3, 3) of the faces, body axes, metres."""
    return _looked_up(mesh, face, lambda own: mesh.points.take(mesh.faces.take(own, 0), 0), Instances.corners)


def parts_of(mesh: Mesh, face: Numbers) -> NDArray[np.uint16]:
    """Return the part ids (N,) of the faces."""
    return _looked_up(
        mesh, face, lambda own: mesh.face_part[own], lambda each, place, n: each.parts[place, each.shape.face_part[n]]
    )


def materials_of(mesh: Mesh, face: Numbers) -> NDArray[np.int32]:
    """Return (N,) indices into Target.materials."""
    return _looked_up(mesh, face, lambda own: mesh.face_material[own], lambda each, _, n: each.shape.face_material[n])


def groups_of(mesh: Mesh, face: Numbers) -> NDArray[np.uint16]:
    """Return (N,) numbers that light links name."""
    own = np.asarray(mesh.face_group)
    return _looked_up(mesh, face, lambda n: own[n], lambda each, place, _: each.groups[place])


def normals_of(mesh: Mesh, face: Numbers) -> NDArray[np.float32]:
    """Return (N, 3, 3) unit shading normals at the corners, body axes."""
    return _looked_up(mesh, face, lambda own: mesh.corner_normals.take(own, 0), Instances.normals)


def primvar_of(mesh: Mesh, name: str, face: Numbers) -> NDArray[np.float32]:
    """Return (N, 3, C) values at the corners of the primvar `name` of some shape; 0 on shapes without it."""
    channels = next(shape.primvars[name].shape[2] for shape in mesh.shapes if name in shape.primvars)
    nothing = np.zeros((1, 3, channels), np.float32)

    def own(n: Numbers) -> NDArray[np.float32]:
        return mesh.primvars[name].take(n, 0) if name in mesh.primvars else nothing

    def values(each: Instances, place: Numbers, n: Numbers) -> NDArray[np.float32]:
        return each.in_place_order(place, each.shape.primvars[name][n]) if name in each.shape.primvars else nothing

    return _looked_up(mesh, face, own, values)


def _looked_up(
    mesh: Mesh,
    face: Numbers,
    own: Callable[[Numbers], NDArray[Any]],
    instanced: Callable[[Instances, Numbers, Numbers], NDArray[Any]],
) -> NDArray[Any]:
    """Return (N, ...) the values that `own` gives for the mesh's own faces, and `instanced` of those in places (M,) of
    instances."""
    if not mesh.instances:
        return own(face)
    first = np.array([0, *(number for number, _ in mesh.numbered)])
    which = np.searchsorted(first, face, side="right") - 1
    rows = [np.flatnonzero(which == each) for each in range(len(first))]
    found = [own(face[rows[0]])]
    for of, (number, each) in zip(rows[1:], mesh.numbered, strict=True):
        found.append(instanced(each, *np.divmod(face[of] - number, len(each.shape.faces))))
    result = np.empty((len(face), *found[0].shape[1:]), found[0].dtype)
    for of, values in zip(rows, found, strict=True):
        result[of] = values
    return result


@dataclass(frozen=True, kw_only=True, eq=False)
class BodyFaces:
    """The faces of one body among some faces."""

    place: int
    """Of the body in Scene.bodies."""
    alone: OneBody
    """The scene with it alone."""
    rows: NDArray[np.intp]
    """(N,): where the faces are among all."""
    face: NDArray[np.int32]
    """(N,): their numbers in its own mesh."""


def by_body(scene: Scene, face: NDArray[np.int32]) -> Iterator[BodyFaces]:
    """Yield for each body that has some its faces among `face` (N,), numbered through all bodies, -1 for none."""
    first = 0
    for place, one in enumerate(scene.one_body_scenes):
        count = one.target.mesh.count
        rows = np.flatnonzero((face >= first) & (face < first + count) if scene.several else face >= 0)
        if len(rows):
            yield BodyFaces(place=place, alone=one, rows=rows, face=face[rows] - np.int32(first))
        first += count
