"""Pieces of the target: one gprim's triangles, with the part and the material of each."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.errors import StageError
from spin_usd.scene.material import Material
from spin_usd.stage.displacement import displaced
from spin_usd.stage.drawn import PROXIES
from spin_usd.stage.gprims import read_gprim
from spin_usd.stage.images import Images
from spin_usd.stage.materials import Look, Looks, resolved
from spin_usd.stage.meshes import read_mesh
from spin_usd.stage.notes import Notes
from spin_usd.stage.parts import Labels
from spin_usd.stage.primvars import FoundPrimvar, find_primvar
from spin_usd.stage.skeletons import Skeletons
from spin_usd.stage.subsets import binds_material, find_subsets, painter_of, triangles_in
from spin_usd.stage.triangles import Int, Triangles


@dataclass(frozen=True, kw_only=True, eq=False)
class Piece:
    """Triangles of one gprim, with the number of the part and of the material of each, and of its group of links."""

    triangles: Triangles
    part: Int
    material: Int
    group: int = 0


@dataclass(eq=False)
class PieceReader:
    """Reads gprims at one time, numbering their parts and materials from 0 as they come: `labels` and `materials` are
    what the numbers stand for. `visited` collects the prims that a piece depends on besides its gprim; `images` are
    the stage's."""

    time: Usd.TimeCode
    images: Images
    visited: list[Usd.Prim]
    notes: Notes
    labels: list[Labels] = field(default_factory=list)
    materials: dict[Material, int] = field(default_factory=dict)
    _part_number: dict[tuple[str, str], int] = field(default_factory=dict)
    _shapes: dict[Any, Triangles] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._looks = Looks(time=self.time, images=self.images, notes=self.notes)
        self._skeletons = Skeletons(time=self.time, visited=self.visited)

    def read(self, prim: Usd.Prim, labels: Labels) -> Piece:
        """The piece of `prim`, which has `labels`, in the gprim's own axes."""
        subsets = find_subsets(prim)
        self.visited += [subset.GetPrim() for subset in subsets]
        painting = [subset for subset in subsets if binds_material(subset)]
        looks = [self._look(each) for each in (prim, *(subset.GetPrim() for subset in painting))]
        primvars = self._primvars(prim, looks)
        triangles = self._shape(prim, looks, painting, primvars)
        part = np.full(len(triangles.corners), self._part(labels))
        for subset in subsets:
            own = labels.below(subset.GetPrim())
            if own.part_key != labels.part_key:
                part[triangles_in(subset, triangles, prim, self.time)] = self._part(own)
        painter = painter_of(painting, triangles, prim, self.time)
        found = {primvar.name for primvar in primvars}
        number = {place: self._material(looks[place].material(found)) for place in np.unique(painter)}
        return Piece(triangles=triangles, part=part, material=np.array([number[place] for place in painter]))

    def _look(self, prim: Usd.Prim) -> Look:
        look = self._looks.of(prim)
        if look.prim and not look.prim.GetPath().HasPrefix(prim.GetPath()):
            self.visited += Usd.PrimRange(look.prim, PROXIES)
        return look

    def _primvars(self, prim: Usd.Prim, looks: list[Look]) -> list[FoundPrimvar]:
        """Those that the looks ask for and the prim has."""
        asked = sorted({item for look in looks for item in look.wanted.items()})
        found = [p for name, channels in asked if (p := find_primvar(prim, name, channels, self.time))]
        for look in looks:
            look.check_primvars(found)
        self.visited += [primvar.prim for primvar in found if primvar.prim != prim]
        return found

    def _shape(
        self, prim: Usd.Prim, looks: list[Look], painting: list[UsdGeom.Subset], primvars: list[FoundPrimvar]
    ) -> Triangles:
        """The prim's triangles in its own axes, displaced; equal instances are read once, but those that skeletons
        deform, whose animations may differ."""
        deformation = self._skeletons.deformation(prim)
        path = (prim.GetPrimInPrototype() if prim.IsInstanceProxy() and not deformation else prim).GetPath()
        names = {primvar.name for primvar in primvars}
        amounts = tuple(resolved(look.displacement, names) for look in looks)
        key = (path, amounts, tuple(primvar.key for primvar in primvars))
        if key not in self._shapes:
            read = read_mesh if prim.IsA(UsdGeom.Mesh) else read_gprim
            triangles = read(prim, self.time, primvars, deformation)
            painter = painter_of(painting, triangles, prim, self.time)
            self._shapes[key] = displaced(triangles, painter, amounts, prim.GetPath())
        return self._shapes[key]

    def _part(self, labels: Labels) -> int:
        """The number of the part that `labels` name. Raises StageError where it has another class elsewhere."""
        number = self._part_number.setdefault(labels.part_key, len(self.labels))
        if number == len(self.labels):
            self.labels.append(labels)
        if (other := self.labels[number]).part_class != labels.part_class:
            found = f"is of the merged part {labels.part_name!r} and the class {labels.part_class!r}"
            do = f"give it the class {other.part_class!r}, as {other.part_path} has, or another part"
            raise StageError(found, where=labels.part_path, do=do)
        return number

    def _material(self, material: Material) -> int:
        return self.materials.setdefault(material, len(self.materials))
