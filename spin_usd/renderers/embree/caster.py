"""Embree: which triangle each ray meets first, of pixels, beams, and rays to light, for the labels of every run.

Embree computes in float32. Rays are given to it in body axes around the target's centre, in units of the target's
radius, and start where they enter its bounding sphere: so every number is near one, and range costs no precision.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.geometry.rotation import product
from spin_usd.geometry.triangles import unit_normals, unit_vectors
from spin_usd.scene.derived.faces import groups_of
from spin_usd.scene.derived.lookup import is_there
from spin_usd.scene.derived.nearest import nearest, nearest_faces
from spin_usd.scene.light import Links
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.passes import Visibility
from spin_usd.scene.scene import OneBody, Scene
from spin_usd.scene.target import Target

BEHIND = 5e-7  # of the target's radius: how far behind a hole a ray goes on; float32 is good to 1e-7 there
FAR = 1e30  # a ray's length without an end
MAX_FACES = 1 << 20  # of a mesh: with more, instances made out, it takes too long to look
PART_FACES = 1 << 21  # of a mesh of copies: more than twice as many are opened in parts
MAX_LAYERS = 16  # each is a scene of Embree's, and a process that opens a thousand crashes
Faces = NDArray[np.int32]

Float32 = NDArray[np.float32]

MARGIN = 1.001  # of the bounding sphere's radius: rays start a little outside

# Of coordinates of about one, as float32 has them: 6e-8 each, and 1e-4 of a normal where a triangle is 1e-3 long.
SAME_PLANE = 1e-4  # by which normals and offsets of one plane may differ
IN_PLANE = 2e-6  # off a plane, still in it
IN_COMMON = 1e-6  # width of the area that two triangles share: triangles that share an edge have less
ASLANT = (0.43, 0.57, 0.7)  # a direction in which few planes of a model have no extent
APART = 8  # more than the extent of all coordinates, so that planes follow one another
MAX_CANDIDATES = 30_000_000  # pairs that are examined, in some seconds; further ones of a mesh are not found
CHUNK = 1 << 18  # candidates that are looked at together

Pairs = NDArray[np.intp]


@dataclass(frozen=True, kw_only=True, eq=False)
class OverlappingFaces:
    """The faces of a mesh that overlap others, in layers: none overlaps another of its layer.

    Of two faces that lie in one another, Embree's kernels for some processors see the one, those for others the other.
    So that labels have the same bytes on all processors, the one with the lowest number is seen. Of such faces the
    lowest number is in the lowest layer. The highest layer has all that are above MAX_LAYERS others, and may overlap
    itself.
    """

    layer: NDArray[np.int32]
    """(F,): of each face; -1 of one that overlaps none."""
    scenes: Sequence[EmbreeScene]
    """Of each layer but the highest Embree's scene."""
    numbers: Sequence[NDArray[np.int32]]
    """The numbers of the faces of each of these layers."""
    pairs: NDArray[np.int64]
    """(P,), sorted: of two that overlap the higher times F, plus the lower."""

    @classmethod
    def among(cls, points: Float32, faces: Faces) -> "OverlappingFaces | None":
        """Return those of the mesh with these points (P, 3) and faces (F, 3); None where there are none."""
        found = overlapping(points[faces].astype(np.float64))
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


class SceneInParts:
    """Embree's scenes of some places of a mesh each: to build one of all takes half as much memory again."""

    def __init__(self, mesh: Mesh) -> None:
        self._parts: list[tuple[int, EmbreeScene]] = []
        first, places = 0, 1 + sum(len(each.matrices) for each in mesh.instances)
        placed = iter(mesh.placed)
        while some := list(islice(placed, -(-places * PART_FACES // mesh.count))):
            points, faces = in_target_units(mesh, some)
            self._parts.append((first, mesh_scene(points, faces)))
            self._parts[-1][1].run(points[:1], points[:1])  # builds it
            first += len(faces)

    def run(
        self, origins: Float32, directions: Float32, dists: Any = None, query: str = "", output: bool = False
    ) -> Any:
        """Return what EmbreeScene.run returns; of faces that are equally near, those of the part of lower numbers."""
        left = np.full(len(origins), FAR, np.float32) if dists is None else dists.copy()
        if query:
            return np.max([part.run(origins, directions, dists=left, query=query) for _, part in self._parts], axis=0)
        found = {"primID": np.full(len(origins), -1, np.int32), **dict.fromkeys("uv", 0 * left), "tfar": left}
        for first, part in reversed(self._parts):
            nearer = part.run(origins, directions, dists=found["tfar"].copy(), output=True)
            met = nearer["primID"] >= 0
            nearer["primID"] += np.int32(first)
            found = {name: np.where(met, nearer[name], values) for name, values in found.items()}
        return found if output else found["primID"]


class EmbreeCaster:
    """Casts rays at targets, and keeps Embree's data for each mesh as long as the mesh exists."""

    name = "embree"

    def __init__(self) -> None:
        self._opened: WeakKeyDictionary[Mesh, EmbreeScene | SceneInParts] = WeakKeyDictionary()
        self._overlapping: WeakKeyDictionary[Mesh, OverlappingFaces | None] = WeakKeyDictionary()

    def visibility(self, scene: Scene) -> Visibility:
        """Return the face behind every pixel centre of `scene.region`."""
        return nearest(scene, [self._visibility(one) for one in scene.one_body_scenes])

    def _visibility(self, scene: OneBody) -> Visibility:
        """Return the face of the scene's target alone."""
        region = scene.region
        face = np.full(region.shape, -1, np.int32)
        for band in region.bands():
            xy = scene.camera.centres(band)
            found = self._cast(scene, xy.reshape(-1, 2)).reshape(band.shape)
            blind = scene.camera.blind(band)
            face[band.y0 - region.y0 : band.y1 - region.y0] = found if blind is None else np.where(blind, -1, found)
        return Visibility(region=region, face=face)

    def cast(self, scene: Scene, xy: Float) -> NDArray[np.int32]:
        """Return the first face (N,) that is there on the camera's rays (x, y, 1) of `xy` (N, 2), numbered as a
        Visibility's; -1 for none."""
        return nearest_faces(scene, [self._cast(one, xy) for one in scene.one_body_scenes], xy)

    def meets(self, scene: Scene, xy: Float) -> NDArray[np.bool_]:
        """Return (N,) whether the camera's rays (x, y, 1) of `xy` (N, 2) meet a body that is there."""
        met = np.zeros(len(xy), bool)
        for one in scene.one_body_scenes:
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
        """Release the data of the meshes."""
        self._opened.clear()
        self._overlapping.clear()

    def _cast(self, scene: OneBody, xy: Float) -> NDArray[np.int32]:
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

    def _embree(self, mesh: Mesh) -> EmbreeScene | SceneInParts:
        if mesh not in self._opened:
            parts = mesh.instances and mesh.count > 2 * PART_FACES
            self._opened[mesh] = SceneInParts(mesh) if parts else mesh_scene(*in_target_units(mesh, mesh.placed))
        return self._opened[mesh]

    def _overlaps(self, mesh: Mesh) -> OverlappingFaces | None:
        """Return the mesh's faces that lie in one another, found when the first face is requested."""
        if mesh not in self._overlapping:
            few = mesh.count <= MAX_FACES
            self._overlapping[mesh] = OverlappingFaces.among(*in_target_units(mesh, mesh.placed)) if few else None
        return self._overlapping[mesh]


def first_stop(
    embree: EmbreeScene | SceneInParts,
    origins: Float32,
    directions: Float32,
    stops: Callable[[NDArray[np.int32], Float], NDArray[np.bool_]],
    max_distance: Float32 | None = None,
) -> NDArray[np.int32]:
    """Return the first face (N,) that stops each of the rays, within its `max_distance` (N,) where given; -1 for none.

    Origins and unit directions are (N, 3). `stops` says of faces (n,) and the barycentric weights (n, 3) at which rays
    meet them whether they do. A ray goes on from just behind a face that does not; where it meets that face again, its
    start was rounded to before it, and the next step is twice as long.
    """
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


def in_target_units(mesh: Mesh, pieces: Iterable[tuple[Float, Faces]]) -> tuple[Float32, Faces]:
    """Return points (P, 3) and faces (F, 3) of some `pieces` of `mesh`, as it has them placed.

    Embree's binding places nothing twice, so instances are made out for it, in its own 70 bytes a face.
    """
    points, faces, first = [], [], 0
    for placed, indices in pieces:
        points.append(((placed - mesh.centre) / mesh.radius).astype(np.float32))
        faces.append(indices + np.int32(first))
        first += len(placed)
    return np.concatenate(points), np.concatenate(faces)


def mesh_scene(points: Float32, faces: Faces) -> EmbreeScene:
    """Return Embree's scene of the triangles `faces` (F, 3) between `points` (P, 3)."""
    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, points, faces)
    return scene


def rays_in_target_units(scene: OneBody, xy: Float) -> tuple[Float32, Float32]:
    """Return origins and unit directions (N, 3), in body axes around the target's centre, in units of its radius, of
    the camera's rays (x, y, 1) of `xy` (N, 2).

    Rays start where they enter the target's bounding sphere, or at the camera, behind which nothing is seen.
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
    to_body = pose.rotation.T.astype(np.float32)
    return product(to_body, origins), product(to_body, towards)


def rays_entering(origin: Float, directions: Float) -> tuple[Float32, Float32]:
    """Return origins and unit directions (N, 3), in body axes around the target's centre, in units of its radius, of
    the rays from `origin` (3,) along the unit `directions` (N, 3), which are in the same axes and units.

    Rays start where they enter the target's bounding sphere; from within it, at `origin`.
    """
    along = -(directions * origin).sum(1)
    nearest = origin + along[:, None] * directions
    half_chord = np.sqrt(np.maximum(MARGIN**2 - (nearest * nearest).sum(1), 0))
    start = np.maximum(-half_chord, -along)
    return (nearest + start[:, None] * directions).astype(np.float32), directions.astype(np.float32)


def overlapping(corners: Float) -> Pairs:
    """Return (P, 2) the pairs of the triangles (F, 3, 3), of coordinates of about one, that overlap; the lower number
    first.

    Every pair of triangles in one plane with an area in common is found, to the rounding of float32;
    scene.derived.coincidence looks for faces to warn of, by the middles of some, and as far apart as no renderer can
    tell.
    """
    normals = unit_normals(corners)
    normals *= np.where(normals[np.arange(len(normals)), np.abs(normals).argmax(1)] < 0, -1.0, 1.0)[:, None]
    offsets = (normals * corners.mean(1)).sum(1)
    planes = _linked(np.column_stack([offsets, normals]), SAME_PLANE)
    found = [_overlapping(corners, normals, pairs) for pairs in _candidates(corners, planes)]
    return np.sort(np.concatenate([np.zeros((0, 2), np.intp), *found]), axis=1)


def _linked(values: Float, apart: float) -> NDArray[np.intp]:
    """Return (F,) a number for each row of the `values` (F, K). Rows have the same number where steps of at most
    `apart`, in every column, lead from one to the other by way of such rows."""
    group = np.zeros(len(values), np.intp)
    for column in values.T:
        order = np.lexsort((column, group))
        starts = (np.diff(column[order]) > apart) | (np.diff(group[order]) > 0)
        group[order[1:]] = np.cumsum(starts)
        group[order[:1]] = 0
    return group


def _candidates(corners: Float, planes: NDArray[np.intp]) -> Iterator[Pairs]:
    """Yield (n, 2) pairs of triangles of one plane whose boxes overlap, some at a time."""
    places = (corners * ASLANT).sum(-1)
    low, high = (np.asfortranarray(each) for each in (corners.min(1), corners.max(1)))
    order = np.lexsort((places.min(1), planes))
    start = APART * planes[order] + places.min(1)[order]
    end = np.searchsorted(start, APART * planes[order] + places.max(1)[order], side="right")
    count = end - np.arange(len(order)) - 1
    total = np.cumsum(count)
    for first in range(0, min(int(total[-1]) if len(total) else 0, MAX_CANDIDATES), CHUNK):
        number = np.arange(first, min(first + CHUNK, int(total[-1])))
        one = np.searchsorted(total, number, side="right")
        other = one + 1 + number - (total[one] - count[one])
        one, other = order[one], order[other]
        for least, most in zip(low.T, high.T, strict=True):
            near = np.minimum(most[one], most[other]) - np.maximum(least[one], least[other]) > -IN_PLANE
            one, other = one[near], other[near]
        yield np.column_stack([one, other])


def _overlapping(corners: Float, normals: Float, pairs: Pairs) -> Pairs:
    """Return those of the `pairs` (n, 2) that lie in one plane and share an area: no line along an edge of either
    separates them (the theorem of separating axes)."""
    first, second = pairs.T
    off = np.abs(((corners[second] - corners[first, :1]) * normals[first, None]).sum(-1)).max(1)
    pairs = pairs[off <= IN_PLANE]
    for own in (0, 1):
        for start in range(3):
            edge = corners[pairs[:, own], (start + 1) % 3] - corners[pairs[:, own], start]
            across = unit_vectors(np.cross(normals[pairs[:, 0]], edge))
            one, other = ((corners[each] * across[:, None]).sum(-1) for each in pairs.T)
            shared = np.minimum(one.max(1), other.max(1)) - np.maximum(one.min(1), other.min(1))
            pairs = pairs[shared > IN_COMMON]
    return pairs
