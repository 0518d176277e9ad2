"""A craft as a model that can be written as USD: one mesh a part, with labels, keypoints, hinges and symmetries."""

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.craft.craft import KINDS, CraftPart, GeneratedCraft
from spin_usd.craft.solids import DECIMALS, Solid
from spin_usd.geometry.box_projection import Polygons, projected
from spin_usd.geometry.rotation import quaternion_from_matrix
from spin_usd.scene.asset import Hinge, MeshAsset, MeshPart, ModelMaterial
from spin_usd.scene.keypoints import Keypoints
from spin_usd.scene.material import Material

CREASE_DEG = 50.0  # faces that meet at less stand for one curved surface
COMPONENT = "component"
"""The taxonomy of our own classes, which are finer."""


def model_of(craft: GeneratedCraft) -> MeshAsset:
    """Return the craft's model; its materials have the names of the library's."""
    names = sorted({each for part in craft.parts for solid in part.solids for each in solid.materials})
    points = craft.keypoints
    return MeshAsset(
        name=craft.name,
        parts=tuple(_mesh(part, names) for part in craft.parts),
        materials=tuple(ModelMaterial(constants=Material(path=name)) for name in names),
        keypoints=Keypoints(names=tuple(points), points=np.array(list(points.values()))),
        hinges=tuple(
            Hinge(part=each.name, axis=each.joint.axis, at=each.joint.at) for each in craft.parts if each.joint
        ),
        symmetries=tuple(quaternion_from_matrix(each) for each in craft.symmetries),
        up="z",
    )


def _mesh(part: CraftPart, names: list[str]) -> MeshPart:
    faces = [face for solid, start in _starts(part) for face in (np.add(each, start).tolist() for each in solid.faces)]
    counts = np.array([len(face) for face in faces], np.int32)
    indices = np.array([corner for face in faces for corner in face], np.int32)
    materials = [names.index(each) for solid in part.solids for each in solid.materials]
    st = projected(Polygons(points=part.points, counts=counts.astype(np.int64), indices=indices.astype(np.int64)))
    return MeshPart(
        name=part.name,
        points=part.points,
        face_counts=counts,
        face_indices=indices,
        normals=np.concatenate([_normals(solid) for solid in part.solids]),
        face_material=np.array(materials, np.int32),
        primvars={"st": np.round(st, DECIMALS) + 0.0},
        labels={"class": KINDS[part.kind], COMPONENT: part.kind},
    )


def _starts(part: CraftPart) -> list[tuple[Solid, int]]:
    sizes = [len(solid.points) for solid in part.solids]
    return list(zip(part.solids, np.cumsum([0, *sizes[:-1]]).tolist(), strict=True))


def _normals(solid: Solid) -> Float:
    """Return the normals of the corners (C, 3): of a curved surface the mean of faces that meet there smoothly."""
    points = np.round(solid.points, DECIMALS)
    of_faces = np.array([_normal(points[list(face)]) for face in solid.faces])
    lengths = np.array([len(face) for face in solid.faces])
    face_of = np.repeat(np.arange(len(lengths)), lengths)
    units = of_faces / np.linalg.norm(of_faces, axis=1, keepdims=True)
    if not solid.smooth:
        return np.asarray(np.round(units[face_of], DECIMALS) + 0.0)
    corner, other = _meetings(np.array([each for face in solid.faces for each in face]))
    near = (units[face_of[corner]] * units[face_of[other]]).sum(1) > np.cos(np.radians(CREASE_DEG))
    sums = np.zeros((len(face_of), 3))
    np.add.at(sums, corner[near], of_faces[face_of[other[near]]])
    return np.asarray(np.round(sums / np.linalg.norm(sums, axis=1, keepdims=True), DECIMALS) + 0.0)


def _normal(corners: Float) -> Float:
    """Return twice the area vector of a polygon."""
    from_first = corners[1:] - corners[0]
    return np.asarray(np.cross(from_first[:-1], from_first[1:]).sum(axis=0))


def _meetings(vertex_of: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return all pairs of corners that share a vertex."""
    order = np.argsort(vertex_of, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(vertex_of[order])) + 1)
    pairs = [np.stack(np.meshgrid(group, group, indexing="ij"), -1).reshape(-1, 2) for group in groups]
    joined = np.concatenate(pairs)
    return joined[:, 0], joined[:, 1]
