"""Hits of the beams of a scene's LiDAR or laser range finder: the first triangle on each, and the exact range to it in
double precision.

As for pixel labels, a ray caster only finds *which* triangle a beam hits; this file computes *where*. Everything is
computed in body axes around the body's centre, where only the LiDAR's own position carries the range's rounding.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.errors import GeometryError
from spin_usd.geometry.transform import Transform
from spin_usd.geometry.triangles import unit_normals
from spin_usd.scene.body import Body
from spin_usd.scene.derived.faces import corners_of, parts_of
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.scene import Scene
from spin_usd.scene.target import Target

GRAZING = 1e-12  # cosine below which a beam runs within its triangle's plane
MARGIN = 1.001  # of the bounding sphere's radius: beams that pass further from its centre meet nothing

FirstFaces = Callable[[Target, Float, Float], NDArray[np.int32]]
"""Of a target, the place (3,) where rays start, in body axes around its mesh's centre, metres, and their unit
directions (N, 3): the first opaque face (N,) on each; -1 for none."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Echoes:
    """The beams that meet a surface, N of them."""

    beam: NDArray[np.intp]
    """(N,): their numbers."""
    range: Float
    """(N,) exact, metres."""
    cosine: Float
    """(N,): cosine of the angle to the surface's normal."""
    part: NDArray[np.uint16]
    """(N,) ids."""
    target: NDArray[np.uint16]
    """(N,) ids."""


def echoes(scene: Scene, first_faces: FirstFaces) -> Echoes:
    """Return the first hits of the beams of the scene's LiDAR, at any range. Raises GeometryError without a LiDAR."""
    if scene.lidar is None:
        raise GeometryError("the scene has no LiDAR")
    return _first_echoes(scene, scene.lidar.T_cam_lidar, scene.lidar.directions, first_faces)


@dataclass(frozen=True, kw_only=True)
class LaserRange:
    """Hit of a laser range finder."""

    boresight: float | None
    """The range along its axis, metres; None where nothing is."""
    target: int
    """Id of the target hit, 0 for none."""
    nearest: float | None
    """Least range within its cone, metres; None without a hit."""
    mean: float | None
    """The mean range, likewise."""
    share: float
    """Of the cone, how much meets something."""


def laser_range(scene: Scene, first_faces: FirstFaces) -> LaserRange:
    """Return the hit of the scene's laser range finder. Raises GeometryError without one."""
    if scene.range_finder is None:
        raise GeometryError("the scene has no laser range finder")
    directions = scene.range_finder.directions
    met = _first_echoes(scene, scene.range_finder.T_cam_finder, directions, first_faces)
    on_axis, cone = met.beam == 0, met.range[met.beam > 0]
    return LaserRange(
        boresight=float(met.range[on_axis][0]) if on_axis.any() else None,
        target=int(met.target[on_axis][0]) if on_axis.any() else 0,
        nearest=float(met.range.min()) if len(met.range) else None,
        mean=float(cone.mean()) if len(cone) else None,
        share=len(cone) / (len(directions) - 1),
    )


def _first_echoes(scene: Scene, T_cam_beams: Transform, directions: Float, first_faces: FirstFaces) -> Echoes:
    """Return the first hits of beams along the `directions` (B, 3), in axes at that pose in the camera's."""
    each = zip(scene.bodies, scene.part_offsets, strict=True)
    found = [_echoes(T_cam_beams, directions, body, before, first_faces) for body, before in each]
    every = {name: np.concatenate([getattr(each, name) for each in found]) for name in Echoes.__annotations__}
    nearest = np.lexsort([every["range"], every["beam"]])
    beam = every["beam"][nearest]
    first = nearest[np.flatnonzero(np.diff(beam, prepend=-1))]
    return Echoes(**{name: values[first] for name, values in every.items()})


def _echoes(T_cam_beams: Transform, directions: Float, body: Body, part_offset: int, first_faces: FirstFaces) -> Echoes:
    """Return the beams' hits on the body alone; its part ids are its mesh's plus that offset."""
    mesh = body.target.mesh
    T_body_beams = body.T_cam_body.inverse() @ T_cam_beams
    origin = T_body_beams.translation - mesh.centre
    near = _near(directions, T_body_beams.rotation.T @ -origin, MARGIN * mesh.radius)
    towards = T_body_beams.directions(directions[near])
    face = first_faces(body.target, origin, towards)
    hit = np.flatnonzero(face >= 0)
    face, towards = face[hit], towards[hit]
    ranges, cosine = _meet(mesh, face, origin, towards)
    part = parts_of(mesh, face)
    return Echoes(
        beam=near[hit],
        range=ranges,
        cosine=cosine,
        part=part + part.dtype.type(part_offset),
        target=np.full(len(hit), body.id, np.uint16),
    )


def _near(directions: Float, centre: Float, radius: float) -> NDArray[np.intp]:
    """Return the numbers of the rays from the origin along `directions` (B, 3) that come as near as `radius` to the
    `centre` (3,)."""
    along = np.maximum(directions @ centre, 0)
    return np.flatnonzero(centre @ centre - along * along <= radius * radius)


def _meet(mesh: Mesh, face: NDArray[np.int32], origin: Float, towards: Float) -> tuple[Float, Float]:
    """Return how far the rays `towards` (N, 3) from `origin` (3,), body axes around the mesh's centre, go to the planes
    of their faces (N,), and the cosines (N,) of their angles to the normals.

    Where a ray misses its triangle by rounding, or runs within its plane, it ends within the triangle's own ranges.
    """
    corners = corners_of(mesh, face) - mesh.centre - origin
    normal = unit_normals(corners)
    slope = (normal * towards).sum(1)
    flat = np.abs(slope) <= GRAZING
    ends = (corners * towards[:, None]).sum(2)
    to_plane = (normal * corners[:, 0]).sum(1) / np.where(flat, 1, slope)
    low, high = ends.min(1), ends.max(1)
    return np.clip(np.where(flat, low, to_plane), low, high), np.abs(slope)
