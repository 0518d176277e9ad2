"""A target with materials of the library: layers over its asset, with the looks matt and reflective as Tango has them.

A layer beside the asset's folder refers to it, and in its looks to the materials, which surface has which, and texture
coordinates. In the look matt all that the target has is diffuse.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Sdf, Usd, UsdGeom

from spin_usd.errors import InputError
from spin_usd.scene.name_rule import Color
from spin_usd.stage.author.diffuse_materials import DISPLAYED, author_diffuse_materials, find_diffuse_overrides
from spin_usd.stage.author.material_library import copy_material, shader_inputs
from spin_usd.stage.author.model_surfaces import ModelSurface, model_surfaces
from spin_usd.stage.author.target_asset import TargetAsset, describe
from spin_usd.stage.author.texture_coordinates import author_coordinates
from spin_usd.stage.composition.open_layer import stage_on
from spin_usd.stage.composition.open_stage import open_as_it_is
from spin_usd.stage.read.bodies.face_subsets import binds_material, find_subsets
from spin_usd.stage.usd.layer_file import author_metadata, export
from spin_usd.stage.usd.values import array
from spin_usd.unique_names import UniqueNames

LOOK, MATT, REFLECTIVE = "look", "matt", "reflective"
MATERIALS, SURFACE, PREVIEW_SURFACE = "Materials", "Surface", "UsdPreviewSurface"
"""The scope of the materials, and the node of each: its name, as the library has it, and what it is."""
BINDING, FOR_ONE_PURPOSE = "material:binding", ("material:binding:full", "material:binding:preview")
"""Of a material, and those that beat it for one purpose."""
TYPES = Sdf.ValueTypeNames
TIME = Usd.TimeCode.EarliestTime()


@dataclass(frozen=True, kw_only=True)
class Finish:
    """How a surface is finished."""

    material: str
    """Of the library."""
    color: Color | None = None
    """None for the material's own."""
    scale: float = 1.0
    """Of its pattern."""


def surfaces_of(asset: TargetAsset) -> Iterator[ModelSurface]:
    """Yield the surfaces of an asset that have faces: of a gprim whose faces its subsets share, these alone."""
    stage = open_as_it_is(asset.file)
    root = _root_of(stage, asset)
    return (each for each in model_surfaces(root, root) if not _is_shared(stage.GetPrimAtPath(each.path)))


def _is_shared(prim: Usd.Prim) -> bool:
    if not prim.IsA(UsdGeom.Mesh) or not (subsets := [each for each in find_subsets(prim) if binds_material(each)]):
        return False
    held = sum(len(array(each.GetIndicesAttr(), TIME, np.int64)) for each in subsets)
    return held >= len(array(UsdGeom.Mesh(prim).GetFaceVertexCountsAttr(), TIME, np.int64))


def write_looks(
    asset: TargetAsset, finishes: Mapping[ModelSurface, Finish], *, rich_alone: bool = False
) -> TargetAsset:
    """Write layers over the `asset` that give its surfaces these finishes; return the asset that they are. With
    `rich_alone` they have them in the look REFLECTIVE alone, which is not selected.

    Raises InputError for a target whose variant set LOOK has other variants, OutputError.
    """
    own = asset.variants.get(LOOK, (MATT, REFLECTIVE))
    if not {MATT, REFLECTIVE} <= set(own):
        found = f"has the variant set {LOOK} of {', '.join(own)}, where its looks {MATT} and {REFLECTIVE} would stand"
        raise InputError(found, where=asset.file.name, do="rename that set, or leave --materials out")
    stage = open_as_it_is(asset.file)
    root = _root_of(stage, asset)
    file, folder = (asset.file.parent.with_name(f"{asset.file.parent.name}{ending}") for ending in (".usda", "_looks"))
    names = UniqueNames(cased=True, taken=root.GetAllChildrenNames())
    finished = Sdf.Layer.CreateAnonymous(".usda")
    author_metadata(finished, default_prim=root.GetName(), documentation="Which surface has which material.")
    finished.subLayerPaths = ["./coordinates.usdc"]
    made = Sdf.CreatePrimInLayer(finished, Sdf.Path.absoluteRootPath.AppendChild(root.GetName()))
    scope = _define(made, names.give(MATERIALS), "Scope")
    materials = {each: _author_finish(scope, each) for each in sorted(set(finishes.values()), key=str)}
    for surface, finish in finishes.items():
        place = surface.path.ReplacePrefix(root.GetPath(), made.path)
        for instance in surface.instances:
            above = instance.ReplacePrefix(root.GetPath(), made.path)
            Sdf.CreatePrimInLayer(finished, above).instanceable = False
        _bind(Sdf.CreatePrimInLayer(finished, place), stage.GetPrimAtPath(surface.path), materials[finish].path)
    for material in {finish.material for finish in finishes.values()}:
        copy_material(material, folder)
    export(_coordinates(root, finishes, asset.metres_per_unit), folder / "coordinates.usdc")
    export(finished, folder / "finishes.usda")
    layer = Sdf.Layer.CreateAnonymous(".usda")
    documentation = f"{asset.name} in the looks {MATT} and {REFLECTIVE}, which has materials of the library."
    author_metadata(layer, default_prim=root.GetName(), documentation=documentation)
    layer.pseudoRoot.SetInfo("upAxis", UsdGeom.GetStageUpAxis(stage))
    layer.pseudoRoot.SetInfo("metersPerUnit", asset.metres_per_unit)
    interface = Sdf.CreatePrimInLayer(layer, made.path)
    interface.specifier = Sdf.SpecifierDef
    interface.referenceList.Prepend(Sdf.Reference(f"./{asset.file.parent.name}/{asset.file.name}", root.GetPath()))
    interface.variantSetNameList.Prepend(LOOK)
    matt, rich = (Sdf.CreateVariantInLayer(layer, made.path, LOOK, name).primSpec for name in (MATT, REFLECTIVE))
    for look in (rich,) if rich_alone else (matt, rich):
        look.referenceList.Prepend(Sdf.Reference(f"./{folder.name}/finishes.usda"))
    diffuse = find_diffuse_overrides(asset.file, asset.prim)
    if not rich_alone:
        interface.variantSelections[LOOK] = REFLECTIVE
        surfaces = [str(each.path.AppendChild(SURFACE).MakeRelativePath(made.path)) for each in materials.values()]
        diffuse = replace(diffuse, surfaces=(*diffuse.surfaces, *surfaces))
        _smooth(matt, made, materials)
    author_diffuse_materials(matt, matt.path.AppendChild(names.give(DISPLAYED)), diffuse)
    export(layer, file)
    return replace(describe(file, asset.name), source_prim=asset.source_prim, notes=asset.notes, up=asset.up)


def _root_of(stage: Usd.Stage, asset: TargetAsset) -> Usd.Prim:
    return stage.GetPrimAtPath(asset.prim) if asset.prim else stage.GetDefaultPrim()


def _author_finish(scope: Sdf.PrimSpec, finish: Finish) -> Sdf.PrimSpec:
    """Author a material over that of the library, whose layer is beside this one."""
    names = UniqueNames(taken=[each.name for each in scope.nameChildren])
    made = _define(scope, names.give(finish.material), "Material")
    made.referenceList.Prepend(Sdf.Reference(f"./{finish.material}.usda"))
    if finish.color is not None:
        color = Sdf.AttributeSpec(_over(made, SURFACE), "inputs:diffuseColor", TYPES.Color3f)
        color.default = Gf.Vec3f(*finish.color)
        color.connectionPathList.ClearEditsAndMakeExplicit()
    if finish.scale != 1:
        for shader, inputs in shader_inputs(finish.material, "UsdTransform2d").items():
            scale = Sdf.AttributeSpec(_over(made, shader), "inputs:scale", TYPES.Float2)
            scale.default = inputs["inputs:scale"] / finish.scale
    return made


def _bind(prim: Sdf.PrimSpec, surface: Usd.Prim, material: Sdf.Path) -> None:
    """Bind a material on `prim`, over what the `surface` has."""
    prim.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=["MaterialBindingAPI"]))
    Sdf.RelationshipSpec(prim, BINDING, custom=False).targetPathList.explicitItems = [material]
    for name in FOR_ONE_PURPOSE:
        if surface.HasRelationship(name):
            Sdf.RelationshipSpec(prim, name, custom=False).targetPathList.ClearEditsAndMakeExplicit()


def _smooth(matt: Sdf.PrimSpec, root: Sdf.PrimSpec, materials: Mapping[Finish, Sdf.PrimSpec]) -> None:
    """Leave out the normal maps of the materials in the look `matt`."""
    for finish, material in materials.items():
        if "inputs:normal" in shader_inputs(finish.material, PREVIEW_SURFACE)[SURFACE]:
            path = material.path.AppendChild(SURFACE).ReplacePrefix(root.path, matt.path)
            normal = Sdf.AttributeSpec(Sdf.CreatePrimInLayer(matt.layer, path), "inputs:normal", TYPES.Normal3f)
            normal.connectionPathList.ClearEditsAndMakeExplicit()


def _coordinates(root: Usd.Prim, surfaces: Iterable[ModelSurface], metres_per_unit: float) -> Sdf.Layer:
    """Make an anonymous layer with texture coordinates for the `surfaces` of the asset whose root is `root`."""
    layer = Sdf.Layer.CreateAnonymous(".usdc")
    author_metadata(layer, default_prim=root.GetName(), documentation="Texture coordinates, metres.")
    over = stage_on(layer)
    chosen: dict[Sdf.Path, list[Usd.Prim]] = {}
    for surface in surfaces:
        prim = root.GetStage().GetPrimAtPath(surface.path)
        gprim = prim.GetParent() if prim.IsA(UsdGeom.Subset) else prim
        chosen.setdefault(gprim.GetPath(), []).append(prim)
    cache = UsdGeom.XformCache(TIME)
    to_body = cache.GetParentToWorldTransform(root).GetInverse()
    for path, prims in chosen.items():
        gprim = root.GetStage().GetPrimAtPath(path)
        matrix = np.array(cache.GetLocalToWorldTransform(gprim) * to_body)
        matrix[:, :3] *= metres_per_unit
        place = path.ReplacePrefix(root.GetPath(), Sdf.Path.absoluteRootPath.AppendChild(root.GetName()))
        author_coordinates(over.OverridePrim(place), gprim, _faces(gprim, prims), matrix)
    return layer


def _faces(gprim: Usd.Prim, prims: Sequence[Usd.Prim]) -> NDArray[np.int64] | None:
    """Return the faces of a gprim that `prims` are: subsets of it, or itself, which is what no subset takes; None for
    all faces."""
    subsets = [each for each in find_subsets(gprim) if binds_material(each)]
    faces = {each.GetPath(): array(each.GetIndicesAttr(), TIME, np.int64) for each in subsets}
    if gprim not in prims:
        return np.concatenate([faces[each.GetPath()] for each in prims])
    others = [held for path, held in faces.items() if path not in {each.GetPath() for each in prims}]
    if not others:
        return None
    count = len(array(UsdGeom.Mesh(gprim).GetFaceVertexCountsAttr(), TIME, np.int64))
    return np.setdiff1d(np.arange(count), np.concatenate(others))


def _define(parent: Sdf.PrimSpec, name: str, kind: str) -> Sdf.PrimSpec:
    return Sdf.PrimSpec(parent, name, Sdf.SpecifierDef, kind)


def _over(parent: Sdf.PrimSpec, name: str) -> Sdf.PrimSpec:
    return Sdf.PrimSpec(parent, name, Sdf.SpecifierOver)
