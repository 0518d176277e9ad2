"""Pieces of the target: one gprim's triangles, with the part and the material of each, and where they stand."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.arrays import Float
from spin_usd.errors import StageError
from spin_usd.scene.material import Material
from spin_usd.stage.composition.images import Images
from spin_usd.stage.read.materials.preview_surface import MaterialReader, MaterialTemplate, resolved
from spin_usd.stage.read.shapes.displacement import displaced
from spin_usd.stage.read.shapes.mesh import read_mesh
from spin_usd.stage.read.shapes.primitives import read_gprim
from spin_usd.stage.read.shapes.primvars import FoundPrimvar, find_primvar
from spin_usd.stage.read.shapes.skeletons import Skeletons
from spin_usd.stage.read.shapes.triangles import Int, Triangles
from spin_usd.stage.read.target.face_subsets import binds_material, find_subsets, painter_of, triangles_in
from spin_usd.stage.read.target.part_labels import Labels
from spin_usd.stage.usd.notes import Notes
from spin_usd.stage.usd.visibility import PROXIES


@dataclass(frozen=True, kw_only=True, eq=False)
class GprimMesh:
    """Triangles of a gprim in its own axes; which of its piece's parts and materials, from 0, each has (T,); and the
    places of these materials' looks: 0 for the gprim's own, from 1 for its painting subsets'. Equal instances have the
    same object."""

    triangles: Triangles
    part: Int
    material: Int
    looks: tuple[int, ...]

    @cached_property
    def parts(self) -> tuple[int, ...]:
        """Those of its piece's parts that have faces."""
        return tuple(np.unique(self.part).tolist())


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacedGprim:
    """GprimMesh that stand somewhere. parts and materials: their numbers · matrix: row-vector, from the facets' axes to
    the target's · group: the number of its group of links · where: for messages."""

    facets: GprimMesh
    parts: tuple[int, ...]
    materials: tuple[int, ...]
    matrix: Float = field(default_factory=lambda: np.eye(4))
    group: int = 0
    where: object = ""


@dataclass(eq=False)
class GprimReader:
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
    _facets: dict[Any, GprimMesh] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._looks = MaterialReader(time=self.time, images=self.images, notes=self.notes)
        self._skeletons = Skeletons(time=self.time, visited=self.visited)

    def read(self, prim: Usd.Prim, labels: Labels) -> PlacedGprim:
        """The piece of `prim`, which has `labels`, in the gprim's own axes."""
        subsets = find_subsets(prim)
        self.visited += [subset.GetPrim() for subset in subsets]
        painting = [subset for subset in subsets if binds_material(subset)]
        looks = [self._look(each) for each in (prim, *(subset.GetPrim() for subset in painting))]
        primvars = self._primvars(prim, looks)
        below = [(subset, labels.below(subset.GetPrim())) for subset in subsets]
        named = [(subset, own) for subset, own in below if own.part_key != labels.part_key]
        facets = self._read(prim, looks, painting, [subset for subset, _ in named], primvars)
        found = {primvar.name for primvar in primvars}
        return PlacedGprim(
            facets=facets,
            parts=tuple(self._part(each) for each in (labels, *(own for _, own in named))),
            materials=tuple(self._material(looks[place].material(found)) for place in facets.looks),
        )

    def _look(self, prim: Usd.Prim) -> MaterialTemplate:
        look = self._looks.of(prim)
        if look.prim and not look.prim.GetPath().HasPrefix(prim.GetPath()):
            self.visited += Usd.PrimRange(look.prim, PROXIES)
        return look

    def _primvars(self, prim: Usd.Prim, looks: list[MaterialTemplate]) -> list[FoundPrimvar]:
        """Those that the looks ask for and the prim has."""
        asked = sorted({item for look in looks for item in look.wanted.items()})
        found = [p for name, channels in asked if (p := find_primvar(prim, name, channels, self.time))]
        for look in looks:
            look.check_primvars(found)
        self.visited += [primvar.prim for primvar in found if primvar.prim != prim]
        return found

    def _read(
        self,
        prim: Usd.Prim,
        looks: list[MaterialTemplate],
        painting: list[UsdGeom.Subset],
        named: list[UsdGeom.Subset],
        primvars: list[FoundPrimvar],
    ) -> GprimMesh:
        """The prim's triangles, displaced, of which subsets paint some and name some as parts; equal instances are read
        once, but those that skeletons deform, whose animations may differ."""
        deformation = self._skeletons.deformation(prim)
        path = (prim.GetPrimInPrototype() if prim.IsInstanceProxy() and not deformation else prim).GetPath()
        names = {primvar.name for primvar in primvars}
        amounts = tuple(resolved(look.displacement, names) for look in looks)
        parts = tuple(subset.GetPrim().GetName() for subset in named)
        key = (path, amounts, tuple(primvar.key for primvar in primvars), parts)
        if key not in self._facets:
            read = read_mesh if prim.IsA(UsdGeom.Mesh) else read_gprim
            triangles = read(prim, self.time, primvars, deformation)
            painter = painter_of(painting, triangles, prim, self.time)
            triangles = displaced(triangles, painter, amounts, prim.GetPath())
            self._facets[key] = self._facets_of(prim, triangles, painting, named)
        return self._facets[key]

    def _facets_of(
        self, prim: Usd.Prim, triangles: Triangles, painting: list[UsdGeom.Subset], named: list[UsdGeom.Subset]
    ) -> GprimMesh:
        part = np.zeros(len(triangles.corners), np.int64)
        for number, subset in enumerate(named, 1):
            part[triangles_in(subset, triangles, prim, self.time)] = number
        painter = painter_of(painting, triangles, prim, self.time)
        looks, material = np.unique(painter, return_inverse=True)
        return GprimMesh(triangles=triangles, part=part, material=material, looks=tuple(looks.tolist()))

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
