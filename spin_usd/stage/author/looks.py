"""A target with materials of the library: layers over its asset, with the looks matt and reflective as Tango has them.

A layer beside the asset's folder refers to it, and in its looks to the materials, which surface has which, and texture
coordinates. In the look matt all that the target has is diffuse.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

from spin_usd.basics.unique_names import UniqueNames
from spin_usd.errors import InputError
from spin_usd.scene.name_rule import Color
from spin_usd.stage.author.diffuse_materials import DISPLAYED, author_diffuse_materials, find_diffuse_overrides
from spin_usd.stage.author.material_library import SURFACE, author_matt, copy_material, shader_inputs
from spin_usd.stage.author.model_surfaces import ModelSurface, model_surfaces
from spin_usd.stage.author.target_asset import TargetAsset, describe
from spin_usd.stage.author.texture_coordinates import author_coordinates
from spin_usd.stage.composition.open_layer import stage_on
from spin_usd.stage.composition.open_stage import open_as_it_is
from spin_usd.stage.read.bodies.face_subsets import binds_material, find_subsets
from spin_usd.stage.usd.layer_file import author_metadata, export
from spin_usd.stage.usd.values import array

LOOK, MATT, REFLECTIVE = "look", "matt", "reflective"
MATERIALS = "Materials"
"""The scope of the materials."""
BINDING = "material:binding"
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


def takes_looks(asset: TargetAsset) -> bool:
    """Return whether the target has no variant set LOOK, or one of MATT and REFLECTIVE."""
    return {MATT, REFLECTIVE} <= set(asset.variants.get(LOOK, (MATT, REFLECTIVE)))


def write_looks(
    asset: TargetAsset,
    finishes: Mapping[ModelSurface, Finish],
    kept: Iterable[ModelSurface] = (),
    *,
    rich_alone: bool = False,
) -> TargetAsset:
    """Write layers over the `asset` that give its surfaces these finishes, except those `kept`; return the new asset.
    With `rich_alone` only the look REFLECTIVE, which is not selected, has them.

    Raises InputError for a target whose variant set LOOK has other variants, OutputError.
    """
    if not takes_looks(asset):
        own = ", ".join(asset.variants[LOOK])
        found = f"has the variant set {LOOK} of {own}, where its looks {MATT} and {REFLECTIVE} would stand"
        raise InputError(found, where=asset.file.name, do="rename that set, or leave --materials out")
    stage = open_as_it_is(asset.file)
    root = _root_of(stage, asset)
    file, folder = (asset.file.parent.with_name(f"{asset.file.parent.name}{ending}") for ending in (".usda", "_looks"))
    names = UniqueNames(cased=True, taken=root.GetAllChildrenNames())
    finished = _Finished(root, names.give(MATERIALS))
    for surface, finish in finishes.items():
        finished.bind(surface, finished.material(finish))
    for surface in kept:
        finished.keep(surface)
    for name in sorted({finish.material for finish in finishes.values()}):
        copy_material(name, folder)
    export(_coordinates(root, finishes, asset.metres_per_unit), folder / "coordinates.usdc")
    export(finished.layer, folder / "finishes.usda")
    layer, path = _interface(asset, root), finished.root.path
    matt, rich = (Sdf.CreateVariantInLayer(layer, path, LOOK, each).primSpec for each in (MATT, REFLECTIVE))
    for look in (rich,) if rich_alone else (matt, rich):
        look.referenceList.Prepend(Sdf.Reference(f"./{folder.name}/finishes.usda"))
    if not rich_alone:
        layer.GetPrimAtPath(path).variantSelections[LOOK] = REFLECTIVE
        for finish, material in finished.materials.items():
            surface_path = material.path.AppendChild(SURFACE).ReplacePrefix(path, matt.path)
            author_matt(Sdf.CreatePrimInLayer(layer, surface_path), finish.material)
    overrides = find_diffuse_overrides(asset.file, asset.prim)
    author_diffuse_materials(matt, matt.path.AppendChild(names.give(DISPLAYED)), overrides)
    export(layer, file)
    made = describe(file, asset.name)
    return replace(made, source_prim=asset.source_prim, notes=asset.notes, left_out=asset.left_out, up=asset.up)


def _interface(asset: TargetAsset, root: Usd.Prim) -> Sdf.Layer:
    """Make an anonymous layer whose default prim refers to the `root` of the asset."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    documentation = f"{asset.name} in the looks {MATT} and {REFLECTIVE}, which has materials of the library."
    author_metadata(layer, default_prim=root.GetName(), documentation=documentation)
    layer.pseudoRoot.SetInfo("upAxis", UsdGeom.GetStageUpAxis(root.GetStage()))
    layer.pseudoRoot.SetInfo("metersPerUnit", asset.metres_per_unit)
    prim = _define(layer, root.GetName())
    prim.referenceList.Prepend(Sdf.Reference(f"./{asset.file.parent.name}/{asset.file.name}", root.GetPath()))
    prim.variantSetNameList.Prepend(LOOK)
    return layer


class _Finished:
    """The layer that binds a material to each surface of a model."""

    def __init__(self, root: Usd.Prim, scope: str) -> None:
        """`root`: the model's; `scope`: name of the materials' scope."""
        self.layer = Sdf.Layer.CreateAnonymous(".usda")
        author_metadata(self.layer, default_prim=root.GetName(), documentation="Which surface has which material.")
        self.layer.subLayerPaths = ["./coordinates.usdc"]
        self._model, self._names = root, UniqueNames()
        self.root = Sdf.CreatePrimInLayer(self.layer, Sdf.Path.absoluteRootPath.AppendChild(root.GetName()))
        self._scope = _define(self.root, scope, "Scope")
        self.materials: dict[Finish, Sdf.PrimSpec] = {}

    def material(self, finish: Finish) -> Sdf.Path:
        """Return the path of the material of that finish, over the library's, whose layer is beside this one."""
        if finish not in self.materials:
            made = self.materials[finish] = _define(self._scope, self._names.give(finish.material), "Material")
            made.referenceList.Prepend(Sdf.Reference(f"./{finish.material}.usda"))
            _author_finish(made, finish)
        return self.materials[finish].path

    def bind(self, surface: ModelSurface, material: Sdf.Path) -> None:
        """Bind a material to the surface, over all that the model binds to it."""
        for instance in surface.instances:
            self._over(instance).instanceable = False
        names = (BINDING, *surface.purposes)  # a material for one purpose beats one for all, wherever it is bound
        for group, name in product(surface.overruling, names):
            weaker = _binding(self._over(group), name)
            weaker.SetInfo(UsdShade.Tokens.bindMaterialAs, UsdShade.Tokens.weakerThanDescendants)
        prim = self._over(surface.path)
        prim.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=["MaterialBindingAPI"]))
        for name in names:
            _binding(prim, name).targetPathList.explicitItems = [material]

    def keep(self, surface: ModelSurface) -> None:
        """Keep the surface's material if it came from a group above it that no longer gives it."""
        if surface.bound and any(self.layer.GetPrimAtPath(self._place(group)) for group in surface.overruling):
            self.bind(surface, self._place(surface.bound))

    def _over(self, path: Sdf.Path) -> Sdf.PrimSpec:
        return Sdf.CreatePrimInLayer(self.layer, self._place(path))

    def _place(self, path: Sdf.Path) -> Sdf.Path:
        return path.ReplacePrefix(self._model.GetPath(), self.root.path)


def _root_of(stage: Usd.Stage, asset: TargetAsset) -> Usd.Prim:
    return stage.GetPrimAtPath(asset.prim) if asset.prim else stage.GetDefaultPrim()


def _author_finish(made: Sdf.PrimSpec, finish: Finish) -> None:
    """Author a finish's own colour and scale over the material `made`."""
    if finish.color is not None:
        color = Sdf.AttributeSpec(_over(made, SURFACE), "inputs:diffuseColor", TYPES.Color3f)
        color.default = Gf.Vec3f(*finish.color)
        color.connectionPathList.ClearEditsAndMakeExplicit()
    if finish.scale != 1:
        for shader, inputs in shader_inputs(finish.material, "UsdTransform2d").items():
            scale = Sdf.AttributeSpec(_over(made, shader), "inputs:scale", TYPES.Float2)
            scale.default = inputs["inputs:scale"] / finish.scale


def _binding(prim: Sdf.PrimSpec, name: str) -> Sdf.RelationshipSpec:
    return prim.relationships.get(name) or Sdf.RelationshipSpec(prim, name, custom=False)


def _coordinates(root: Usd.Prim, surfaces: Iterable[ModelSurface], metres_per_unit: float) -> Sdf.Layer:
    """Make an anonymous layer with texture coordinates for the `surfaces` of the asset whose root is `root`."""
    layer = Sdf.Layer.CreateAnonymous(".usdc")
    author_metadata(layer, default_prim=root.GetName(), documentation="Texture coordinates, metres.")
    place = Sdf.Path.absoluteRootPath.AppendChild(root.GetName())
    chosen: dict[Sdf.Path, list[Usd.Prim]] = {}
    for surface in surfaces:
        prim = root.GetStage().GetPrimAtPath(surface.path)
        gprim = prim.GetParent() if prim.IsA(UsdGeom.Subset) else prim
        chosen.setdefault(gprim.GetPath(), []).append(prim)
    with Sdf.ChangeBlock():  # at once: a stage takes longer for each prim the more siblings it has
        for path in chosen:
            Sdf.CreatePrimInLayer(layer, path.ReplacePrefix(root.GetPath(), place))
    over, cache = stage_on(layer), UsdGeom.XformCache(TIME)
    to_body = cache.GetParentToWorldTransform(root).GetInverse()
    for path, prims in chosen.items():
        gprim = root.GetStage().GetPrimAtPath(path)
        matrix = np.array(cache.GetLocalToWorldTransform(gprim) * to_body)
        matrix[:, :3] *= metres_per_unit
        prim = over.GetPrimAtPath(path.ReplacePrefix(root.GetPath(), place))
        author_coordinates(prim, gprim, _faces(gprim, prims), matrix)
    return layer


def _faces(gprim: Usd.Prim, prims: Sequence[Usd.Prim]) -> NDArray[np.int64] | None:
    """Return the faces of a gprim in `prims`: subsets of it, or the gprim itself, for the faces outside subsets; None
    for all faces."""
    subsets = [each for each in find_subsets(gprim) if binds_material(each)]
    faces = {each.GetPath(): array(each.GetIndicesAttr(), TIME, np.int64) for each in subsets}
    if gprim not in prims:
        return np.concatenate([faces[each.GetPath()] for each in prims])
    others = [held for path, held in faces.items() if path not in {each.GetPath() for each in prims}]
    if not others:
        return None
    count = len(array(UsdGeom.Mesh(gprim).GetFaceVertexCountsAttr(), TIME, np.int64))
    return np.setdiff1d(np.arange(count), np.concatenate(others))


def _define(parent: Sdf.PrimSpec | Sdf.Layer, name: str, kind: str = "") -> Sdf.PrimSpec:
    return Sdf.PrimSpec(parent, name, Sdf.SpecifierDef, kind)


def _over(parent: Sdf.PrimSpec, name: str) -> Sdf.PrimSpec:
    return Sdf.PrimSpec(parent, name, Sdf.SpecifierOver)
