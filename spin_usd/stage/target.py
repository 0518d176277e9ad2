"""The target: all that is drawn below one prim, as one mesh in body axes."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from spin_usd.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.scene.material import Material
from spin_usd.scene.mesh import MAX_FACES, Mesh
from spin_usd.scene.target import Part, Target
from spin_usd.stage import schema
from spin_usd.stage.compose import MAX_PRIMS
from spin_usd.stage.displacement import displaced
from spin_usd.stage.drawn import DRAWN_PURPOSES, PROXIES, ancestors, is_geometry, is_invisible, own_purpose
from spin_usd.stage.gprims import read_gprim
from spin_usd.stage.images import Images
from spin_usd.stage.instances import read_instances
from spin_usd.stage.keypoints import read_keypoints
from spin_usd.stage.materials import Look, Looks, resolved
from spin_usd.stage.meshes import read_mesh
from spin_usd.stage.parts import Labels
from spin_usd.stage.primvars import FoundPrimvar, find_primvar
from spin_usd.stage.triangles import Int, Triangles
from spin_usd.stage.xforms import local_matrix


@dataclass(frozen=True, kw_only=True, eq=False)
class Piece:
    """Triangles of one gprim, with the number of the part and of the material of each, and of its group of links."""

    triangles: Triangles
    part: Int
    material: Int
    group: int = 0


@dataclass(frozen=True, kw_only=True, eq=False)
class Inherited:
    """What a prim has from its ancestors: its axes in the target's (row-vector), labels and purpose."""

    matrix: Float
    labels: Labels
    purpose: str


def find_target(stage: Usd.Stage) -> Usd.Prim:
    """The one prim with SpinTargetAPI. Raises StageError for none or several."""
    found = [prim for prim in stage.Traverse() if prim.HasAPI(schema.TARGET_API)]
    if len(found) == 1:
        return found[0]
    names = ", ".join(str(prim.GetPath()) for prim in found[:5]) or "none"
    do = "apply SpinTargetAPI to the prim that holds the spacecraft, and to no other"
    raise StageError(f"the stage has {len(found)} target prims ({names})", where=stage.GetRootLayer().realPath, do=do)


@dataclass(eq=False)
class TargetReader:
    """Reads the target at one time. `visited` collects every prim that the result depends on; `group_of` a gprim or
    point instancer is the number that light links know its faces by; `images` are the stage's."""

    prim: Usd.Prim
    time: Usd.TimeCode
    group_of: Callable[[Usd.Prim], int]
    images: Images
    visited: list[Usd.Prim] = field(default_factory=list)
    _labels: list[Labels] = field(default_factory=list)
    _part_number: dict[str, int] = field(default_factory=dict)
    _materials: dict[Material, int] = field(default_factory=dict)
    _shapes: dict[Any, Triangles] = field(default_factory=dict)
    _faces: int = 0

    def __post_init__(self) -> None:
        self._looks = Looks(time=self.time, images=self.images)

    def read(self, metres: float) -> Target:
        """The target, one stage unit of its own axes being `metres`. Raises StageError where nothing is drawn."""
        purpose, above = "default", [*ancestors(self.prim), self.prim]
        for prim in above:
            purpose = own_purpose(prim, purpose)
        start = Inherited(matrix=np.eye(4), labels=Labels().below(self.prim), purpose=purpose)
        visible = not any(is_invisible(prim, self.time) for prim in above)
        pieces = list(self._below(self.prim, start)) if visible else []
        if not pieces:
            do = "add visible gprims of purpose default or render below it"
            raise StageError("the target has no geometry that is drawn", where=self.prim.GetPath(), do=do)
        names, keypoints = read_keypoints(self.prim, self.time)
        mesh, parts = self._assembled(pieces, metres)
        return Target(
            path=str(self.prim.GetPath()),
            name=str(self.prim.GetAttribute(schema.TARGET_NAME).Get() or self.prim.GetName()),
            mesh=mesh,
            parts=parts,
            materials=tuple(self._materials),
            keypoint_names=names,
            keypoints=keypoints * metres,
        )

    def _below(self, prim: Usd.Prim, inherited: Inherited) -> Iterator[Piece]:
        """Pieces of `prim`, whose own transform and labels `inherited` includes, and of all below it."""
        waiting = [(prim, inherited)]
        while waiting:
            current, state = waiting.pop()
            self._count(current)
            yield from self._own(current, state)
            if current.IsA(UsdGeom.PointInstancer):
                continue
            for child in reversed(current.GetFilteredChildren(PROXIES)):
                if not child.IsA(UsdGeom.Subset) and self._visible(child):
                    waiting.append((child, self._entered(child, state)))

    def _entered(self, prim: Usd.Prim, state: Inherited) -> Inherited:
        matrix = local_matrix(prim, self.time) @ state.matrix
        return Inherited(matrix=matrix, labels=state.labels.below(prim), purpose=own_purpose(prim, state.purpose))

    def _visible(self, prim: Usd.Prim) -> bool:
        hidden = is_invisible(prim, self.time)
        if hidden:
            self.visited.append(prim)
        return not hidden

    def _own(self, prim: Usd.Prim, state: Inherited) -> Iterator[Piece]:
        """The pieces of a prim itself. Purposes other than default and render are not drawn."""
        if state.purpose not in DRAWN_PURPOSES or not is_geometry(prim):
            return
        if prim.IsA(UsdGeom.PointInstancer):
            yield from self._instanced(prim, state)
        else:
            piece = self._piece(prim, state.labels.of_gprim(prim))
            moved = piece.triangles.transformed(state.matrix, prim.GetPath())
            yield self._budgeted(replace(piece, triangles=moved, group=self.group_of(prim)), prim)

    def _instanced(self, prim: Usd.Prim, state: Inherited) -> Iterator[Piece]:
        for prototype, matrices in read_instances(prim, self.time):
            if not self._visible(prototype):
                continue
            inside = replace(self._entered(prototype, state), matrix=np.eye(4))
            pieces = list(self._below(prototype, inside))
            for matrix in matrices:
                for piece in pieces:
                    moved = piece.triangles.transformed(matrix @ state.matrix, prim.GetPath())
                    yield self._budgeted(replace(piece, triangles=moved, group=self.group_of(prim)), prim)

    def _piece(self, prim: Usd.Prim, labels: Labels) -> Piece:
        subsets = UsdGeom.Subset.GetAllGeomSubsets(UsdGeom.Imageable(prim))
        self.visited += [subset.GetPrim() for subset in subsets]
        painted = [s for s in subsets if s.GetFamilyNameAttr().Get() == "materialBind"]
        looks = [self._look(each) for each in (prim, *(s.GetPrim() for s in painted))]
        primvars = self._primvars(prim, looks)
        triangles = self._shape(prim, looks, painted, primvars)
        part = np.full(len(triangles.corners), self._part(labels))
        for subset in subsets:
            own = labels.below(subset.GetPrim())
            if own.part_path != labels.part_path:
                part[self._chosen(subset, triangles, prim)] = self._part(own)
        of = self._painted(painted, triangles, prim)
        found = {primvar.name for primvar in primvars}
        number = {look: self._number(looks[look].material(found)) for look in np.unique(of)}
        return Piece(triangles=triangles, part=part, material=np.array([number[look] for look in of]))

    def _painted(self, subsets: list[UsdGeom.Subset], triangles: Triangles, prim: Usd.Prim) -> Int:
        """For each triangle (T,) the place, from 1, of the subset that gives it a material; 0 for the prim's own."""
        of = np.zeros(len(triangles.source), np.int64)
        for number, subset in enumerate(subsets, 1):
            chosen = self._chosen(subset, triangles, prim)
            if of[chosen].any():
                found = "shares faces with another subset of family materialBind"
                raise StageError(found, where=subset.GetPath(), do="give each face one material")
            of[chosen] = number
        return of

    def _look(self, prim: Usd.Prim) -> Look:
        look = self._looks.of(prim)
        if look.prim and not look.prim.GetPath().HasPrefix(prim.GetPath()):
            self.visited += Usd.PrimRange(look.prim, PROXIES)
        return look

    def _primvars(self, prim: Usd.Prim, looks: list[Look]) -> list[FoundPrimvar]:
        """Those that the looks ask for and the prim has."""
        asked = sorted({item for look in looks for item in look.wanted.items()})
        found = [p for name, channels in asked if (p := find_primvar(prim, name, channels, self.time))]
        self.visited += [primvar.prim for primvar in found if primvar.prim != prim]
        return found

    def _chosen(self, subset: UsdGeom.Subset, triangles: Triangles, prim: Usd.Prim) -> Any:
        """Which triangles (T,) a subset of faces holds."""
        if subset.GetElementTypeAttr().Get() != UsdGeom.Tokens.face:
            return np.zeros(len(triangles.source), bool)
        indices = np.array(subset.GetIndicesAttr().Get(self.time) or [], np.int64)
        counts = UsdGeom.Mesh(prim).GetFaceVertexCountsAttr().Get(self.time) if prim.IsA(UsdGeom.Mesh) else [0]
        bad = (indices < 0) | (indices >= len(counts))
        if bad.any():
            found = f"indices[{int(np.argmax(bad))}] is {indices[np.argmax(bad)]}, but there are {len(counts)} faces"
            raise StageError(found, where=subset.GetPath(), do="mend the subset")
        return np.isin(triangles.source, indices)

    def _shape(
        self, prim: Usd.Prim, looks: list[Look], painted: list[UsdGeom.Subset], primvars: list[FoundPrimvar]
    ) -> Triangles:
        """The prim's triangles in its own axes, displaced; equal instances are read once."""
        path = (prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim).GetPath()
        names = {primvar.name for primvar in primvars}
        amounts = tuple(resolved(look.displacement, names) for look in looks)
        key = (path, amounts, tuple(primvar.key for primvar in primvars))
        if key not in self._shapes:
            read = read_mesh if prim.IsA(UsdGeom.Mesh) else read_gprim
            triangles = read(prim, self.time, primvars)
            of = self._painted(painted, triangles, prim)
            self._shapes[key] = displaced(triangles, of, amounts, prim.GetPath())
        return self._shapes[key]

    def _part(self, labels: Labels) -> int:
        number = self._part_number.setdefault(labels.part_path, len(self._labels))
        if number == len(self._labels):
            self._labels.append(labels)
        return number

    def _number(self, material: Material) -> int:
        return self._materials.setdefault(material, len(self._materials))

    def _count(self, prim: Usd.Prim) -> None:
        self.visited.append(prim)
        if len(self.visited) > MAX_PRIMS:
            raise StageError(f"has more than {MAX_PRIMS} prims", where=self.prim.GetPath(), do="merge meshes")

    def _budgeted(self, piece: Piece, prim: Usd.Prim) -> Piece:
        self._faces += len(piece.part)
        if self._faces > MAX_FACES:
            raise StageError(
                f"brings the target to more than {MAX_FACES} triangles", where=prim.GetPath(), do="simplify it"
            )
        return piece

    def _assembled(self, pieces: list[Piece], metres: float) -> tuple[Mesh, tuple[Part, ...]]:
        """One mesh, and its parts numbered from 1 in order of prim path; parts without a face are left out."""
        part = np.concatenate([piece.part for piece in pieces])
        used = sorted(np.unique(part), key=lambda number: self._labels[number].part_path)
        ids = np.zeros(len(self._labels), np.int64)
        ids[used] = np.arange(1, len(used) + 1)
        first = np.cumsum([0, *(len(piece.triangles.points) for piece in pieces)])
        mesh = Mesh(
            points=np.concatenate([piece.triangles.points for piece in pieces]) * metres,
            faces=np.concatenate([p.triangles.corners + n for p, n in zip(pieces, first, strict=False)]),
            face_part=ids[part],
            face_group=np.concatenate([np.full(len(piece.part), piece.group, np.uint16) for piece in pieces]),
            face_material=np.concatenate([piece.material for piece in pieces]),
            corner_normals=np.concatenate([piece.triangles.normals for piece in pieces]),
            primvars=_primvars(pieces),
        )
        labels = [self._labels[number] for number in used]
        return mesh, tuple(
            Part(id=i, path=x.part_path, name=x.part_name, class_name=x.part_class) for i, x in enumerate(labels, 1)
        )


def _primvars(pieces: list[Piece]) -> dict[str, NDArray[np.float32]]:
    """(F, 3, C) by name, 0 on the pieces that lack one. Raises UnsupportedError for one name of two types."""
    channels: dict[str, int] = {}
    for name, values in (item for piece in pieces for item in piece.triangles.primvars.items()):
        if channels.setdefault(name, values.shape[2]) != values.shape[2]:
            found = f"primvars:{name} has {values.shape[2]} numbers on some of its gprims, {channels[name]} on others"
            raise UnsupportedError(found, do="give one of them another name")
    empty = {name: np.zeros((1, 3, count)) for name, count in channels.items()}
    return {
        name: np.concatenate(
            [
                np.broadcast_to(p.triangles.primvars.get(name, none), (len(p.part), *none.shape[1:])).astype(np.float32)
                for p in pieces
            ]
        )
        for name, none in empty.items()
    }
