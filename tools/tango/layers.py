"""The layers of the asset: interface, payload, geometry, bindings, looks. The same parts always give the same text."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from materials.png import write_textures
from pxr import Gf, Sdf, Usd, UsdGeom, UsdMedia, UsdShade

from tango.geometry_layer import POINT_DECIMALS, bounds, geometry, keypoints, label, rounded, vectors
from tango.look_layer import look
from tango.materials import DEFAULT_LOOK, LOOKS, MOCKUP, REFLECTIVE
from tango.mockup_layer import mockup
from tango.parts.spacecraft import Part
from tango.paths import LOOK_SET, MATERIALS, ROOT
from tango.textures import TEXTURES

VERSION = "1.4.0"
ABOUT_LOOKS = {
    "matt": "Tango as simple simulators draw it: a colour a material, a little worn, Lambert; nothing shines.",
    "reflective": "Tango with cells under coverglass, crinkled foil, brushed metal, black and white paint.",
    "mockup": "Tango's mock-up in the test bed of SPEED+: white plates, taut film, black cells and bars.",
}


def write(parts: Sequence[Part], folder: Path) -> None:
    """All layers and textures into an existing folder, each before the one that refers to it."""
    (folder / "geometry").mkdir(exist_ok=True)
    for name in _geometry_layers(parts):
        held = [part for part in parts if part.layer == name]
        geometry(_stage(folder / "geometry" / f"{name}.usda", "Surfaces and labels of parts of Tango."), held)
    _bindings(_stage(folder / "bindings.usda", "What of Tango wears which material, in every look."), parts)
    write_textures(folder / "textures", TEXTURES)
    for name, materials in LOOKS.items():
        stage = _stage(folder / f"{name}.usda", ABOUT_LOOKS[name])
        look(stage, materials, of_library=materials is REFLECTIVE)
        if materials is MOCKUP:
            mockup(stage, parts)
    _payload(_stage(folder / "payload.usda", "What is below the interface in every look."), parts)
    _interface(_stage(folder / "tango.usda", "Tango, the smaller PRISMA spacecraft. Made by tools/build_tango."), parts)


def _stage(path: Path, doc: str) -> Usd.Stage:
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.GetRootLayer().documentation = doc
    stage.GetRootLayer().defaultPrim = ROOT.name
    return stage


def _interface(stage: Usd.Stage, parts: Sequence[Part]) -> None:
    prim = UsdGeom.Xform.Define(stage, ROOT).GetPrim()
    model = Usd.ModelAPI(prim)
    model.SetKind("component")
    model.SetAssetIdentifier(Sdf.AssetPath("./tango.usda"))
    model.SetAssetName(ROOT.name)
    model.SetAssetVersion(VERSION)
    model.SetPayloadAssetDependencies(
        Sdf.AssetPathArray([Sdf.AssetPath(f"./{name}.usda") for name in ("payload", *LOOKS)])
    )
    everything = rounded(np.concatenate([part.shape.points for part in parts]), POINT_DECIMALS)
    Usd.ColorSpaceAPI.Apply(prim).CreateColorSpaceNameAttr(Gf.ColorSpaceNames.LinearRec709)
    UsdGeom.ModelAPI.Apply(prim).SetExtentsHint(vectors(bounds(everything)))
    label(prim, "class", "spacecraft")
    _sign(prim)
    prim.GetPayloads().AddPayload("./payload.usda")
    _variants(prim)
    stage.GetRootLayer().customLayerData = {
        "spin": {
            "bodyFrame": "SPEED+ Tango: origin in the plane of the bottom plate, +z towards the solar panel, metres",
            "keypoints": "Keypoints, in the official order 1 to 11 of tango3Dpoints",
        }
    }
    stage.Save()


def _variants(prim: Usd.Prim) -> None:
    """The looks: each brings its own materials, of the same names."""
    variants = prim.GetVariantSets().AddVariantSet(LOOK_SET)
    for name in LOOKS:
        variants.AddVariant(name)
        variants.SetVariantSelection(name)
        with variants.GetVariantEditContext():
            prim.GetPayloads().AddPayload(f"./{name}.usda")
    variants.SetVariantSelection(DEFAULT_LOOK)


def _sign(prim: Usd.Prim) -> None:
    author = UsdMedia.AuthorshipAPI.Apply(prim, "model")
    author.CreateDescriptionAttr("Parametric model around the eleven official points of the SPEED+ data set.")
    author.CreateSoftwarePackageAttr("tools/build_tango")
    author.CreateSoftwareVersionAttr(VERSION)
    author.CreateUsageTermsAttr("GPL-3.0-or-later")


def _payload(stage: Usd.Stage, parts: Sequence[Part]) -> None:
    """The keypoints, over the surfaces. The weakest layer, which names every part, decides the order of the parts."""
    geometry = [f"./geometry/{name}.usda" for name in _geometry_layers(parts)]
    stage.GetRootLayer().subLayerPaths = [*geometry, "./bindings.usda"]
    keypoints(stage)
    stage.Save()


def _geometry_layers(parts: Sequence[Part]) -> list[str]:
    """Several, so that none of them is a file of megabytes."""
    return list(dict.fromkeys(part.layer for part in parts))


def _bindings(stage: Usd.Stage, parts: Sequence[Part]) -> None:
    """Which material each face wears: the same names in every look."""
    for part in parts:
        used = list(dict.fromkeys(part.shape.materials))
        mesh = ROOT.AppendChild(part.name)
        for name in used:
            prim = stage.OverridePrim(mesh if len(used) == 1 else mesh.AppendChild(name))
            UsdShade.MaterialBindingAPI.Apply(prim)
            binding = prim.CreateRelationship(UsdShade.Tokens.materialBinding, custom=False)
            binding.SetTargets([MATERIALS.AppendChild(name)])
    stage.GetRootLayer().GetPrimAtPath(ROOT).specifier = Sdf.SpecifierOver
    stage.Save()
