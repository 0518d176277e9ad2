"""A target: all geometry that is rendered below one prim, as one mesh in body axes.

An occluder is read likewise.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from spin_usd.basics.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.scene.instances import Instances
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.shape import MAX_FACES, MIN_SHARED_FACES, Shape
from spin_usd.scene.target import Target
from spin_usd.stage.composition.excess import MAX_PRIMS
from spin_usd.stage.composition.images import Images
from spin_usd.stage.read.bodies.body_parts import BodyParts
from spin_usd.stage.read.bodies.find_bodies import target_name
from spin_usd.stage.read.bodies.gprim import GprimReader, MaterialUse, PlacedGprim
from spin_usd.stage.read.bodies.keypoints import read_keypoints
from spin_usd.stage.read.bodies.part_labels import Labels, labels_of_target
from spin_usd.stage.read.bodies.part_shapes import PartShapes
from spin_usd.stage.read.bodies.point_instancer import read_instances
from spin_usd.stage.read.bodies.renderable import geometry_below, is_geometry, is_left_out
from spin_usd.stage.read.shapes.triangles import Int, determinant
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.root_metadata import Notes
from spin_usd.stage.usd.transforms import local_matrix
from spin_usd.stage.usd.values import DEFAULT_TIME, read
from spin_usd.stage.usd.visibility import (
    RENDERED_PURPOSES,
    ancestors,
    is_invisible,
    note_unknown_visibility,
    own_purpose,
    purpose_of,
)

MAX_REACH_M, MIN_RADIUS_M = 1e12, 1e-12  # of a body: ten times as far as the Sun is, a hundredth of an atom


@dataclass(frozen=True, kw_only=True, eq=False)
class Inherited:
    """The state that a prim inherits: matrix from its axes to the target's (row-vector), labels and purpose."""

    matrix: Float
    labels: Labels
    purpose: str


@dataclass(eq=False)
class TargetReader:
    """Reads a target, or an occluder, in the axes of `prim` at one time; `parts` has its parts. `visited` collects
    every prim on which the result depends; `group_of` gives the light-link group of a gprim or point instancer;
    `images` are the stage's. Invisible surfaces are left out, unless the prim keeps them, or `whole` is true."""

    prim: Usd.Prim
    parts: BodyParts
    time: Usd.TimeCode
    group_of: Callable[[Usd.Prim], int]
    images: Images
    notes: Notes
    visited: list[Usd.Prim] = field(default_factory=list)
    whole: bool = False
    _faces: int = 0

    def __post_init__(self) -> None:
        self._shapes = PartShapes.of(self.prim, self.time)
        self._pieces = GprimReader(
            time=self.time,
            images=self.images,
            visited=self.visited,
            notes=self.notes,
            keep_transparent=self.whole
            or bool(read(self.prim.GetAttribute(schema.TARGET_KEEP_TRANSPARENT), DEFAULT_TIME)),
        )

    def read(self, metres: float) -> Target:
        """Read the target; one unit of its own axes is `metres`. Raises StageError where it has nothing to render."""
        start = Inherited(matrix=np.eye(4), labels=labels_of_target(self.prim), purpose=purpose_of(self.prim))
        pieces = list(self._below(self.prim, start)) if self._shown() else []
        if not pieces:
            do = "add visible gprims of purpose default or render below it"
            if any(part.missing for part in self._shapes.parts):
                none = f"has no part that is rendered at time code {self.time.GetValue():g}"
                why = "`missing` of the variant's augmentation leaves none"
                raise StageError(f"the target {none}: {why}", where=self.prim.GetPath(), do="let one part stay")
            if any(finding.code == "material-transparent" for finding in self.notes.findings):
                do += ", or keep those of opacity 0 by spin:target:keepTransparent (author's --keep-transparent)"
            raise StageError("the target has no geometry that is rendered", where=self.prim.GetPath(), do=do)
        names, keypoints = read_keypoints(self.prim, self.time)
        keypoints, shape = self._shapes.keypoints(keypoints, metres)
        found = self._assembled(pieces, target_name(self.prim), metres)
        return replace(found, keypoint_names=names, keypoints=keypoints * metres, shape=shape)

    def read_look(self, last: Target, uses: Iterable[MaterialUse]) -> Target | None:
        """Return `last`, which was read at another time, with its materials at this one, of the `uses` then; None where
        they decide more than how its surface looks."""
        materials = self._pieces.again(uses, last.materials)
        return None if materials is None else replace(last, materials=materials)

    @property
    def uses(self) -> tuple[MaterialUse, ...]:
        """The uses of materials that were found."""
        return tuple(self._pieces.uses.values())

    def read_occluder(self, roots: Sequence[Usd.Prim], metres: float) -> Target | None:
        """Read the geometry at and below `roots`, which are the prim itself or children of it; None where nothing is
        visible."""
        start = Inherited(matrix=np.eye(4), labels=Labels(), purpose=purpose_of(self.prim))
        pieces: list[PlacedGprim] = []
        for root in roots if self._shown() else ():
            if root == self.prim:
                pieces += self._below(root, replace(start, labels=start.labels.below(root)))
            elif self._visible(root):
                pieces += self._below(root, self._entered(root, start))
        return self._assembled(pieces, str(roots[0].GetName()), metres) if pieces else None

    def _assembled(self, pieces: list[PlacedGprim], name: str, metres: float) -> Target:
        mesh = assembled(pieces, self._pieces.labels, metres, self.parts)
        _refuse_size(mesh, self.prim)
        materials = tuple(self._pieces.materials)
        return Target(path=str(self.prim.GetPath()), name=name, mesh=mesh, parts=self.parts.parts, materials=materials)

    def _shown(self) -> bool:
        return not any(is_invisible(prim, self.time) for prim in (*ancestors(self.prim), self.prim))

    def _below(self, prim: Usd.Prim, inherited: Inherited) -> Iterator[PlacedGprim]:
        """Read the gprims at and below `prim`, whose own transform and labels `inherited` includes."""
        for current, state in geometry_below(prim, inherited, enter=self._entered, shown=self._visible):
            self._count(current)
            yield from self._own(current, state)

    def _entered(self, prim: Usd.Prim, state: Inherited) -> Inherited:
        matrix = local_matrix(prim, self.time, self.notes) @ state.matrix
        return Inherited(matrix=matrix, labels=state.labels.below(prim), purpose=own_purpose(prim, state.purpose))

    def _visible(self, prim: Usd.Prim) -> bool:
        hidden = is_invisible(prim, self.time)
        if hidden:
            self.visited.append(prim)
        note_unknown_visibility(prim, self.time, self.notes)
        return not hidden

    def _own(self, prim: Usd.Prim, state: Inherited) -> Iterator[PlacedGprim]:
        """Read the geometry of a prim itself. Purposes other than default and render are not rendered."""
        if state.purpose not in RENDERED_PURPOSES or is_left_out(prim, self.notes) or not is_geometry(prim):
            return
        if prim.IsA(UsdGeom.PointInstancer):
            yield from self._instanced(prim, state)
        elif prim.IsA(UsdGeom.Mesh) and not read(UsdGeom.Mesh(prim).GetFaceVertexCountsAttr(), self.time):
            self.notes.add("mesh-empty", prim.GetPath(), "is a mesh without faces, of which nothing is rendered")
        else:
            piece = self._pieces.read(prim, state.labels.of_gprim(prim))
            if piece:
                yield self._placed(piece, state.matrix, prim)

    def _instanced(self, prim: Usd.Prim, state: Inherited) -> Iterator[PlacedGprim]:
        for prototype, matrices in read_instances(prim, self.time):
            if not self._visible(prototype):
                continue
            inside = replace(self._entered(prototype, state), matrix=np.eye(4))
            pieces = list(self._below(prototype, inside))
            if len(pieces) * len(matrices) > MAX_PRIMS:
                found = f"places {len(pieces) * len(matrices)} gprims, more than {MAX_PRIMS}"
                raise StageError(found, where=prim.GetPath(), do="make them fewer, or one mesh")
            for matrix in matrices:
                for piece in pieces:
                    yield self._placed(piece, piece.matrix @ matrix @ state.matrix, prim)

    def _count(self, prim: Usd.Prim) -> None:
        self.visited.append(prim)
        if len(self.visited) > MAX_PRIMS:
            raise StageError(f"has more than {MAX_PRIMS} prims", where=self.prim.GetPath(), do="merge meshes")

    def _placed(self, piece: PlacedGprim, matrix: Float, prim: Usd.Prim) -> PlacedGprim:
        """Return `piece` with the pose and the light-link group that `prim` gives it."""
        determinant(matrix, prim.GetPath())
        piece = self._shapes.deformed(replace(piece, matrix=matrix, where=prim.GetPath()), prim.GetPath())
        self._faces += len(piece.mesh.part)
        if self._faces > MAX_FACES:
            raise StageError(
                f"brings its body to more than {MAX_FACES} triangles", where=prim.GetPath(), do="simplify it"
            )
        return replace(piece, group=self.group_of(prim))


def _refuse_size(mesh: Mesh, prim: Usd.Prim) -> None:
    """Raise StageError for a body that numbers of double precision cannot measure."""
    reach = float(np.abs(mesh.centre).max()) + mesh.radius
    if not reach <= MAX_REACH_M or 0 < mesh.radius < MIN_RADIUS_M:
        found = f"its points reach {reach:g} m from its origin, and {mesh.radius:g} m from its centre"
        do = f"keep the first below {MAX_REACH_M:g} and the second above {MIN_RADIUS_M:g}: check scales and units"
        raise StageError(found, where=prim.GetPath(), do=do)


def assembled(pieces: list[PlacedGprim], labels: list[Labels], metres: float, parts: BodyParts) -> Mesh:
    """Build one mesh of `pieces`.

    Args:
        labels: The labels that part numbers index.
        metres: The pieces' unit.
        parts: The body's, whose numbers the faces get.
    """
    ids = np.array([parts.numbers.get(each.part_key, 0) for each in labels])
    channels = _channels(pieces)
    alone, shared = _by_mesh(pieces)
    instances = tuple(_instances(each, ids, metres) for each in shared)
    joined = _joined(alone, ids, metres, channels)
    used = (each.parts[:, np.unique(each.shape.face_part)] for each in instances)
    numbered = joined["face_part"].all() and all(parts.all() for parts in used)
    assert numbered, "a face is of a part that has no number"
    return Mesh(**joined, instances=instances)


def _by_mesh(pieces: list[PlacedGprim]) -> tuple[list[PlacedGprim], list[list[PlacedGprim]]]:
    """Separate single gprims from gprims that share mesh and materials."""
    alike: dict[Any, list[PlacedGprim]] = {}
    for piece in pieces:
        alike.setdefault((id(piece.mesh), piece.materials), []).append(piece)
    shared = {key: each for key, each in alike.items() if len(each) > 1 and len(each[0].mesh.part) >= MIN_SHARED_FACES}
    alone = [piece for piece in pieces if (id(piece.mesh), piece.materials) not in shared]
    return alone, list(shared.values())


def _joined(pieces: list[PlacedGprim], ids: Int, metres: float, channels: dict[str, int]) -> dict[str, Any]:
    """Build the fields of a Shape of all `pieces`, in the target's axes."""
    triangles = [piece.mesh.triangles.transformed(piece.matrix, piece.where) for piece in pieces]
    first = np.cumsum([0, *(len(each.points) for each in triangles)])
    return {
        "points": _stacked([each.points for each in triangles], (3,)) * metres,
        "faces": _stacked([each.corners + n for each, n in zip(triangles, first, strict=False)], (3,)),
        "face_part": _stacked([ids[list(piece.parts)][piece.mesh.part] for piece in pieces], ()),
        "face_group": _stacked([np.full(len(piece.mesh.part), piece.group) for piece in pieces], ()),
        "face_material": _stacked([np.array(piece.materials)[piece.mesh.material] for piece in pieces], ()),
        "corner_normals": _stacked([each.normals for each in triangles], (3, 3)),
        "primvars": {
            name: _stacked([_values(each.primvars, name, count, len(each.corners)) for each in triangles], (3, count))
            for name, count in channels.items()
        },
    }


def _stacked(arrays: Sequence[NDArray[Any]], shape: tuple[int, ...]) -> NDArray[Any]:
    """Concatenate the rows of `arrays` (N, *shape)."""
    return np.concatenate(arrays) if arrays else np.zeros((0, *shape))


def _instances(pieces: list[PlacedGprim], ids: Int, metres: float) -> Instances:
    """Turn `pieces`, which have the same mesh and materials, into instances of one shape."""
    mesh, triangles = pieces[0].mesh, pieces[0].mesh.triangles
    shape = Shape(
        points=triangles.points,
        faces=triangles.corners.astype(np.int32),
        face_part=mesh.part.astype(np.uint16),
        face_material=np.array(pieces[0].materials, np.int32)[mesh.material],
        corner_normals=triangles.normals.astype(np.float32),
        primvars={name: values.astype(np.float32) for name, values in triangles.primvars.items()},
    )
    return Instances(
        shape=shape,
        matrices=np.stack([piece.matrix[:, :3].T for piece in pieces]) * metres,
        parts=ids[np.array([piece.parts for piece in pieces])].astype(np.uint16),
        groups=np.array([piece.group for piece in pieces], np.uint16),
    )


def _channels(pieces: list[PlacedGprim]) -> dict[str, int]:
    """Count the numbers of each primvar. Raises UnsupportedError for one name of two types."""
    channels: dict[str, int] = {}
    for name, values in (item for piece in pieces for item in piece.mesh.triangles.primvars.items()):
        if channels.setdefault(name, values.shape[2]) != values.shape[2]:
            found = f"primvars:{name} has {values.shape[2]} numbers on some of its gprims, {channels[name]} on others"
            raise UnsupportedError(found, do="give one of them another name")
    return channels


def _values(primvars: Any, name: str, channels: int, count: int) -> NDArray[np.float32]:
    """Return the values (count, 3, channels) of one primvar of a gprim: 0 where it lacks it."""
    values = primvars.get(name, np.zeros((1, 3, channels)))
    return np.broadcast_to(values, (count, 3, channels)).astype(np.float32)
