"""Parts of a target that are not quite as its model has them: turned, shifted, scaled, missing, bent or bulged."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdGeom

from spin_usd.basics.arrays import Float
from spin_usd.errors import StageError
from spin_usd.geometry.bend import Bend
from spin_usd.geometry.bulge import bulged, bulged_normals, flat_faces, longest_edge
from spin_usd.geometry.part_axes import nearest
from spin_usd.geometry.splitting import Split, split_edges
from spin_usd.geometry.triangles import affine, lengths
from spin_usd.scene.target import ChangedPart, TargetShape
from spin_usd.stage.read.bodies.gprim import PlacedGprim
from spin_usd.stage.read.bodies.keypoints import find_keypoints, keypoint_parts
from spin_usd.stage.read.bodies.part_labels import Labels
from spin_usd.stage.read.shapes.triangles import Int, Triangles, unit
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import read
from spin_usd.stage.usd.visibility import PROXIES


@dataclass(frozen=True, kw_only=True, eq=False)
class ShapedPart:
    """A changed part, in the target's own axes and units."""

    path: Sdf.Path
    name: str
    placed: Float
    """(4, 4) from places in the model to places here, changed parts above it included."""
    missing: bool
    bulge: float
    bend: Bend
    surfaces: list[tuple[Float, Float]] = field(default_factory=list)
    """Triangles (F, 3, 3) of the model that bulged, and how far their corners moved (F, 3, 3)."""

    @property
    def deforms(self) -> bool:
        return bool(self.bulge or self.bend.angle)

    def moved(self, points: Float) -> Float:
        """Bulge and bend points (N, 3), which are placed already, with the nearest surface."""
        drawn = affine(np.linalg.inv(self.placed)[:3], points)
        if self.surfaces:
            corners, moves = (np.concatenate(each) for each in zip(*self.surfaces, strict=True))
            for i, face in enumerate(nearest(drawn, corners)[1]):
                drawn[i] += _shares(drawn[i], corners[face]) @ moves[face]
        return affine(self.placed[:3], self.bend.points(drawn))

    def record(self, metres: float) -> ChangedPart:
        """Return the part as records have it; `metres`: a unit of the target's axes."""
        T_body_drawn = self.placed.copy()
        T_body_drawn[:3, 3] *= metres
        return ChangedPart(
            path=str(self.path),
            name=self.name,
            T_body_drawn=T_body_drawn,
            bend_deg=float(np.degrees(self.bend.angle)),
            bulge=self.bulge * metres,
            missing=self.missing,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class PartShapes:
    """The changed parts of a body at one time."""

    prim: Usd.Prim
    time: Usd.TimeCode
    parts: tuple[ShapedPart, ...]
    """Each after the parts above it."""

    @classmethod
    def of(cls, prim: Usd.Prim, time: Usd.TimeCode) -> "PartShapes":
        """Find the parts below `prim` whose shape is not their model's."""
        found = cls(prim=prim, time=time, parts=())
        for part in Usd.PrimRange(prim, PROXIES):
            if part.HasAPI(schema.SHAPE_API):
                found = replace(found, parts=(*found.parts, found._read(part)))
        return found

    def _read(self, part: Usd.Prim) -> ShapedPart:
        """Read a part. Raises StageError for a bend without a length."""
        above = self._above(part.GetPath())
        values = [
            read(part.GetAttribute(name), self.time)
            for name in (schema.SHAPE_BEND_FRAME, schema.SHAPE_BEND_LENGTH, schema.SHAPE_BEND, schema.SHAPE_BULGE)
        ]
        if not (np.isfinite(np.array(values[0])).all() and np.isfinite(values[1:]).all() and values[1] > 0):
            raise StageError("bends or bulges by no number", where=part.GetPath(), do="augment the stage again")
        return ShapedPart(
            path=part.GetPath(),
            name=Labels().below(part).of_gprim(part).part_name,
            placed=self._own(part) @ (above[-1].placed if above else np.eye(4)),
            missing=bool(read(part.GetAttribute(schema.SHAPE_MISSING), self.time)),
            bulge=float(values[3]),
            bend=Bend(frame=np.array(values[0]).T, length=float(values[1]), angle=float(np.radians(values[2]))),
        )

    def _own(self, part: Usd.Prim) -> Float:
        """Return (4, 4) by which a part itself is moved, in the body's axes."""
        moves = read(part.GetAttribute(schema.SHAPE_OP), self.time)
        if moves is None or moves == type(moves)(1):
            return np.eye(4)
        parent = UsdGeom.XformCache(self.time).ComputeRelativeTransform(part.GetParent(), self.prim)[0]
        matrix, to_body = np.array(moves).T, np.array(parent).T
        own: Float = to_body @ matrix @ np.linalg.inv(to_body)
        return own

    def _above(self, path: Sdf.Path) -> tuple[ShapedPart, ...]:
        """Return the changed parts that are at or above a path, the outermost first."""
        return tuple(part for part in self.parts if path.HasPrefix(part.path))

    def deformed(self, piece: PlacedGprim, path: Sdf.Path) -> PlacedGprim:
        """Bulge and bend a gprim, or a copy of one, at that path: the innermost part's shape first."""
        for part in reversed(self._above(path)):
            if part.deforms:
                triangles = piece.mesh.triangles.transformed(piece.matrix, piece.where)
                triangles, of = _deformed(triangles, part, piece.where)
                mesh = replace(
                    piece.mesh, triangles=triangles, part=piece.mesh.part[of], material=piece.mesh.material[of]
                )
                piece = replace(piece, mesh=mesh, matrix=np.eye(4))
        return piece

    def keypoints(self, points: Float, metres: float) -> tuple[Float, TargetShape | None]:
        """Return the keypoints (K, 3), from `points` as they were read, and the shape; None if it is the model's."""
        changed = [part for part in self.parts if part.deforms or part.missing or (part.placed != np.eye(4)).any()]
        if not changed:
            return points, None
        prim, parts = find_keypoints(self.prim), keypoint_parts(self.prim, len(points))
        drawn = affine(np.linalg.inv(carried.placed)[:3], points) if (carried := self._carrier(prim)) else points
        above = [self._above(Sdf.Path(part)) if part else () for part in parts]
        shape = TargetShape(
            parts=tuple(part.record(metres) for part in changed),
            drawn_keypoints=drawn * metres,
            keypoint_parts=parts,
            keypoint_missing=np.array([any(part.missing for part in chain) for chain in above], bool),
        )
        return np.array([_moved(*each) for each in zip(drawn, above, strict=True)]).reshape(-1, 3), shape

    def _carrier(self, keypoints: Usd.Prim | None) -> ShapedPart | None:
        """Return the changed part that the keypoints' own prim is below, if any."""
        above = self._above(keypoints.GetPath()) if keypoints else ()
        return above[-1] if above else None


def _shares(point: Float, corners: Float) -> Float:
    """Return (3,) the shares of a triangle's `corners` (3, 3) in its place that is nearest to a point (3,), or so."""
    size = float(np.ptp(corners, axis=0).max())
    ways = np.vstack([corners.T - point[:, None], np.full(3, size)])
    shares = np.clip(np.linalg.lstsq(ways, [0, 0, 0, size])[0], 0, 1)
    return np.asarray(shares / max(shares.sum(), np.finfo(float).tiny))


def _moved(point: Float, above: tuple[ShapedPart, ...]) -> Float:
    """Move a keypoint (3,) with the changed parts that it belongs to, the outermost first."""
    if not above:
        return point
    moved = affine(above[-1].placed[:3], point[None])
    for part in reversed(above):
        moved = part.moved(moved) if part.deforms else moved
    return np.asarray(moved[0])


def _split(drawn: Triangles, part: ShapedPart) -> Split:
    """Split the triangles of a part so that they can follow its shape."""
    longest = longest_edge(drawn.points, drawn.corners) if part.bulge else np.inf

    def too_long(a: Float, b: Float) -> NDArray[np.bool_]:
        of_bulge: NDArray[np.bool_] = lengths(b - a) > longest
        return of_bulge | part.bend.too_long(a, b) if part.bend.angle else of_bulge

    return split_edges(drawn.points, drawn.corners, too_long)


def _deformed(triangles: Triangles, part: ShapedPart, where: object) -> tuple[Triangles, Int]:
    """Return the triangles bulged and bent, and (T,) the triangle before of which each is a piece."""
    drawn = triangles.transformed(np.linalg.inv(part.placed).T, where)
    split = _split(drawn, part)
    points, corners, normals = split.points, split.corners, unit(split.values(drawn.normals))
    if part.bulge:
        faces = flat_faces(drawn.points, drawn.corners)[split.of]
        points = bulged(split.points, corners, faces, part.bulge)
        normals = bulged_normals(normals, split.points, points, corners)
        part.surfaces.append((split.points[corners], (points - split.points)[corners]))
    if part.bend.angle:
        normals = part.bend.normals(points[corners], normals)
        points = part.bend.points(points)
    found = Triangles(
        points=points,
        corners=corners,
        normals=normals,
        source=drawn.source[split.of],
        primvars={name: split.values(values) for name, values in drawn.primvars.items()},
        mended=drawn.mended,
    )
    return found.transformed(part.placed.T, where), split.of
