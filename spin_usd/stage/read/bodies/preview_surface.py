"""UsdPreviewSurface, as bound to prims.

A material is read once as a template. Its primvar readers give other values on each gprim, so each gprim gets a
Material with the primvars that it has, and the readers' fallbacks for missing ones.
"""

from collections.abc import Sequence, Set
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, UsdShade

from spin_usd.errors import UnsupportedError
from spin_usd.scene.derived.lookup import bounds, extremes
from spin_usd.scene.material import INFINITY, LIMITS, PRESENCE, TRANSPARENT, Limits, Material
from spin_usd.scene.texture import Primvar, Texture
from spin_usd.stage.composition.images import Images
from spin_usd.stage.composition.materialx import document_of
from spin_usd.stage.read.bodies.texture_nodes import NodeReader, PrimvarInput
from spin_usd.stage.read.shapes.primvars import FoundPrimvar, find_primvar
from spin_usd.stage.usd.root_metadata import Notes
from spin_usd.stage.usd.shader_inputs import (
    PREVIEW_SURFACE,
    Output,
    input_path,
    note_lost_connections,
    numbers,
    read_constant,
    read_input,
    read_numbers,
    read_token,
)
from spin_usd.stage.usd.values import read, refuse_outside

NOT_IN_MATERIAL = {
    "occlusion": Limits(name="occlusion"),  # must be valid; a path tracer computes it itself
    "displacement": Limits(name="displacement", low=-INFINITY, high=INFINITY),  # moves the mesh
}
CONSTANT = ("opacityThreshold",)
FACING = (0.0, 0.0, 1.0)
DISPLAYED = {"displayColor": "diffuse_color", "displayOpacity": "opacity"}
SHOWN_INSTEAD = "surfaces with it are rendered in their displayColor, or grey"


@dataclass(frozen=True, kw_only=True, eq=False)
class MaterialTemplate:
    """A material without the values of the gprim's primvars, and the displacement."""

    prim: Usd.Prim | None
    """The material, or the gprim whose displayColor it is."""
    path: str
    fields: dict[str, Any] = field(default_factory=dict)
    """Fields of Material, with PrimvarInput for primvars."""
    displacement: Any = 0.0

    @property
    def primvars(self) -> dict[str, int]:
        """The primvars that the material reads, and how many numbers each must have."""
        return {
            name: n for value in (*self.fields.values(), self.displacement) for name, n in _primvars_of(value).items()
        }

    def check_primvars(self, found: Sequence[FoundPrimvar]) -> None:
        """Raise StageError where one of the gprim's primvars `found` is outside an input's limits."""
        for of, value in self.fields.items():
            for primvar in found:
                if isinstance(value, PrimvarInput) and value.name == primvar.name:
                    refuse_outside(primvar.elements, LIMITS[of], self.path, primvar.where)

    def material(self, found: Set[str]) -> Material:
        """Return the material of a gprim that has the primvars `found`."""
        values = {name: resolved(value, found) for name, value in self.fields.items()}
        if (threshold := values.get("opacity_threshold", 0.0)) > 0 and isinstance(values.get("opacity", 1.0), float):
            opaque = values.get("opacity", 1.0) >= threshold  # a cut-out: all or nothing
            values |= {"opacity": float(opaque), "opacity_threshold": 0.0 if opaque else threshold}
        if values.get("normal") == FACING:
            values["normal"] = None
        return Material(path=self.path, **values)


def resolved(value: Any, found: Set[str]) -> Any:
    """Return `value` for a gprim that has the primvars `found`: no PrimvarInput remains."""
    if isinstance(value, PrimvarInput):
        constant = value.fallback if len(value.fallback) > 1 else value.fallback[0]
        return Primvar(name=value.name) if value.name in found else constant
    if isinstance(value, Texture):
        at = value.coordinates
        if at.primvar in found:
            return replace(value, coordinates=replace(at, constant=(0.0, 0.0)))
        return replace(value, coordinates=replace(at, primvar=None))
    return value


def _primvars_of(value: Any) -> dict[str, int]:
    if isinstance(value, PrimvarInput):
        return {value.name: len(value.fallback)}
    if isinstance(value, Texture) and value.coordinates.primvar is not None:
        return {value.coordinates.primvar: 2}
    return {}


@dataclass(eq=False)
class MaterialReader:
    """Reads the materials of prims at one time, each material once."""

    time: Usd.TimeCode
    images: Images = field(default_factory=Images)
    notes: Notes = field(default_factory=Notes)
    _read: dict[str, MaterialTemplate | None] = field(default_factory=dict)

    def of(self, prim: Usd.Prim) -> MaterialTemplate:
        """Read the material of `prim` (a gprim or a GeomSubset): the bound one, else its displayColor, else grey.

        A material whose surface is not UsdPreviewSurface is noted and ignored. Raises StageError for a binding to a
        missing prim.
        """
        material = bound_material(prim, self.notes)
        template = self._of_material(material) if material else None
        return template or self._displayed(prim.GetParent() if prim.IsA(UsdGeom.Subset) else prim)

    def _of_material(self, material: UsdShade.Material) -> MaterialTemplate | None:
        path = str(material.GetPath())
        if path not in self._read:
            unsupported = unsupported_surface(material)
            if unsupported:
                self.notes.add("material-foreign", path, f"{unsupported}: {SHOWN_INSTEAD}")
            nodes = NodeReader(time=self.time, images=self.images, notes=self.notes)
            self._read[path] = None if unsupported else read_template(material, nodes)
        return self._read[path]

    def _displayed(self, prim: Usd.Prim) -> MaterialTemplate:
        fields = read_display_color(prim, self.time, self.notes)
        if not fields:
            return MaterialTemplate(prim=None, path="")  # the fallbacks: 18 % grey
        return MaterialTemplate(prim=prim, path=f"{prim.GetPath()}.primvars:displayColor", fields=fields)


def read_template(material: UsdShade.Material, nodes: NodeReader) -> MaterialTemplate:
    """Read a material's UsdPreviewSurface, with USD's fallbacks for inputs that are not authored. Inputs that the node
    does not define are ignored, as everywhere in USD."""
    shader, time = _surface(material), nodes.time
    note_lost_connections(shader, nodes.notes)
    read = {of: _value(shader, limits, nodes) for of, limits in {**LIMITS, **NOT_IN_MATERIAL}.items()}
    fields = {of: value for of, value in read.items() if of in LIMITS and value is not None}
    fields["opacity_mode"] = read_token(shader, "opacityMode", time, (TRANSPARENT, PRESENCE), TRANSPARENT)
    fields["use_specular_workflow"] = bool(read_numbers(shader, "useSpecularWorkflow", time, (0,))[0])
    return MaterialTemplate(
        prim=material.GetPrim(),
        path=str(material.GetPath()),
        fields=fields,
        displacement=0.0 if read["displacement"] is None else read["displacement"],
    )


def unsupported_surface(material: UsdShade.Material) -> str:
    """Describe the material's replacement of a UsdPreviewSurface for the universal render context; "" if it has one."""
    shader = material.ComputeSurfaceSource()[0]
    if not shader:
        contexts = [output.GetBaseName() for output in material.GetSurfaceOutputs()]
        return f"has no surface but for the render context {', '.join(contexts)}" if contexts else "has no surface"
    if shader.GetImplementationSource() != UsdShade.Tokens.id:
        return f"its surface {shader.GetPath()} is given by code"
    name = read(shader.GetIdAttr())
    if name == PREVIEW_SURFACE:
        return ""
    return f"its surface {shader.GetPath()} is '{name or ''}', which is not supported"


def _surface(material: UsdShade.Material) -> UsdShade.Shader:
    path = str(material.GetPath())
    shader = material.ComputeSurfaceSource()[0]
    for kind, source in (
        ("displacement", material.ComputeDisplacementSource()[0]),
        ("volume", material.ComputeVolumeSource()[0]),
    ):
        if source and (kind == "volume" or source.GetPath() != shader.GetPath()):
            found = f"its {kind} is made by {source.GetPath()}"
            raise UnsupportedError(found, where=path, do="leave it to UsdPreviewSurface")
    return shader


def _value(shader: UsdShade.Shader, limits: Limits, nodes: NodeReader) -> Any:
    """Read an input: a number, a tuple of them, a Texture, a PrimvarInput; None where nothing is authored."""
    name, where = limits.name, shader.GetPath()
    value = (read_constant if name in CONSTANT else read_input)(shader, name, nodes.time)
    if value is None:
        return None
    if isinstance(value, Output):
        value = nodes.varying(value, limits.size)
    if isinstance(value, Texture):
        low, high = bounds(value).min(), bounds(value).max()
        if not limits.low <= low <= high <= limits.high:
            refuse_outside(extremes(value), limits, where, value.path)
        return value
    if isinstance(value, PrimvarInput):
        refuse_outside(np.array(value.fallback), limits, where, f"the fallback of primvars:{value.name}")
        return value
    found = numbers(value, (0.0,) * limits.size, input_path(shader, name))
    refuse_outside(found, limits, where)
    return float(found[0]) if limits.size == 1 else tuple(float(v) for v in found)


def read_display_color(prim: Usd.Prim, time: Usd.TimeCode, notes: Notes) -> dict[str, Any]:
    """Read fields of Material, with PrimvarInput where they vary over `prim`; none where nothing is authored. Colours
    above 1 are clamped, because they would reflect more light than there is, and noted.

    Raises StageError for numbers that are not valid as a colour or an opacity.
    """
    fields: dict[str, Any] = {}
    for name, of in DISPLAYED.items():
        size = LIMITS[of].size
        primvar = find_primvar(prim, name, size, time)
        if primvar is None:
            continue
        if primvar.clamped:
            notes.add("color-clamped", primvar.where, "holds numbers above 1, which are rendered as 1")
        refuse_outside(primvar.values, Limits(name=name, size=size), primvar.where)
        first = tuple(float(v) for v in primvar.values[0])
        fields[of] = (
            PrimvarInput(name=name, fallback=first) if not primvar.is_constant else first if size > 1 else first[0]
        )
    return fields


def bound_material(prim: Usd.Prim, notes: Notes) -> UsdShade.Material | None:
    """Find the material of `prim`, a gprim or a GeomSubset, by USD's own rules; None if nothing is bound.

    A binding to a prim that is not a material binds nothing, by those rules; it is noted.
    """
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(UsdShade.Tokens.full)
    if material:
        return material
    _note_dangling(prim, notes)
    return None


def _note_dangling(prim: Usd.Prim, notes: Notes) -> None:
    """Note the nearest binding, here or above, to a prim that is not a material: it must not silently become grey."""
    while prim and not prim.IsPseudoRoot():
        for name in ("material:binding", "material:binding:full"):
            relation = prim.GetRelationship(name)
            lost = relation.GetTargets() or _lost_targets(relation) if relation else []
            document = document_of(prim.GetStage(), lost[0]) if lost else ""
            if document:
                notes.add(
                    "material-foreign", lost[0], f"is defined by @{document}@, which is not read: {SHOWN_INSTEAD}"
                )
                return
            if lost:
                notes.add(
                    "material-missing",
                    prim.GetPath(),
                    f"is bound to {lost[0]}, which is not a material: {SHOWN_INSTEAD}",
                )
                return
        prim = prim.GetParent()


def _lost_targets(relation: Usd.Relationship) -> list[Any]:
    """Return the strongest opinion's targets where USD only warns and finds none: paths outside a reference."""
    if relation.GetTargets():
        return []
    specs = [spec for spec in relation.GetPropertyStack(Usd.TimeCode.Default()) if spec.HasInfo("targetPaths")]
    return list(specs[0].targetPathList.GetAddedOrExplicitItems()) if specs else []
