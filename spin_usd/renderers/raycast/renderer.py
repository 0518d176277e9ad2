"""The ray casting renderer: Embree decides which triangle each ray meets first, with no light transport.

Embree computes in float32. Rays are given to it in body axes around the target's centre, in units of the target's
radius, and start where they enter its bounding sphere: so every number is near one, and range costs no precision.
"""

from collections.abc import Callable
from importlib.metadata import version
from weakref import WeakKeyDictionary

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.renderers.raycast import lambert
from spin_usd.scene.derived.faces import groups_of
from spin_usd.scene.derived.light_groups import LightGroups
from spin_usd.scene.derived.lookup import is_there
from spin_usd.scene.derived.nearest import nearest, nearest_faces
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import Links
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.model import Scene
from spin_usd.scene.passes import Radiance, Visibility
from spin_usd.scene.target import Target

Float32 = NDArray[np.float32]

BEHIND = 5e-7  # of the target's radius: how far behind a hole a ray goes on; float32 is good to 1e-7 there
FAR = 1e30  # a ray's length without an end
MARGIN = 1.001  # of the bounding sphere's radius: rays start a little outside


class RaycastRenderer:
    """Exact visibility, and a preview picture: Lambert's law with hard shadows (see render.lambert)."""

    name = "raycast"

    def __init__(self) -> None:
        self._opened: WeakKeyDictionary[Mesh, EmbreeScene] = WeakKeyDictionary()

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

    def radiance(self, scene: Scene, effort: Effort, *, seed: int) -> Radiance:
        """Return the preview: `effort.samples` rays spread over each pixel's square, one through its centre when it is
        1. It ignores thin lens and shutter: it is sharp."""
        region, samples = scene.picture_region, effort.samples
        picture = Radiance.dark(region, groups=LightGroups.of(scene).count)
        rng = np.random.default_rng(seed)
        for band in region.bands():
            rows = slice(band.y0 - region.y0, band.y1 - region.y0)
            groups, coverage = np.zeros((len(picture.groups), band.width * band.height, 3)), np.zeros(band.shape)
            for uv in lambert.sample_positions(band, samples, rng):
                light, there = lambert.radiance(scene, self, scene.camera.normalised(uv))
                groups += light
                coverage += there.reshape(band.shape)
            picture.groups[:, rows] = (groups / samples).reshape(len(groups), *band.shape, 3)
            picture.coverage[rows] = coverage / samples
        return picture

    def cast(self, scene: Scene, xy: Float) -> NDArray[np.int32]:
        """Return the first face (N,) that is there on the camera's rays (x, y, 1) of `xy` (N, 2), numbered as a
        Visibility's; -1 for none."""
        return nearest_faces(scene, [self._cast(one, xy) for one in scene.apart], xy)

    def first_faces(self, target: Target, origin: Float, directions: Float) -> NDArray[np.int32]:
        """Return the first face (N,) of the `target` that is there on the rays from `origin` (3,), body axes around the
        mesh's centre, metres, along the unit `directions` (N, 3), which may be any; -1 for none."""
        return self._first_there(target, *_rays_entering(origin / target.mesh.radius, directions))

    def _cast(self, scene: Scene, xy: Float) -> NDArray[np.int32]:
        """Return the first face (N,) of the scene's target alone."""
        return self._first_there(scene.target, *_rays_in_target_units(scene, xy))

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
        hit = _first(
            embree,
            origins,
            directions,
            lambda f, w: np.isin(groups_of(mesh, f), list(blocking)) & is_there(target, f, w),
            max_distance,
        )
        return np.asarray(hit != -1)

    def versions(self) -> dict[str, str]:
        return {"embreex": version("embreex"), "numpy": np.__version__}

    def close(self) -> None:
        self._opened.clear()

    def _first_there(self, target: Target, origins: Float32, directions: Float32) -> NDArray[np.int32]:
        embree = self._embree(target.mesh)
        if not target.cut_out_key:
            return np.asarray(embree.run(origins, directions), np.int32)
        return _first(embree, origins, directions, lambda face, weights: is_there(target, face, weights))

    def _embree(self, mesh: Mesh) -> EmbreeScene:
        if mesh not in self._opened:
            scene = EmbreeScene(robust=True)
            TriangleMesh(scene, *_in_target_units(mesh))
            self._opened[mesh] = scene
        return self._opened[mesh]


def _first(
    embree: EmbreeScene,
    origins: Float32,
    directions: Float32,
    stops: Callable[[NDArray[np.int32], Float], NDArray[np.bool_]],
    max_distance: Float32 | None = None,
) -> NDArray[np.int32]:
    """Return the first face (N,) of each ray, within its `max_distance`, that stops it; -1 for none. A ray goes on from
    behind those that do not; one that meets the same face again has only been rounded before it, and goes a longer
    step."""
    face = np.full(len(origins), -1, np.int32)
    left = np.full(len(origins), FAR, np.float32) if max_distance is None else max_distance
    rays = np.arange(len(origins))
    origins, directions = origins.astype(np.float64), np.ascontiguousarray(directions)
    before, step = face.copy(), np.full(len(origins), BEHIND)
    while len(rays):
        hit = embree.run(origins[rays].astype(np.float32), directions[rays], dists=left[rays], output=True)
        met = np.flatnonzero(hit["primID"] >= 0)
        found, u, v = hit["primID"][met].astype(np.int32), *(hit[name][met].astype(np.float64) for name in "uv")
        stopped = stops(found, np.stack([1 - u - v, u, v], -1))
        face[rays[met[stopped]]] = found[stopped]
        through, found, along = rays[met[~stopped]], found[~stopped], hit["tfar"][met[~stopped]]
        step[through] = np.where(found == before[through], 2 * step[through], BEHIND)
        before[through] = found
        onward = along + step[through]
        origins[through] += onward[:, None] * directions[through]
        left[through] -= onward
        rays = through[left[through] > 0]
    return face


def _in_target_units(mesh: Mesh) -> tuple[Float32, NDArray[np.int32]]:
    """Points (P, 3) and faces (F, 3) of all of `mesh`: Embree's binding places nothing twice, so instances are made out
    for it, in its own 70 bytes a face."""
    points, faces, first = [], [], 0
    for placed, indices in mesh.placed:
        points.append(((placed - mesh.centre) / mesh.radius).astype(np.float32))
        faces.append(indices + np.int32(first))
        first += len(placed)
    return np.concatenate(points), np.concatenate(faces)


def _rays_in_target_units(scene: Scene, xy: Float) -> tuple[Float32, Float32]:
    """Origins and unit directions (N, 3) in body axes around the target's centre, in units of its radius.

    The camera's own position is the earliest start: nothing behind it is seen.
    """
    mesh, pose = scene.target.mesh, scene.T_cam_body
    cx, cy, cz = pose.points(mesh.centre) / mesh.radius
    x, y = xy[:, 0], xy[:, 1]
    # The ray's point at the centre's depth, seen from the centre: the range cancels here, in double precision.
    wx, wy = (cz * x - cx).astype(np.float32), (cz * y - cy).astype(np.float32)
    length = np.sqrt(x * x + y * y + 1)
    towards = np.stack([x / length, y / length, 1 / length], -1).astype(np.float32)
    along = wx * towards[:, 0] + wy * towards[:, 1]
    half_chord = np.sqrt(np.maximum(np.float32(MARGIN**2) - (wx * wx + wy * wy - along * along), 0))
    start = np.maximum(-along - half_chord, (-cz * length).astype(np.float32))
    origins = start[:, None] * towards
    origins[:, 0] += wx
    origins[:, 1] += wy
    rotation = pose.rotation.astype(np.float32)
    return origins @ rotation, towards @ rotation


def _rays_entering(origin: Float, directions: Float) -> tuple[Float32, Float32]:
    """Origins and unit directions (N, 3), in units of the target's radius around its centre, of the rays from `origin`
    (3,) where they enter its bounding sphere; `origin` itself within it."""
    along = -(directions @ origin)
    nearest = origin + along[:, None] * directions
    half_chord = np.sqrt(np.maximum(MARGIN**2 - (nearest * nearest).sum(1), 0))
    start = np.maximum(-half_chord, -along)
    return (nearest + start[:, None] * directions).astype(np.float32), directions.astype(np.float32)
