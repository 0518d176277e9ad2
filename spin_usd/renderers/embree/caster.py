"""Embree: which triangle each ray meets first, of pixels, beams, and rays to light. It makes the labels of every run.

Embree computes in float32. Rays are given to it in body axes around the target's centre, in units of the target's
radius, and start where they enter its bounding sphere: so every number is near one, and range costs no precision.
"""

from weakref import WeakKeyDictionary

import numpy as np
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.renderers.embree.holes import first_stop
from spin_usd.renderers.embree.mesh_scene import in_target_units, mesh_scene
from spin_usd.renderers.embree.overlapping_faces import OverlappingFaces
from spin_usd.renderers.embree.rays import Float32, rays_entering, rays_in_target_units
from spin_usd.scene.derived.faces import groups_of
from spin_usd.scene.derived.lookup import is_there
from spin_usd.scene.derived.nearest import nearest, nearest_faces
from spin_usd.scene.light import Links
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.model import Scene
from spin_usd.scene.passes import Visibility
from spin_usd.scene.target import Target


class EmbreeCaster:
    """Casts rays at targets, and keeps what Embree made of each mesh for as long as the mesh is there."""

    name = "embree"

    def __init__(self) -> None:
        self._opened: WeakKeyDictionary[Mesh, EmbreeScene] = WeakKeyDictionary()
        self._overlapping: WeakKeyDictionary[Mesh, OverlappingFaces | None] = WeakKeyDictionary()

    def visibility(self, scene: Scene) -> Visibility:
        """Return the face behind every pixel centre of `scene.region`."""
        return nearest(scene, [self._visibility(one) for one in scene.apart])

    def _visibility(self, scene: Scene) -> Visibility:
        """Return the face of the scene's target alone."""
        region = scene.region
        face = np.full(region.shape, -1, np.int32)
        for band in region.bands():
            xy = scene.camera.centres(band)
            face[band.y0 - region.y0 : band.y1 - region.y0] = self._cast(scene, xy.reshape(-1, 2)).reshape(band.shape)
        return Visibility(region=region, face=face)

    def cast(self, scene: Scene, xy: Float) -> NDArray[np.int32]:
        """Return the first face (N,) that is there on the camera's rays (x, y, 1) of `xy` (N, 2), numbered as a
        Visibility's; -1 for none."""
        return nearest_faces(scene, [self._cast(one, xy) for one in scene.apart], xy)

    def meets(self, scene: Scene, xy: Float) -> NDArray[np.bool_]:
        """Return (N,) whether the camera's rays (x, y, 1) of `xy` (N, 2) meet a body that is there."""
        met = np.zeros(len(xy), bool)
        for one in scene.apart:
            met |= self._met(one.target, *rays_in_target_units(one, xy)) >= 0
        return met

    def first_faces(self, target: Target, origin: Float, directions: Float) -> NDArray[np.int32]:
        """Return the first face (N,) of the `target` that is there on the rays from `origin` (3,), body axes around the
        mesh's centre, metres, along the unit `directions` (N, 3), which may be any; -1 for none."""
        return self._first_there(target, *rays_entering(origin / target.mesh.radius, directions))

    def shadowed(
        self, target: Target, body: Float, to_light: Float, distance: Float | None = None, blockers: Links = None
    ) -> NDArray[np.bool_]:
        """Return (N,) True where the target stands between the `body` points (N, 3) and a light towards `to_light` (3,)
        or (N, 3), unit, `distance` (N,) metres away, else far. Only the face groups `blockers` block light, where
        given."""
        mesh = target.mesh
        origins = ((body - mesh.centre) / mesh.radius).astype(np.float32)
        directions = np.atleast_2d(to_light).astype(np.float32)
        max_distance = None if distance is None else (distance / mesh.radius).astype(np.float32)
        embree = self._embree(mesh)
        if not target.cut_out_key and blockers is None:
            return np.asarray(embree.run(origins, directions, dists=max_distance, query="OCCLUDED") != -1)
        blocking = mesh.groups if blockers is None else blockers
        directions = np.broadcast_to(directions, origins.shape)
        hit = first_stop(
            embree,
            origins,
            directions,
            lambda f, w: np.isin(groups_of(mesh, f), list(blocking)) & is_there(target, f, w),
            max_distance,
        )
        return np.asarray(hit != -1)

    def close(self) -> None:
        """Release what was made of the meshes."""
        self._opened.clear()
        self._overlapping.clear()

    def _cast(self, scene: Scene, xy: Float) -> NDArray[np.int32]:
        """Return the first face (N,) of the scene's target alone."""
        return self._first_there(scene.target, *rays_in_target_units(scene, xy))

    def _first_there(self, target: Target, origins: Float32, directions: Float32) -> NDArray[np.int32]:
        """Return the first face (N,) that is there on each ray, of several in one another the lowest; -1 for none."""
        face = self._met(target, origins, directions)
        overlapping = None if target.cut_out_key else self._overlaps(target.mesh)
        return overlapping.lowest(face, origins, directions) if overlapping else face

    def _met(self, target: Target, origins: Float32, directions: Float32) -> NDArray[np.int32]:
        """Return the first face (N,) that is there on each ray, of several in one another any; -1 for none."""
        embree = self._embree(target.mesh)
        if target.cut_out_key:
            return first_stop(embree, origins, directions, lambda face, weights: is_there(target, face, weights))
        return np.asarray(embree.run(origins, directions), np.int32)

    def _embree(self, mesh: Mesh) -> EmbreeScene:
        if mesh not in self._opened:
            self._opened[mesh] = mesh_scene(*in_target_units(mesh))
        return self._opened[mesh]

    def _overlaps(self, mesh: Mesh) -> OverlappingFaces | None:
        """Return the mesh's faces that lie in one another, looked for where a first face is asked for."""
        if mesh not in self._overlapping:
            self._overlapping[mesh] = OverlappingFaces.among(*in_target_units(mesh))
        return self._overlapping[mesh]
