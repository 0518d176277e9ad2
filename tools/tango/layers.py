"""The four layers of the asset: interface, payload, geometry, look. The same parts always give the same text."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdMedia, UsdSemantics, UsdShade, Vt

from tango.dimensions import OFFICIAL_POINTS
from tango.materials import LOOKS, Look
from tango.shape import Array
from tango.spacecraft import Part

# Decimals that reach the text: ten micrometres, a hundredth of a degree, a tenth of a millimetre.
POINT_DECIMALS, NORMAL_DECIMALS, ST_DECIMALS = 5, 4, 4
ROOT = Sdf.Path("/Tango")
VERSION = "1.0.0"


def write(parts: Sequence[Part], folder: Path) -> None:
    """All four layers into an existing folder, each before the one that refers to it."""
    _geometry(_stage(folder / "geometry.usda", "Surfaces, labels and keypoints of Tango."), parts)
    _look(_stage(folder / "look.usda", "Materials of Tango, and what wears which."), parts)
    _payload(_stage(folder / "payload.usda", "Everything below the interface: the look over the geometry."))
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
    model.SetPayloadAssetDependencies(Sdf.AssetPathArray([Sdf.AssetPath("./payload.usda")]))
    everything = _rounded(np.concatenate([part.shape.points for part in parts]), POINT_DECIMALS)
    UsdGeom.ModelAPI.Apply(prim).SetExtentsHint(_vectors(_bounds(everything)))
    _label(prim, "class", "spacecraft")
    _sign(prim)
    prim.GetPayloads().AddPayload("./payload.usda")
    stage.GetRootLayer().customLayerData = {
        "spin": {
            "bodyFrame": "SPEED+ Tango: origin in the plane of the bottom plate, +z towards the solar panel, metres",
            "keypoints": "Keypoints, in the official order 1 to 11 of tango3Dpoints",
        }
    }
    stage.Save()


def _sign(prim: Usd.Prim) -> None:
    author = UsdMedia.AuthorshipAPI.Apply(prim, "model")
    author.CreateDescriptionAttr("Parametric model around the eleven official points of the SPEED+ data set.")
    author.CreateSoftwarePackageAttr("tools/build_tango")
    author.CreateSoftwareVersionAttr(VERSION)
    author.CreateUsageTermsAttr("GPL-3.0-or-later")


def _payload(stage: Usd.Stage) -> None:
    stage.GetRootLayer().subLayerPaths = ["./look.usda", "./geometry.usda"]
    stage.Save()


def _geometry(stage: Usd.Stage, parts: Sequence[Part]) -> None:
    UsdGeom.Xform.Define(stage, ROOT)
    for part in parts:
        _mesh(stage, part)
    _keypoints(stage)
    stage.Save()


def _mesh(stage: Usd.Stage, part: Part) -> None:
    shape = part.shape
    mesh = UsdGeom.Mesh.Define(stage, ROOT.AppendChild(part.name))
    points = _vectors(_rounded(shape.points, POINT_DECIMALS))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(points))
    mesh.CreatePointsAttr(points)
    mesh.CreateFaceVertexCountsAttr([len(face) for face in shape.faces])
    mesh.CreateFaceVertexIndicesAttr([i for face in shape.faces for i in face])
    primvars = UsdGeom.PrimvarsAPI(mesh)
    _primvar(primvars, "normals", Sdf.ValueTypeNames.Normal3fArray, _rounded(shape.normals, NORMAL_DECIMALS))
    _primvar(primvars, "st", Sdf.ValueTypeNames.TexCoord2fArray, _rounded(shape.st, ST_DECIMALS))
    _label(mesh.GetPrim(), "class", part.kind)
    _label(mesh.GetPrim(), "part", part.name)
    _subsets(mesh, shape.materials)


def _label(prim: Usd.Prim, taxonomy: str, label: str) -> None:
    UsdSemantics.LabelsAPI.Apply(prim, taxonomy).CreateLabelsAttr([label])


def _primvar(primvars: UsdGeom.PrimvarsAPI, name: str, kind: Sdf.ValueTypeName, corners: Array) -> None:
    """One value for each face corner, equal ones stored once."""
    values, indices = np.unique(corners, axis=0, return_inverse=True)
    primvar = primvars.CreatePrimvar(name, kind, UsdGeom.Tokens.faceVarying)
    primvar.Set(_vectors(values))
    primvar.SetIndices(Vt.IntArray(indices.ravel().tolist()))


def _subsets(mesh: UsdGeom.Mesh, materials: tuple[str, ...]) -> None:
    """One subset for each material where there are several; together they hold every face once."""
    names = np.array(materials)
    used = list(dict.fromkeys(materials))
    if len(used) > 1:
        for name in used:
            faces = np.flatnonzero(names == name).tolist()
            UsdGeom.Subset.CreateGeomSubset(
                mesh, name, UsdGeom.Tokens.face, faces, UsdShade.Tokens.materialBind, UsdGeom.Tokens.partition
            )


def _keypoints(stage: Usd.Stage) -> None:
    points = UsdGeom.Points.Define(stage, ROOT.AppendChild("Keypoints"))
    points.CreatePurposeAttr(UsdGeom.Tokens.guide)
    points.CreatePointsAttr(_vectors(np.array([place for _, *place in OFFICIAL_POINTS])))
    points.CreateWidthsAttr([0.01])
    points.SetWidthsInterpolation(UsdGeom.Tokens.constant)
    points.CreateIdsAttr(list(range(1, len(OFFICIAL_POINTS) + 1)))
    points.CreateExtentAttr(UsdGeom.Boundable.ComputeExtentFromPlugins(points, Usd.TimeCode.Default()))
    names = UsdGeom.PrimvarsAPI(points).CreatePrimvar(
        "keypointName", Sdf.ValueTypeNames.StringArray, UsdGeom.Tokens.vertex
    )
    names.Set([name for name, *_ in OFFICIAL_POINTS])


def _look(stage: Usd.Stage, parts: Sequence[Part]) -> None:
    scope = UsdGeom.Scope.Define(stage, ROOT.AppendChild("mtl")).GetPath()
    materials = {name: _material(stage, scope.AppendChild(name), look) for name, look in LOOKS.items()}
    for part in parts:
        used = list(dict.fromkeys(part.shape.materials))
        mesh = ROOT.AppendChild(part.name)
        for name in used:
            prim = stage.OverridePrim(mesh if len(used) == 1 else mesh.AppendChild(name))
            UsdShade.MaterialBindingAPI.Apply(prim).Bind(materials[name])
    stage.GetRootLayer().GetPrimAtPath(ROOT).specifier = Sdf.SpecifierOver
    stage.Save()


def _material(stage: Usd.Stage, path: Sdf.Path, look: Look) -> UsdShade.Material:
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, path.AppendChild("Surface"))
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*look.colour))
    for name, value in (
        ("metallic", look.metallic),
        ("roughness", look.roughness),
        ("clearcoat", look.clearcoat),
        ("clearcoatRoughness", look.clearcoat_roughness),
    ):
        shader.CreateInput(name, Sdf.ValueTypeNames.Float).Set(value)
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    return material


def _rounded(values: Array, decimals: int) -> Array:
    """Rounded, without negative zeros."""
    return np.round(values, decimals) + 0.0


def _bounds(points: Array) -> Array:
    return np.stack([points.min(axis=0), points.max(axis=0)])


def _vectors(values: Array) -> Vt.Vec2fArray | Vt.Vec3fArray:
    kind = Vt.Vec2fArray if values.shape[1] == 2 else Vt.Vec3fArray
    return kind.FromNumpy(values.astype(np.float32))
