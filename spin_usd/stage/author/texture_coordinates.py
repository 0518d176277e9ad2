"""Texture coordinates in metres, primvars:st, for the faces of a model that get a material of the library."""

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdGeom

from spin_usd.basics.arrays import Float
from spin_usd.errors import UnsupportedError
from spin_usd.geometry.box_projection import Polygons, projected, stretch
from spin_usd.stage.read.shapes.primitives import SHAPES, read_gprim
from spin_usd.stage.read.shapes.primvars import find_primvar
from spin_usd.stage.usd.conversion import box, int_array, vec2f_array, vec3f_array
from spin_usd.stage.usd.values import array

ST = "st"
DENSITY, STRETCH = 1.5, 2.0
"""Coordinates that nearly all faces have in metres, within this factor, and not stretched by more, stay."""
MAY_BE_WORSE = 0.02  # of the faces may be worse: those at the poles of a globe
TIME = Usd.TimeCode.EarliestTime()


def author_coordinates(over: Usd.Prim, prim: Usd.Prim, faces: NDArray[np.int64] | None, to_body: Float) -> None:
    """Author, on the prim `over` of another stage, the coordinates of the `faces` of the gprim `prim`, of all where
    None; those of its other faces stay. `to_body` (4, 4): row-vector, from its axes to the body's, metres.

    A shape that is not a mesh becomes one, since USD gives it no coordinates. A mesh with coordinates in metres keeps
    them.
    """
    mesh = _author_mesh(over, prim) if str(prim.GetTypeName()) in SHAPES else UsdGeom.Mesh(prim)
    points = array(mesh.GetPointsAttr(), TIME, np.float64).reshape(-1, 3)
    counts = array(mesh.GetFaceVertexCountsAttr(), TIME, np.int64)
    indices = array(mesh.GetFaceVertexIndicesAttr(), TIME, np.int64)
    if not len(counts) or counts.min() < 3 or counts.sum() != len(indices) or not 0 <= indices.max() < len(points):
        return  # which reading the stage will refuse
    polygons = Polygons(points=points @ to_body[:3, :3] + to_body[3, :3], counts=counts, indices=indices)
    own = _own(prim, polygons)
    chosen = np.ones(len(counts), bool) if faces is None else np.isin(np.arange(len(counts)), faces)
    if own is not None and _in_metres(polygons, own, chosen):
        return
    st = projected(polygons)
    if own is not None:
        st = np.where(chosen[polygons.faces][:, None], st, own)
    values, places = np.unique(st.astype(np.float32) + np.float32(0), axis=0, return_inverse=True)
    kind = Sdf.ValueTypeNames.TexCoord2fArray
    primvar = UsdGeom.PrimvarsAPI(over).CreatePrimvar(ST, kind, UsdGeom.Tokens.faceVarying)
    primvar.Set(vec2f_array(values))
    primvar.SetIndices(int_array(places.reshape(-1)))


def _own(prim: Usd.Prim, polygons: Polygons) -> Float | None:
    """Return the coordinates (C, 2) that the corners of a mesh have; None without any that fit."""
    try:
        found = find_primvar(prim, ST, 2, TIME)
    except UnsupportedError:
        return None
    element = {
        "faceVarying": np.arange(len(polygons.indices)),
        "uniform": polygons.faces,
        **dict.fromkeys(("vertex", "varying"), polygons.indices),
    }.get(found.interpolation if found else "")
    if found is None or element is None or len(found.indices) <= element.max():
        return None
    own: Float = found.elements[element]
    return own


def _in_metres(polygons: Polygons, st: Float, chosen: NDArray[np.bool_]) -> bool:
    longest, shortest = stretch(polygons, st)[chosen].T
    density = np.sqrt(longest * shortest)
    bad = (density < 1 / DENSITY) | (density > DENSITY) | (longest > STRETCH * shortest)
    return bool(bad.mean() <= MAY_BE_WORSE)


def _author_mesh(over: Usd.Prim, prim: Usd.Prim) -> UsdGeom.Mesh:
    """Author a mesh in place of the shape `prim`, of the triangles by which that is rendered."""
    triangles = read_gprim(prim, TIME)
    over.SetTypeName("Mesh")
    mesh = UsdGeom.Mesh(over)
    mesh.CreatePointsAttr(vec3f_array(triangles.points))
    mesh.CreateFaceVertexCountsAttr(int_array(np.full(len(triangles.corners), 3)))
    mesh.CreateFaceVertexIndicesAttr(int_array(triangles.corners.reshape(-1)))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateOrientationAttr(UsdGeom.Tokens.rightHanded)
    mesh.CreateExtentAttr(box(triangles.points))
    mesh.CreateNormalsAttr(vec3f_array(triangles.normals.reshape(-1, 3)))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.faceVarying)
    return mesh
