"""Gprims of the target: triangles, with the part and the material of each, and their pose."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.basics.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.geometry.triangles import areas
from spin_usd.scene.material import Material
from spin_usd.stage.composition.images import Images
from spin_usd.stage.read.bodies.face_subsets import (
    binds_material,
    find_subsets,
    named_subsets,
    painter_of,
    triangles_in,
)
from spin_usd.stage.read.bodies.part_labels import Labels
from spin_usd.stage.read.bodies.preview_surface import MaterialReader, MaterialTemplate, resolved
from spin_usd.stage.read.shapes.displacement import displaced
from spin_usd.stage.read.shapes.mesh import read_mesh
from spin_usd.stage.read.shapes.primitives import read_gprim
from spin_usd.stage.read.shapes.primvars import FoundPrimvar, check_elements, find_primvar
from spin_usd.stage.read.shapes.skeletons import Skeletons
from spin_usd.stage.read.shapes.subdivision import note_creases
from spin_usd.stage.read.shapes.triangles import Int, Triangles
from spin_usd.stage.usd.root_metadata import Notes
from spin_usd.stage.usd.visibility import PROXIES

MENDED = {
    "faces-crossing": "polygons cross themselves ({}, {:.2g} % of its area): each is shown as a fan of triangles",
    "normals-turned": "normals contradict the winding of {} faces ({:.3g} % of its area), and are turned",
}


@dataclass(frozen=True, kw_only=True, eq=False)
class GprimMesh:
    """A gprim's triangles in its own axes; equal instances share the object."""

    triangles: Triangles
    part: Int
    """(T,): which of the gprim's parts each triangle has, from 0."""
    material: Int
    """(T,): which of the gprim's materials each triangle has, from 0."""
    painters: tuple[int, ...]
    """Where each material comes from: 0 for the gprim itself, from 1 for its subsets that bind a material."""
    left_out: tuple[int, ...]
    """Likewise of the materials that cannot be seen, whose triangles are not here."""

    @cached_property
    def parts(self) -> tuple[int, ...]:
        """The parts that have faces."""
        return tuple(np.unique(self.part).tolist())


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacedGprim:
    """A gprim's mesh with its pose in the target."""

    mesh: GprimMesh
    parts: tuple[int, ...]
    """Their numbers."""
    materials: tuple[int, ...]
    """Their numbers."""
    matrix: Float = field(default_factory=lambda: np.eye(4))
    """Row-vector, from the gprim's axes to the target's."""
    group: int = 0
    """The number of its light-link group."""
    where: object = ""
    """For messages."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MaterialUse:
    """A material as a gprim has it."""

    prim: Usd.Prim
    """The gprim, or the subset that binds it."""
    primvars: frozenset[str]
    """Primvars of the gprim."""
    amount: Any
    """Amount of displacement."""
    absent: bool
    """Whether its faces are left out."""
    number: int | None
    """As faces have it; None where no face has."""


@dataclass(eq=False)
class GprimReader:
    """Reads gprims at one time, numbering their parts and materials from 0 as they come: `labels` and `materials` are
    the indexed lists; `uses` has each use of a material once. `visited` collects the prims on which the result depends
    besides the gprim; `images` are the stage's. Faces with an invisible material are left out, unless
    `keep_transparent`."""

    time: Usd.TimeCode
    images: Images
    visited: list[Usd.Prim]
    notes: Notes
    keep_transparent: bool = False
    labels: list[Labels] = field(default_factory=list)
    materials: list[Material] = field(default_factory=list)
    uses: dict[tuple[str, frozenset[str]], MaterialUse] = field(default_factory=dict)
    _part_number: dict[tuple[str, str], int] = field(default_factory=dict)
    _material_number: dict[tuple[Material, str], int] = field(default_factory=dict)
    _meshes: dict[Any, GprimMesh] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._templates = MaterialReader(time=self.time, images=self.images, notes=self.notes)
        self._skeletons = Skeletons(time=self.time, visited=self.visited)

    def read(self, prim: Usd.Prim, labels: Labels) -> PlacedGprim | None:
        """Read `prim`, which has `labels`, in its own axes; None where nothing of it can be seen."""
        subsets = find_subsets(prim)
        self.visited += [subset.GetPrim() for subset in subsets]
        painting = [subset for subset in subsets if binds_material(subset)]
        painters = (prim, *(subset.GetPrim() for subset in painting))
        templates = [self._template(each) for each in painters]
        primvars = self._primvars(prim, templates)
        named = named_subsets(prim, labels)
        found = {primvar.name for primvar in primvars}
        materials = [template.material(found) for template in templates]
        absent = tuple(material.absent and not self.keep_transparent for material in materials)
        mesh = self._read(prim, templates, painting, [subset for subset, _ in named], primvars, absent)
        for index in mesh.left_out:
            found_there = "has opacity 0: surfaces of it are left out of labels and pictures"
            self.notes.add("material-transparent", materials[index].path, found_there)
        numbers = {index: self._material(materials[index]) for index in mesh.painters}
        for index, (template, painter) in enumerate(zip(templates, painters, strict=True)):
            amount = resolved(template.displacement, found)
            self._note_use(template, painter, frozenset(found), amount, absent[index], numbers.get(index))
        if not len(mesh.part):
            return None
        return PlacedGprim(
            mesh=mesh,
            parts=tuple(self._part(each) for each in (labels, *(own for _, own in named))),
            materials=tuple(numbers.values()),
        )

    def again(self, uses: Iterable[MaterialUse], before: Sequence[Material]) -> tuple[Material, ...] | None:
        """Read the materials of these `uses` of an earlier time, by their numbers, which were `before` then; None where
        they move other points or show other faces now."""
        found = list(before)
        for use in uses:
            template = self._templates.of(use.prim)
            material = template.material(use.primvars)
            absent = material.absent and not self.keep_transparent
            if absent != use.absent or resolved(template.displacement, use.primvars) != use.amount:
                return None
            if use.number is not None:
                found[use.number] = material
        return tuple(found)

    def _note_use(
        self,
        template: MaterialTemplate,
        prim: Usd.Prim,
        primvars: frozenset[str],
        amount: Any,
        absent: bool,
        number: int | None,
    ) -> None:
        known = self.uses.get((template.path, primvars))
        if known is None or known.number is None:
            use = MaterialUse(prim=prim, primvars=primvars, amount=amount, absent=absent, number=number)
            self.uses[template.path, primvars] = use

    def _template(self, prim: Usd.Prim) -> MaterialTemplate:
        template = self._templates.of(prim)
        if template.prim and not template.prim.GetPath().HasPrefix(prim.GetPath()):
            self.visited += Usd.PrimRange(template.prim, PROXIES)
        return template

    def _primvars(self, prim: Usd.Prim, templates: list[MaterialTemplate]) -> list[FoundPrimvar]:
        """Find the primvars that the materials read and the prim has."""
        asked = sorted({item for template in templates for item in template.primvars.items()})
        found = [p for name, channels in asked if (p := self._primvar(prim, name, channels))]
        for template in templates:
            template.check_primvars(found)
        self.visited += [primvar.prim for primvar in found if primvar.prim != prim]
        return found

    def _primvar(self, prim: Usd.Prim, name: str, channels: int) -> FoundPrimvar | None:
        """Find a primvar; None with a note where it is of another type, or of a wrong count, as Hydra leaves it out."""
        try:
            found = find_primvar(prim, name, channels, self.time)
            if found and prim.IsA(UsdGeom.Mesh):
                check_elements(found, UsdGeom.Mesh(prim), self.time)
        except UnsupportedError as error:
            self.notes.add("primvar-left-out", error.where, f"{error.found}, and is left out")
            return None
        return found

    def _read(
        self,
        prim: Usd.Prim,
        templates: list[MaterialTemplate],
        painting: list[UsdGeom.Subset],
        named: list[UsdGeom.Subset],
        primvars: list[FoundPrimvar],
        absent: tuple[bool, ...],
    ) -> GprimMesh:
        """Read the prim's triangles, displaced. Subsets in `painting` bind a material, those in `named` are parts;
        `absent`: which of the `templates` give an invisible material.
        Equal instances are read once, except those that skeletons deform, whose animations may differ."""
        deformation = self._skeletons.deformation(prim)
        path = (prim.GetPrimInPrototype() if prim.IsInstanceProxy() and not deformation else prim).GetPath()
        names = {primvar.name for primvar in primvars}
        amounts = tuple(resolved(template.displacement, names) for template in templates)
        parts = tuple(subset.GetPrim().GetName() for subset in named)
        key = (path, amounts, tuple(primvar.key for primvar in primvars), parts, absent)
        if key not in self._meshes:
            if prim.IsA(UsdGeom.Mesh):
                note_creases(UsdGeom.Mesh(prim), self.time, self.notes)
            read = read_mesh if prim.IsA(UsdGeom.Mesh) else read_gprim
            triangles = read(prim, self.time, primvars, deformation)
            for code, faces in triangles.mended.items():
                if len(faces):
                    area = areas(triangles.points[triangles.corners])
                    share = 100 * area[np.isin(triangles.source, faces)].sum() / area.sum()
                    self.notes.add(code, path, MENDED[code].format(len(faces), share))
            painter = painter_of(painting, triangles, prim, self.time)
            triangles = displaced(triangles, painter, amounts, prim.GetPath())
            self._meshes[key] = self._mesh_of(prim, triangles, painting, named, absent)
        return self._meshes[key]

    def _mesh_of(
        self,
        prim: Usd.Prim,
        triangles: Triangles,
        painting: list[UsdGeom.Subset],
        named: list[UsdGeom.Subset],
        absent: tuple[bool, ...],
    ) -> GprimMesh:
        part = np.zeros(len(triangles.corners), np.int64)
        for number, subset in enumerate(named, 1):
            part[triangles_in(subset, triangles, prim, self.time)] = number
        painter = painter_of(painting, triangles, prim, self.time)
        left_out = np.array(absent)[painter]
        painters, material = np.unique(painter[~left_out], return_inverse=True)
        return GprimMesh(
            triangles=triangles.kept(~left_out) if left_out.any() else triangles,
            part=part[~left_out],
            material=material,
            painters=tuple(painters.tolist()),
            left_out=tuple(np.unique(painter[left_out]).tolist()),
        )

    def _part(self, labels: Labels) -> int:
        """Return the number of the part that `labels` name. Raises StageError where it has another class elsewhere."""
        number = self._part_number.setdefault(labels.part_key, len(self.labels))
        if number == len(self.labels):
            self.labels.append(labels)
        if (other := self.labels[number]).part_class != labels.part_class:
            found = f"belongs to the merged part {labels.part_name!r} and has the class {labels.part_class!r}"
            do = f"give it the class {other.part_class!r}, as {other.part_path} has, or another part"
            raise StageError(found, where=labels.part_path, do=do)
        return number

    def _material(self, material: Material) -> int:
        number = self._material_number.setdefault((material, material.name), len(self.materials))
        if number == len(self.materials):
            self.materials.append(material)
        return number
