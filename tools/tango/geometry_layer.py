"""Points, faces, normals, texture coordinates and labels of parts, and the keypoints."""

from collections.abc import Sequence

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdSemantics, UsdShade, Vt

from tango.dimensions import OFFICIAL_POINTS
from tango.parts.spacecraft import Part
from tango.paths import ROOT
from tango.shapes.shape import Array

# Decimals that reach the text: ten micrometres, three hundredths of a degree, a tenth of a millimetre.
POINT_DECIMALS, NORMAL_DECIMALS, ST_DECIMALS = 5, 3, 4


def geometry(stage: Usd.Stage, parts: Sequence[Part]) -> None:
    UsdGeom.Xform.Define(stage, ROOT)
    for part in parts:
        mesh(stage, part)
    stage.Save()


def mesh(stage: Usd.Stage, part: Part) -> None:
    """One part as a Mesh, with its labels and the subsets of its materials."""
    shape = part.shape
    made = UsdGeom.Mesh.Define(stage, ROOT.AppendChild(part.name))
    points = vectors(rounded(shape.points, POINT_DECIMALS))
    made.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    made.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(points))
    made.CreatePointsAttr(points)
    made.CreateFaceVertexCountsAttr([len(face) for face in shape.faces])
    made.CreateFaceVertexIndicesAttr([i for face in shape.faces for i in face])
    primvars = UsdGeom.PrimvarsAPI(made)
    _primvar(primvars, "normals", Sdf.ValueTypeNames.Normal3fArray, rounded(shape.normals, NORMAL_DECIMALS))
    _primvar(primvars, "st", Sdf.ValueTypeNames.TexCoord2fArray, rounded(shape.st, ST_DECIMALS))
    label(made.GetPrim(), "class", part.kind)
    label(made.GetPrim(), "part", part.name)
    _subsets(made, shape.materials)


def label(prim: Usd.Prim, taxonomy: str, label: str) -> None:
    UsdSemantics.LabelsAPI.Apply(prim, taxonomy).CreateLabelsAttr([label])


def _primvar(primvars: UsdGeom.PrimvarsAPI, name: str, kind: Sdf.ValueTypeName, corners: Array) -> None:
    """One value for each face corner, equal ones stored once."""
    values, indices = np.unique(corners, axis=0, return_inverse=True)
    primvar = primvars.CreatePrimvar(name, kind, UsdGeom.Tokens.faceVarying)
    primvar.Set(vectors(values))
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


def keypoints(stage: Usd.Stage) -> None:
    points = UsdGeom.Points.Define(stage, ROOT.AppendChild("Keypoints"))
    points.CreatePurposeAttr(UsdGeom.Tokens.guide)
    points.CreatePointsAttr(vectors(np.array([place for _, *place in OFFICIAL_POINTS])))
    points.CreateWidthsAttr([0.01] * len(OFFICIAL_POINTS))  # for one alone USD computes no extent
    points.CreateIdsAttr(list(range(1, len(OFFICIAL_POINTS) + 1)))
    points.CreateExtentAttr(UsdGeom.Boundable.ComputeExtentFromPlugins(points, Usd.TimeCode.Default()))
    names = UsdGeom.PrimvarsAPI(points).CreatePrimvar(
        "keypointName", Sdf.ValueTypeNames.StringArray, UsdGeom.Tokens.vertex
    )
    names.Set([name for name, *_ in OFFICIAL_POINTS])


def rounded(values: Array, decimals: int) -> Array:
    """Rounded, without negative zeros."""
    return np.round(values, decimals) + 0.0


def bounds(points: Array) -> Array:
    return np.stack([points.min(axis=0), points.max(axis=0)])


def vectors(values: Array) -> Vt.Vec2fArray | Vt.Vec3fArray:
    kind = Vt.Vec2fArray if values.shape[1] == 2 else Vt.Vec3fArray
    return kind.FromNumpy(values.astype(np.float32))
