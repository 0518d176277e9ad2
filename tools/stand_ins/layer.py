"""A stand-in as one layer: interface, geometry, labels, keypoints, and its two looks."""

from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdMedia, UsdSemantics, UsdShade

from spin_usd.craft.solids import Solid
from stand_ins.craft import Craft, Part, Round

VERSION = "1.0.0"
# Material -> (colour of the matt look, and of the reflective one: colour, metallic, roughness, clearcoat).
MATERIALS = {
    "SolarCell": ((0.030, 0.035, 0.060), ((0.02, 0.025, 0.06), 0.3, 0.18, 1.0)),
    "Aluminium": ((0.50, 0.50, 0.50), ((0.66, 0.67, 0.68), 1.0, 0.42, 0.0)),
    "Rail": ((0.45, 0.45, 0.45), ((0.45, 0.46, 0.47), 1.0, 0.35, 0.0)),
    "Tape": ((0.52, 0.45, 0.28), ((0.75, 0.66, 0.40), 1.0, 0.30, 0.0)),
    "Foil": ((0.66, 0.48, 0.17), ((0.83, 0.60, 0.20), 1.0, 0.36, 0.0)),
    "BlackPaint": ((0.06, 0.06, 0.06), ((0.040, 0.040, 0.043), 0.0, 0.42, 0.0)),
    "WhitePaint": ((0.80, 0.80, 0.77), ((0.80, 0.80, 0.77), 0.0, 0.55, 0.0)),
    "GreyBlanket": ((0.30, 0.31, 0.29), ((0.30, 0.31, 0.29), 0.0, 0.65, 0.0)),
    "DarkBlanket": ((0.10, 0.11, 0.10), ((0.09, 0.10, 0.09), 0.0, 0.60, 0.0)),
}
NORMALS = [Gf.Vec3f(*normal) for axis in np.eye(3).tolist() for normal in ([-x + 0.0 for x in axis], axis)]


def write(craft: Craft, folder: Path) -> None:
    """The layer `folder`/NAME.usda. The same craft always gives the same text."""
    stage = Usd.Stage.CreateNew(str(folder / f"{craft.name}.usda"))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    root = UsdGeom.Xform.Define(stage, f"/{craft.prim}").GetPrim()
    stage.SetDefaultPrim(root)
    stage.GetRootLayer().documentation = f"{craft.about} Made by tools/build_stand_ins."
    for part in craft.parts:
        _part(stage, root, part)
    _keypoints(stage, root, craft)
    _interface(root, craft)
    _looks(stage, root, craft)
    stage.Save()


def _interface(root: Usd.Prim, craft: Craft) -> None:
    model = Usd.ModelAPI(root)
    model.SetKind("component")
    model.SetAssetIdentifier(Sdf.AssetPath(f"./{craft.name}.usda"))
    model.SetAssetName(craft.prim)
    model.SetAssetVersion(VERSION)
    box = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default"]).ComputeWorldBound(root).ComputeAlignedRange()
    corners = [Gf.Vec3f(*(round(x, 5) for x in corner)) for corner in (box.GetMin(), box.GetMax())]
    Usd.ColorSpaceAPI.Apply(root).CreateColorSpaceNameAttr(Gf.ColorSpaceNames.LinearRec709)
    UsdGeom.ModelAPI.Apply(root).SetExtentsHint(corners)
    _label(root, "class", "spacecraft")
    author = UsdMedia.AuthorshipAPI.Apply(root, "model")
    author.CreateDescriptionAttr(craft.about)
    author.CreateSoftwarePackageAttr("tools/build_stand_ins")
    author.CreateSoftwareVersionAttr(VERSION)
    author.CreateUsageTermsAttr("GPL-3.0-or-later")


def _part(stage: Usd.Stage, root: Usd.Prim, part: Part) -> None:
    path = root.GetPath().AppendChild(part.name)
    prim = _round(stage, path, part.solids) if isinstance(part.solids, Round) else _boxes(stage, path, part.solids)
    _label(prim, "class", part.kind)
    _label(prim, "part", part.name)
    UsdShade.MaterialBindingAPI.Apply(prim)
    binding = prim.CreateRelationship(UsdShade.Tokens.materialBinding, custom=False)
    binding.SetTargets([root.GetPath().AppendPath(f"mtl/{part.material}")])


def _boxes(stage: Usd.Stage, path: Sdf.Path, boxes: tuple[Solid, ...]) -> Usd.Prim:
    mesh = UsdGeom.Mesh.Define(stage, path)
    points = np.round(np.concatenate([box.points for box in boxes]), 6)
    indices = [[8 * i + corner for corner in face] for i, box in enumerate(boxes) for face in box.faces]
    mesh.CreatePointsAttr([Gf.Vec3f(*map(float, p)) for p in points])
    mesh.CreateFaceVertexCountsAttr([4] * len(indices))
    mesh.CreateFaceVertexIndicesAttr([corner for face in indices for corner in face])
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateNormalsAttr(NORMALS * len(boxes))  # Blender's importer shades faces without any smooth
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.uniform)
    mesh.CreateExtentAttr([Gf.Vec3f(*map(float, p)) for p in (points.min(0), points.max(0))])
    return mesh.GetPrim()


def _round(stage: Usd.Stage, path: Sdf.Path, solid: Round) -> Usd.Prim:
    shape = getattr(UsdGeom, solid.kind).Define(stage, path)
    shape.CreateRadiusAttr(solid.radius)
    half = solid.radius
    if solid.kind != "Sphere":
        shape.CreateHeightAttr(solid.height)
        shape.CreateAxisAttr(UsdGeom.Tokens.z)
        half = solid.height / 2
    shape.CreateExtentAttr([Gf.Vec3f(-solid.radius, -solid.radius, -half), Gf.Vec3f(solid.radius, solid.radius, half)])
    shape.AddTranslateOp().Set(Gf.Vec3d(*solid.centre))
    if any(solid.turn):
        shape.AddRotateXYZOp().Set(Gf.Vec3f(*solid.turn))
    return shape.GetPrim()


def _keypoints(stage: Usd.Stage, root: Usd.Prim, craft: Craft) -> None:
    points = UsdGeom.Points.Define(stage, root.GetPath().AppendChild("Keypoints"))
    places = [Gf.Vec3f(*(round(x, 6) for x in place)) for place in craft.keypoints.values()]
    points.CreatePointsAttr(places)
    points.CreateIdsAttr(list(range(1, len(places) + 1)))
    points.CreateWidthsAttr([0.01] * len(places))  # for one alone USD computes no extent
    points.CreatePurposeAttr(UsdGeom.Tokens.guide)
    points.CreateExtentAttr(UsdGeom.Boundable.ComputeExtentFromPlugins(points, Usd.TimeCode.Default()))
    names = UsdGeom.PrimvarsAPI(points).CreatePrimvar(
        "keypointName", Sdf.ValueTypeNames.StringArray, UsdGeom.Tokens.vertex
    )
    names.Set(list(craft.keypoints))


def _looks(stage: Usd.Stage, root: Usd.Prim, craft: Craft) -> None:
    """The materials that are used, of the same names in both variants."""
    used = list(dict.fromkeys(part.material for part in craft.parts))
    looks = root.GetVariantSets().AddVariantSet("look")
    for look in ("matt", "reflective"):
        looks.AddVariant(look)
        looks.SetVariantSelection(look)
        with looks.GetVariantEditContext():
            scope = UsdGeom.Scope.Define(stage, root.GetPath().AppendChild("mtl"))
            for name in used:
                _material(stage, scope.GetPath().AppendChild(name), name, look)


def _material(stage: Usd.Stage, path: Sdf.Path, name: str, look: str) -> None:
    matt, (colour, metallic, roughness, clearcoat) = MATERIALS[name]
    inputs = {
        "diffuseColor": (Sdf.ValueTypeNames.Color3f, Gf.Vec3f(*colour)),
        "metallic": (Sdf.ValueTypeNames.Float, metallic),
        "roughness": (Sdf.ValueTypeNames.Float, roughness),
        "clearcoat": (Sdf.ValueTypeNames.Float, clearcoat),
        "ior": (Sdf.ValueTypeNames.Float, 1.5),
    }
    if look == "matt":  # an index of refraction of 1 reflects nothing
        plain = {"diffuseColor": Gf.Vec3f(*matt), "metallic": 0.0, "roughness": 1.0, "clearcoat": 0.0, "ior": 1.0}
        inputs = {key: (kind, plain[key]) for key, (kind, _) in inputs.items()}
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, path.AppendChild("Surface"))
    shader.CreateIdAttr("UsdPreviewSurface")
    for key, (kind, value) in inputs.items():
        shader.CreateInput(key, kind).Set(value)
    material.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", Sdf.ValueTypeNames.Token))


def _label(prim: Usd.Prim, taxonomy: str, label: str) -> None:
    UsdSemantics.LabelsAPI.Apply(prim, taxonomy).CreateLabelsAttr([label])
