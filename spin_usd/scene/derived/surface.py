"""The points where each pixel's own ray meets the triangle that the renderer saw there, in double precision.

A renderer only decides *which* triangle a pixel shows; this file decides *where* on it, from the camera and the mesh
alone. So no renderer's float32 enters a label, and two renderers that see the same triangle agree to the bit. Functions
of a scene and its target's faces are for each of several bodies given that body's own scene, of Scene.one_body_scenes.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spin_usd.basics.arrays import Float
from spin_usd.geometry.region import Region
from spin_usd.geometry.rotation import product
from spin_usd.geometry.transform import Transform
from spin_usd.geometry.triangles import dot, lengths, normals, unit_normals
from spin_usd.scene.derived.faces import by_body, corners_of, normals_of, parts_of
from spin_usd.scene.derived.shadows import RayCaster
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.passes import Visibility
from spin_usd.scene.scene import OneBody, Scene

GRAZING = 1e-12  # cosine below which a ray runs within its triangle's plane
TINY = np.finfo(np.float64).tiny
CHUNK = 16384  # points worked on at once: their temporaries fit a core's cache

Rows = NDArray[np.intp] | slice
"""Indices of points of a surface."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Surface:
    """The visible points of the bodies: N pixels of `region`, in row-major order."""

    scene: Scene
    region: Region
    rows: NDArray[np.intp]
    """(N,) pixel indices in the whole frame."""
    columns: NDArray[np.intp]
    """(N,) pixel indices in the whole frame."""
    xy: Float
    """(N, 2): (x, y, 1) is the pixel's ray in the camera's axes."""
    place: NDArray[np.intp]
    """(N,): which of Scene.bodies."""
    target: NDArray[np.uint16]
    """(N,): its id, 0 of an occluder."""
    face: NDArray[np.int32]
    """(N,): of its own mesh."""
    part: NDArray[np.uint16]
    """(N,) ids in labels."""
    z: Float
    """(N,) planar depth in metres."""
    body: Float
    """(N, 3) metres in its own axes."""
    alone: tuple[Visibility, ...]
    """Visibility of each of Scene.bodies as if it were alone."""
    caster: RayCaster | None = None
    """For labels that cast rays."""

    @cached_property
    def normals(self) -> Float:
        """Unit geometric normals (N, 3) in the axes of each point's own body, facing the camera."""
        found = np.empty((len(self.face), 3))
        for one, rows in self.of_bodies():
            found[rows] = geometric_normals(one, self.face[rows])
        return found

    @property
    def rays(self) -> RayCaster:
        """The caster of rays from its points."""
        assert self.caster, "the surface was made without a ray caster"
        return self.caster

    def image(self, values: NDArray[Any], dtype: type[np.generic], of: Rows = slice(None)) -> NDArray[Any]:
        """Return (H, W), or (H, W, C), of that type: the `values` (N,) or (N, C) of its points, or of those chosen by
        `of`, in their pixels of the whole frame; 0 in all others."""
        found = np.zeros((*self.scene.camera.frame.shape, *values.shape[1:]), dtype)
        found[self.rows[of], self.columns[of]] = values[of]
        return found

    def image_of(
        self,
        values: Callable[[OneBody, Rows], ArrayLike],
        channels: tuple[int, ...],
        dtype: type[np.generic],
        *,
        targets_alone: bool = False,
    ) -> NDArray[Any]:
        """Return (H, W, *channels), of that type: the results of `values`, called with the scene of one body alone and
        a few of its points (M,) at once, in the pixels of the whole frame; 0 elsewhere. `targets_alone`: without
        occluders."""
        found = np.zeros((*self.scene.camera.frame.shape, *channels), dtype)
        for one, rows in self._pieces(targets_alone=targets_alone):
            found[self.rows[rows], self.columns[rows]] = values(one, rows)
        return found

    @property
    def of_targets(self) -> Rows:
        """Which points are of a target, not of an occluder."""
        return np.flatnonzero(self.target) if self.scene.several else slice(None)

    def of_bodies(self) -> Iterator[tuple[OneBody, Rows]]:
        """Yield the scene of each body alone that is seen, and which of the points are its own."""
        if not self.scene.several:
            yield self.scene.one_body_scenes[0], slice(0, len(self.face))
            return
        for place, one in enumerate(self.scene.one_body_scenes):
            rows = np.flatnonzero(self.place == place)
            if len(rows):
                yield one, rows

    def _pieces(self, *, targets_alone: bool) -> Iterator[tuple[OneBody, Rows]]:
        """Yield the same by few points at once, whose temporaries fit a core's cache."""
        for one, rows in self.of_bodies():
            count = len(self.target[rows])
            if targets_alone and not self.target[rows][:1].any():
                continue
            for start in range(0, count, CHUNK):
                end = min(start + CHUNK, count)
                yield one, slice(start, end) if isinstance(rows, slice) else rows[start:end]


def visible_surface(scene: Scene, visibility: Visibility, caster: RayCaster | None = None) -> Surface:
    """Return the surface points behind the visible faces, each exactly on its own pixel's ray. `caster`: for labels
    that cast rays from there."""
    region = visibility.region
    width = max(region.width, 1)
    seen = np.flatnonzero(visibility.face.ravel() >= 0)
    rows, columns = np.divmod(seen, width)
    xy = scene.camera.centres(region)[rows, columns]
    face = visibility.face.ravel()[seen]
    several = scene.several
    place, face, part, z, body = (
        _points(scene, face, xy) if several else _points_of_one(scene.one_body_scenes[0], face, xy)
    )
    return Surface(
        scene=scene,
        region=region,
        rows=rows + region.y0,
        columns=columns + region.x0,
        xy=xy,
        place=place,
        target=np.array([each.id for each in scene.bodies], np.uint16)[place],
        face=face,
        part=part,
        z=z,
        body=body,
        alone=visibility.of_each_body,
        caster=caster,
    )


Points = tuple[NDArray[np.intp], NDArray[np.int32], NDArray[np.uint16], Float, Float]
"""A Surface's place, face, part, z and body."""


def _points(scene: Scene, face: NDArray[np.int32], xy: Float) -> Points:
    """Return the points on the faces (N,), numbered through all bodies, along the rays of `xy` (N, 2)."""
    place, own, part = np.empty(len(face), np.intp), np.empty(len(face), np.int32), np.empty(len(face), np.uint16)
    z, body = np.empty(len(face)), np.empty((len(face), 3))
    for of in by_body(scene, face):
        place[of.rows], own[of.rows] = of.place, of.face
        part[of.rows] = parts_of(of.alone.target.mesh, of.face) + np.uint16(scene.part_offsets[of.place])
        z[of.rows], body[of.rows] = surface_points(of.alone, of.face, xy[of.rows])
    return place, own, part, z, body


def _points_of_one(scene: OneBody, face: NDArray[np.int32], xy: Float) -> Points:
    """Return the same where the target is the only body, and nothing need be moved."""
    part = parts_of(scene.target.mesh, face) + np.uint16(scene.part_offsets[0])
    return np.zeros(len(face), np.intp), face, part, *surface_points(scene, face, xy)


def surface_points(scene: OneBody, face: NDArray[np.int32], xy: Float) -> tuple[Float, Float]:
    """Planar depth z (N,) and body point (N, 3), metres, at which the rays (x, y, 1) of `xy` (N, 2) meet the planes of
    their faces (N,).

    All arithmetic is done in camera axes around the target's centre `c`: a ray's point at depth c.z is `c.z * ray - c`
    there, which alone carries the range's rounding (2e-9 m at 10,000 km). Where a ray misses its triangle by rounding,
    or runs within its plane, depth is kept within the triangle's own.
    """
    mesh, pose = scene.target.mesh, scene.T_cam_body
    faces, which = _distinct(face, mesh.count)
    planes = _planes(mesh, faces, pose)
    centre = pose.points(mesh.centre)
    z, body = np.empty(len(face)), np.empty((len(face), 3))
    for start in range(0, len(face), CHUNK):
        chunk = slice(start, start + CHUNK)
        x, y = xy[chunk, 0], xy[chunk, 1]
        nx, ny, nz, offset, low, high = planes[:, which[chunk]]
        # The ray's point at depth c.z, and how far to go on from there, in depth, to the plane.
        wx, wy = centre[2] * x - centre[0], centre[2] * y - centre[1]
        slope = nx * x + ny * y + nz
        flat = np.abs(slope) <= GRAZING * np.sqrt(x * x + y * y + 1)
        on = (offset - nx * wx - ny * wy) / np.where(flat, 1, slope)
        on = np.clip(np.where(flat, low, on), low, high)
        z[chunk] = centre[2] + on
        body[chunk] = product(pose.rotation.T, np.stack([wx + on * x, wy + on * y, on], -1)) + mesh.centre
    return z, body


def shading_normals(scene: OneBody, face: NDArray[np.int32], body: Float, weights: Float) -> Float:
    """Unit shading normals (N, 3) in body axes of the `body` points (N, 3) on their faces (N,), whose `weights` (N, 3)
    come from `weights_at`, facing the camera."""
    corners = normals_of(scene.target.mesh, face)
    along = weights[:, :1] * corners[:, 0]
    along += weights[:, 1:2] * corners[:, 1]
    along += weights[:, 2:] * corners[:, 2]
    return _facing(scene, along, body)


def weights_at(mesh: Mesh, face: NDArray[np.int32], body: Float) -> Float:
    """Barycentric weights (N, 3) of the `body` points (N, 3) on their faces (N,): the weights that scene.derived.lookup
    takes."""
    return _barycentric(body, corners_of(mesh, face))


def geometric_normals(scene: OneBody, face: NDArray[np.int32]) -> Float:
    """Unit normals (N, 3) in body axes of the faces (N,), on the side from which the camera sees them."""
    mesh = scene.target.mesh
    faces, which = _distinct(face, mesh.count)
    corners = corners_of(mesh, faces)
    return _facing(scene, normals(corners), corners[:, 0])[which]


def _facing(scene: OneBody, along: Float, body: Float) -> Float:
    """Normals `along` (N, 3) at the points `body` (N, 3), made unit and turned towards the camera."""
    unit = along / np.maximum(lengths(along), TINY)[:, None]
    away = dot(unit, body - scene.T_cam_body.inverse().translation) > 0
    unit *= np.where(away, -1.0, 1.0)[:, None]
    return unit


def _distinct(face: NDArray[np.int32], count: int) -> tuple[NDArray[np.intp], NDArray[np.int32]]:
    """Return the distinct faces, and for each of `face` (N,) its place among them; without a sort, and in 5 bytes for
    each of the mesh's faces, which may be many millions of copies."""
    mark = np.zeros(count, bool)
    mark[face] = True
    faces = np.flatnonzero(mark)
    place = np.empty(count, np.int32)
    place[faces] = np.arange(len(faces), dtype=np.int32)
    return faces, place[face]


def _planes(mesh: Mesh, faces: NDArray[np.intp], pose: Transform) -> Float:
    """Return (6, F) in camera axes around the mesh's centre: unit normal, offset along it, least and largest depth."""
    corners = pose.directions(corners_of(mesh, faces) - mesh.centre)
    normal = unit_normals(corners)
    offset = dot(normal, corners[:, 0])
    depth = corners[..., 2]
    return np.stack([*normal.T, offset, depth.min(1), depth.max(1)])


def _barycentric(points: Float, corners: Float) -> Float:
    """Weights (N, 3) of the points (N, 3) in their triangles (N, 3, 3), clipped to the triangle and summing to 1."""
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    w = points - a
    uu, uv, vv, wu, wv = dot(u, u), dot(u, v), dot(v, v), dot(w, u), dot(w, v)
    det = np.maximum(uu * vv - uv * uv, TINY)
    beta, gamma = (vv * wu - uv * wv) / det, (uu * wv - uv * wu) / det
    weights = np.clip(np.stack([1 - beta - gamma, beta, gamma], -1), 0, 1)
    weights /= np.maximum(weights[:, 0] + weights[:, 1] + weights[:, 2], TINY)[:, None]
    return weights
