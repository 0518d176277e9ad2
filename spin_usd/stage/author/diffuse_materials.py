"""Any target made diffuse, by opinions over its own materials: Lambertian in their colours, without reflections."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pxr import Sdf, Usd, UsdGeom, UsdShade

from spin_usd.stage.composition.open_stage import open_as_it_is
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.shader_inputs import PREVIEW_SURFACE
from spin_usd.stage.usd.values import read

TYPES = Sdf.ValueTypeNames
# With an index of refraction of 1 a dielectric reflects nothing.
INPUTS: dict[str, tuple[Sdf.ValueTypeName, Any]] = {
    "inputs:clearcoat": (TYPES.Float, 0.0),
    "inputs:ior": (TYPES.Float, 1.0),
    "inputs:metallic": (TYPES.Float, 0.0),
    "inputs:roughness": (TYPES.Float, 1.0),
    "inputs:useSpecularWorkflow": (TYPES.Int, 0),
}
EVERYTHING = Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimIsLoaded & ~Usd.PrimIsAbstract)
DISPLAYED = "Diffuse"
"""The name of the material for gprims that have none of their own but a displayColor."""


@dataclass(frozen=True, kw_only=True)
class DiffuseOverrides:
    """The prims to override so that a target becomes diffuse. Paths are relative to the target's root, "." for the
    root."""

    surfaces: tuple[str, ...]
    """Its UsdPreviewSurface nodes."""
    instances: tuple[str, ...]
    """The instances that hold such nodes, which no opinion can change inside an instance."""
    displayed: bool
    """Whether any of its gprims has no material."""


def find_diffuse_overrides(file: Path, prim: str | None) -> DiffuseOverrides:
    """Find the prims to override in the target in `file`, whose root is `prim`, or the default prim."""
    stage = open_as_it_is(file)
    root = stage.GetPrimAtPath(prim) if prim else stage.GetDefaultPrim()
    prims = list(Usd.PrimRange(root, EVERYTHING))
    surfaces = [each for each in prims if _is_surface(each)]
    above = {path for each in surfaces for path in each.GetPath().GetPrefixes()}
    instances = [each for each in prims if each.IsInstance() and each.GetPath() in above]
    return DiffuseOverrides(
        surfaces=tuple(str(each.GetPath().MakeRelativePath(root.GetPath())) for each in surfaces),
        instances=tuple(str(each.GetPath().MakeRelativePath(root.GetPath())) for each in instances),
        displayed=any(_is_displayed(each) for each in prims),
    )


def author_diffuse_materials(model: Sdf.PrimSpec, displayed: Sdf.Path, overrides: DiffuseOverrides) -> None:
    """Write the opinions over `model`, the target's root within a variant; surfaces without a material get one at
    `displayed`, in the same variant."""
    for path in overrides.instances:
        _below(model, path).instanceable = False
    for path in overrides.surfaces:
        author_diffuse(_below(model, path))
    if overrides.displayed:
        _author_displayed(model.layer, displayed)
        schemas = Sdf.TokenListOp()
        schemas.prependedItems = ["MaterialBindingAPI"]
        model.SetInfo("apiSchemas", schemas)
        binding = Sdf.RelationshipSpec(model, UsdShade.Tokens.materialBinding, custom=False)
        binding.targetPathList.explicitItems = [_composed(displayed)]


def author_diffuse(surface: Sdf.PrimSpec) -> None:
    """Write the opinions over one UsdPreviewSurface."""
    for name, (kind, value) in INPUTS.items():
        spec = Sdf.AttributeSpec(surface, name, kind)
        spec.default = value
        spec.connectionPathList.ClearEditsAndMakeExplicit()  # a texture's connection would beat the number


def _below(model: Sdf.PrimSpec, relative: str) -> Sdf.PrimSpec:
    return Sdf.CreatePrimInLayer(model.layer, model.path.AppendPath(relative)) if relative != "." else model


def _is_surface(prim: Usd.Prim) -> bool:
    return bool(prim.IsA(UsdShade.Shader)) and read(UsdShade.Shader(prim).GetIdAttr()) == PREVIEW_SURFACE


def _is_displayed(prim: Usd.Prim) -> bool:
    """Return whether the prim is a gprim without a material. Keypoints are not rendered."""
    if not prim.IsA(UsdGeom.Gprim) or prim.HasAttribute(schema.KEYPOINT_NAME):
        return False
    return not UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(UsdShade.Tokens.full)[0]


def _author_displayed(layer: Sdf.Layer, path: Sdf.Path) -> None:
    """Author a material of the gprims' own displayColor and displayOpacity; 18 % grey if missing."""
    material = _define(layer, path, "Material")
    shader = _node(material, "Surface", PREVIEW_SURFACE)
    for name, (kind, value) in INPUTS.items():
        Sdf.AttributeSpec(shader, name, kind).default = value
    for name, primvar, of, kind, fallback in (
        ("inputs:diffuseColor", "displayColor", "float3", TYPES.Color3f, (0.18, 0.18, 0.18)),
        ("inputs:opacity", "displayOpacity", "float", TYPES.Float, 1.0),
    ):
        value_type = TYPES.Find(of)
        reader = _node(material, primvar, f"UsdPrimvarReader_{of}")
        Sdf.AttributeSpec(reader, "inputs:varname", TYPES.String).default = primvar
        Sdf.AttributeSpec(reader, "inputs:fallback", value_type).default = fallback
        output = Sdf.AttributeSpec(reader, "outputs:result", value_type)
        Sdf.AttributeSpec(shader, name, kind).connectionPathList.explicitItems = [_composed(output.path)]
    surface = Sdf.AttributeSpec(shader, "outputs:surface", TYPES.Token)
    Sdf.AttributeSpec(material, "outputs:surface", TYPES.Token).connectionPathList.explicitItems = [
        _composed(surface.path)
    ]


def _composed(path: Sdf.Path) -> Sdf.Path:
    return path.StripAllVariantSelections()


def _node(material: Sdf.PrimSpec, name: str, identifier: str) -> Sdf.PrimSpec:
    node = _define(material.layer, material.path.AppendChild(name), "Shader")
    Sdf.AttributeSpec(node, "info:id", TYPES.Token, Sdf.VariabilityUniform).default = identifier
    return node


def _define(layer: Sdf.Layer, path: Sdf.Path, kind: str) -> Sdf.PrimSpec:
    spec = Sdf.CreatePrimInLayer(layer, path)
    spec.specifier, spec.typeName = Sdf.SpecifierDef, kind
    return spec
