"""The surface of a target: triangles in body axes, and shapes that stand in several places of it."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, product

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float, digest
from spin_usd.errors import GeometryError
from spin_usd.geometry.facing import few_axes
from spin_usd.geometry.triangles import normals_of
from spin_usd.scene.instances import Instances
from spin_usd.scene.shape import MAX_FACES, Shape, hull_points, spanning

MANY_POINTS = 2**17  # of hulls of copies: to sort more takes longer than to find their hull
BOX = np.array(list(product((0, 1), repeat=3)))
BOX_EDGES = np.array([(i, j) for i in range(8) for j in range(i) if abs(BOX[i] - BOX[j]).sum() == 1])


@dataclass(frozen=True, kw_only=True, eq=False)
class Mesh(Shape):
    """The whole target in body axes: its own triangles, and `instances` of others.

    What it has as a Shape is of its own triangles alone; all that follows here is of the whole. Faces are numbered from
    0: its own first, then those of the instances, place after place (scene.derived.faces looks them up).
    Raises GeometryError as Shape, and for no faces.
    """

    instances: tuple[Instances, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.count <= MAX_FACES:
            raise GeometryError(f"mesh has {self.count} faces, expected 1 to {MAX_FACES}")

    @property
    def count(self) -> int:
        """The number of faces."""
        return len(self.faces) + sum(each.count for each in self.instances)

    @property
    def numbered(self) -> Iterator[tuple[int, Instances]]:
        """The instances, with the number of each one's first face."""
        counts = (len(self.faces), *(each.count for each in self.instances))
        return zip(accumulate(counts), self.instances, strict=False)

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """The shapes that have triangles, each once, whatever its places."""
        return (*((self,) if len(self.faces) else ()), *(each.shape for each in self.instances))

    @property
    def placed(self) -> Iterator[tuple[Float, NDArray[np.int32]]]:
        """Points (P, 3), body axes, and faces (F, 3) of them: the mesh's own and each instance's, in the order of the
        faces' numbers."""
        if len(self.faces):
            yield self.points, self.faces
        for each in self.instances:
            for place in range(len(each.matrices)):
                yield each.moved(each.shape.points, place), each.faces(place)

    @cached_property
    def key(self) -> str:
        """Digest of the geometry and its parts, the inputs of labels."""
        return digest(self.own_key, [each.key for each in self.instances]) if self.instances else self.own_key

    @cached_property
    def shading_key(self) -> str:
        """Digest of the inputs of only the picture."""
        own = self.own_shading_key
        return digest(own, [each.shading_key for each in self.instances]) if self.instances else own

    @cached_property
    def box(self) -> Float:
        """(2, 3) least and largest coordinates of the points that faces have, body axes, metres."""
        ends = np.concatenate([[points.min(0), points.max(0)] for points in self._used()])
        return np.stack([ends.min(0), ends.max(0)])

    @cached_property
    def size(self) -> Float:
        """(3,) edges of the bounding box along the body's axes, metres."""
        edges: Float = self.box[1] - self.box[0]
        return edges

    @cached_property
    def face_axes(self) -> Float:
        """(A, 3) few directions that represent all faces, from `geometry.facing`."""
        own = few_axes(normals_of(self.points, self.faces))
        placed = [
            each.area_vectors(few_axes(normals_of(each.shape.points, each.shape.faces))) for each in self.instances
        ]
        return few_axes(np.concatenate([own, *placed]))

    @cached_property
    def centre(self) -> Float:
        """(3,) middle of the bounding box, body axes, metres."""
        low, high = self.box
        middle: Float = (low + high) / 2
        return middle

    @cached_property
    def radius(self) -> float:
        """Largest distance of a used point from `centre`, metres."""
        return max(float(np.linalg.norm(points - self.centre, axis=1).max()) for points in self._used())

    @cached_property
    def groups(self) -> frozenset[int]:
        """The numbers of face groups that there are."""
        each = [np.asarray(self.face_group), *(each.groups for each in self.instances)]
        return frozenset(np.unique(np.concatenate(each)).tolist())

    @cached_property
    def part_ids(self) -> tuple[int, int]:
        """The least and the largest id of its parts."""
        each = [ids for ids in (self.face_part, *(each.parts for each in self.instances)) if ids.size]
        return min(int(ids.min()) for ids in each), max(int(ids.max()) for ids in each)

    @cached_property
    def hull(self) -> Float:
        """(N, 3) points whose convex hull is the mesh's: few, so that bounding it every frame costs nothing."""
        if not self.instances:
            return self.own_hull
        spans = [self.own_hull] if len(self.faces) else []
        points = np.concatenate([*spans, *(points for points in self._moved(hull=True))])
        return hull_points(spanning(points) if len(points) > MANY_POINTS else points)

    @cached_property
    def outline(self) -> tuple[Float, NDArray[np.integer]]:
        """Points (P, 3) and edges (E, 2) between them within whose outline all of it lies, from wherever it is seen:
        its own, and the bounding box of each instance in its shape's axes."""
        if not self.instances:
            return self.points, self.edges
        points, edges = [self.points], [np.asarray(self.edges, np.int64)]
        for each in self.instances:
            used = each.shape.used_points
            box = np.where(BOX, used.max(0), used.min(0))
            for place in range(len(each.matrices)):
                edges.append(BOX_EDGES + sum(map(len, points)))
                points.append(each.moved(box, place))
        return np.concatenate(points), np.concatenate(edges)

    def _used(self) -> Iterator[Float]:
        """Yield (N, 3) of the points that faces have, body axes: its own, and each place's."""
        if len(self.faces):
            yield self.used_points
        yield from self._moved(hull=False)

    def _moved(self, *, hull: bool) -> Iterator[Float]:
        """Yield (N, 3) of each place, body axes: its shape's used points, or the points of its hull."""
        for each in self.instances:
            points = each.shape.own_hull if hull else each.shape.used_points
            yield from (each.moved(points, place) for place in range(len(each.matrices)))
