"""UsdPreviewSurface, as bound to prims.

A material is read once; what its primvar readers find differs from gprim to gprim, so each gets the Material with
the primvars that it has, and the readers' fallbacks for those it has not.
"""

from collections.abc import Set
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, UsdShade

from spin_usd.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.scene.material import PRESENCE, TRANSPARENT, Material
from spin_usd.scene.texture import Primvar, Texture
from spin_usd.stage.images import Images
from spin_usd.stage.primvars import find_primvar
from spin_usd.stage.shaders import Output, input_path, node_id, numbers, read_input, read_numbers, read_token
from spin_usd.stage.textures import Nodes, Wanted

COLORS = {"diffuseColor": "diffuse_color", "emissiveColor": "emissive_color", "specularColor": "specular_color"}
FRACTIONS = {
    "metallic": "metallic",
    "roughness": "roughness",
    "clearcoat": "clearcoat",
    "clearcoatRoughness": "clearcoat_roughness",
    "opacity": "opacity",
}
FACING = (0.0, 0.0, 1.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Look:
    """A material apart from what the gprim's primvars decide: `fields` of Material, with Wanted for primvars, and the
    displacement. `prim`: the material, or the gprim whose displayColor it is."""

    prim: Usd.Prim | None
    path: str
    fields: dict[str, Any] = field(default_factory=dict)
    displacement: Any = 0.0

    @property
    def wanted(self) -> dict[str, int]:
        """How many numbers of which primvars it asks for."""
        return {name: n for value in (*self.fields.values(), self.displacement) for name, n in _asked(value).items()}

    def material(self, found: Set[str]) -> Material:
        """On a gprim that has the primvars `found`."""
        values = {name: resolved(value, found) for name, value in self.fields.items()}
        if (threshold := values.get("opacity_threshold", 0.0)) > 0 and isinstance(values.get("opacity", 1.0), float):
            there = values.get("opacity", 1.0) >= threshold  # a cut-out: all or nothing
            values |= {"opacity": float(there), "opacity_threshold": 0.0 if there else threshold}
        if values.get("normal") == FACING:
            values["normal"] = None
        return Material(path=self.path, **values)


def resolved(value: Any, found: Set[str]) -> Any:
    """`value` on a gprim that has the primvars `found`: no Wanted remains."""
    if isinstance(value, Wanted):
        constant = value.fallback if len(value.fallback) > 1 else value.fallback[0]
        return Primvar(name=value.name) if value.name in found else constant
    if isinstance(value, Texture):
        at = value.coordinates
        if at.primvar in found:
            return replace(value, coordinates=replace(at, constant=(0.0, 0.0)))
        return replace(value, coordinates=replace(at, primvar=None))
    return value


def _asked(value: Any) -> dict[str, int]:
    if isinstance(value, Wanted):
        return {value.name: len(value.fallback)}
    if isinstance(value, Texture) and value.coordinates.primvar is not None:
        return {value.coordinates.primvar: 2}
    return {}


@dataclass(eq=False)
class Looks:
    """Reads what prims are made of at one time, each material once."""

    time: Usd.TimeCode
    images: Images = field(default_factory=Images)
    _read: dict[str, Look] = field(default_factory=dict)

    def of(self, prim: Usd.Prim) -> Look:
        """What `prim` (a gprim or a GeomSubset) is made of: its bound material, else its displayColor, else grey.

        Raises StageError for a binding to nothing, UnsupportedError for what is not UsdPreviewSurface.
        """
        material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(UsdShade.Tokens.full)
        if not material:
            _refuse_dangling(prim)
            return _display_look(prim.GetParent() if prim.IsA(UsdGeom.Subset) else prim, self.time)
        path = str(material.GetPath())
        if path not in self._read:
            self._read[path] = read_look(material, Nodes(time=self.time, images=self.images))
        return self._read[path]


def read_look(material: UsdShade.Material, nodes: Nodes) -> Look:
    """A material's UsdPreviewSurface; USD's fallbacks for what is not authored. Inputs that the node does not define
    mean nothing, as everywhere in USD."""
    shader, time = _surface(material), nodes.time
    fields: dict[str, Any] = {}
    for name, of in (*COLORS.items(), *FRACTIONS.items(), ("ior", "ior"), ("normal", "normal")):
        value = _value(shader, name, 3 if name in COLORS or name == "normal" else 1, nodes)
        if value is not None:
            fields[of] = value
    fields["opacity_threshold"] = _checked(
        read_numbers(shader, "opacityThreshold", time, (0,)), "opacityThreshold", shader
    )
    fields["opacity_mode"] = read_token(shader, "opacityMode", time, (TRANSPARENT, PRESENCE), TRANSPARENT)
    fields["use_specular_workflow"] = bool(read_numbers(shader, "useSpecularWorkflow", time, (0,))[0])
    _value(shader, "occlusion", 1, nodes)  # must be sound; a path tracer computes it itself
    displacement = _value(shader, "displacement", 1, nodes)
    return Look(
        prim=material.GetPrim(),
        path=str(material.GetPath()),
        fields=fields,
        displacement=0.0 if displacement is None else displacement,
    )


def _surface(material: UsdShade.Material) -> UsdShade.Shader:
    path = str(material.GetPath())
    shader = material.ComputeSurfaceSource()[0]
    if not shader:
        do = "add UsdPreviewSurface"
        raise UnsupportedError("has no surface for the universal render context", where=path, do=do)
    if node_id(shader) != "UsdPreviewSurface":
        found = f"its surface {shader.GetPath()} is '{node_id(shader)}'"
        raise UnsupportedError(found, where=path, do="use UsdPreviewSurface")
    for kind, source in (
        ("displacement", material.ComputeDisplacementSource()[0]),
        ("volume", material.ComputeVolumeSource()[0]),
    ):
        if source and (kind == "volume" or source.GetPath() != shader.GetPath()):
            found = f"its {kind} is made by {source.GetPath()}"
            raise UnsupportedError(found, where=path, do="leave it to UsdPreviewSurface")
    return shader


def _value(shader: UsdShade.Shader, name: str, channels: int, nodes: Nodes) -> Any:
    """A number, a tuple of them, a Texture, a Wanted; None where nothing is authored."""
    value = read_input(shader, name, nodes.time)
    if value is None:
        return None
    if isinstance(value, Output):
        value = nodes.varying(value, channels)
        if not isinstance(value, tuple):
            return value
    return _checked(numbers(value, (0.0,) * channels, input_path(shader, name)), name, shader)


def _checked(values: Float, name: str, shader: UsdShade.Shader) -> Any:
    """A number, or a tuple of them, within what the input means."""
    low = -np.inf if name in ("normal", "displacement") else 0
    high = 1 if name in (*FRACTIONS, "opacityThreshold", "occlusion") else np.inf
    if (values < low).any() or (values > high).any():
        wrong = values[(values < low) | (values > high)][0]
        do = "keep it between 0 and 1" if high == 1 else "make it not negative"
        raise StageError(f"its {name} is {wrong:g}", where=shader.GetPath(), do=do)
    return float(values[0]) if len(values) == 1 else tuple(float(v) for v in values)


def _display_look(prim: Usd.Prim, time: Usd.TimeCode) -> Look:
    fields: dict[str, Any] = {}
    for name, of, channels in (("displayColor", "diffuse_color", 3), ("displayOpacity", "opacity", 1)):
        primvar = find_primvar(prim, name, channels, time)
        if primvar is None:
            continue
        bad = (primvar.values < 0) | (primvar.values > (1 if name == "displayOpacity" else np.inf))
        if bad.any():
            do = "keep it between 0 and 1" if name == "displayOpacity" else "make it not negative"
            raise StageError(f"its {name} is {primvar.values[bad][0]:g}", where=primvar.where, do=do)
        one = primvar.one
        first = tuple(float(v) for v in primvar.values[0])
        fields[of] = Wanted(name=name, fallback=first) if not one else first if channels > 1 else first[0]
    if not fields:
        return Look(prim=None, path="")  # the fallbacks: 18 % grey
    return Look(prim=prim, path=f"{prim.GetPath()}.primvars:displayColor", fields=fields)


def _refuse_dangling(prim: Usd.Prim) -> None:
    """A binding, here or above, to a prim that is no material must not turn into grey."""
    while prim and not prim.IsPseudoRoot():
        for name in ("material:binding", "material:binding:full"):
            relation = prim.GetRelationship(name)
            lost = relation.GetTargets() or lost_targets(relation) if relation else []
            if lost:
                found = f"is bound to {lost[0]}, which is no material"
                raise StageError(
                    found, where=prim.GetPath(), do="bind a material that exists within what is referenced"
                )
        prim = prim.GetParent()


def lost_targets(relation: Usd.Relationship) -> list[Any]:
    """What the strongest opinion targets where USD, with a mere warning, finds no target: paths outside a reference."""
    if relation.GetTargets():
        return []
    specs = [spec for spec in relation.GetPropertyStack(Usd.TimeCode.Default()) if spec.HasInfo("targetPaths")]
    return list(specs[0].targetPathList.GetAddedOrExplicitItems()) if specs else []
