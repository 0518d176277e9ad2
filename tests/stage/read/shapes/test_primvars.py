"""Primvars of every interpolation at the corners of triangles; where they are smooth, as in Blender's OpenSubdiv."""

import bpy
import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, Vt

from spin_usd.errors import StageError, UnsupportedError
from spin_usd.stage.read.shapes.mesh import read_mesh
from spin_usd.stage.read.shapes.primvars import find_primvar
from tests.stage.read.shapes.test_mesh import CUBE, define

FLOAT32 = 1e-6
LIMIT_TOLERANCE = 1e-5  # of a face's edge: Blender's numbers are float32
SMOOTH_CORNER_TOLERANCE = 1e-4  # Blender isolates a smooth corner (mode none) by finitely many steps
TIME = Usd.TimeCode(0)
COUNTS = {"constant": 1, "uniform": 6, "vertex": 8, "varying": 8, "faceVarying": 24}


def author(mesh, name, values, interpolation, indices=None, kind=None):
    kind = kind or {1: "float[]", 2: "texCoord2f[]", 3: "color3f[]"}[values.shape[1]]
    primvar = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(name, Sdf.ValueTypeNames.Find(kind), interpolation)
    array = {1: Vt.FloatArray, 2: Vt.Vec2fArray, 3: Vt.Vec3fArray}[values.shape[1]]
    primvar.Set(
        array.FromNumpy(
            np.ascontiguousarray(
                values.astype(np.float32).squeeze(-1) if values.shape[1] == 1 else values.astype(np.float32)
            )
        )
    )
    if indices is not None:
        primvar.SetIndices(Vt.IntArray([int(i) for i in indices]))
    return primvar


def triangles(mesh, name="uv", channels=2):
    found = find_primvar(mesh.GetPrim(), name, channels, TIME)
    assert found is not None
    return read_mesh(mesh.GetPrim(), TIME, [found])


@pytest.mark.parametrize("interpolation", COUNTS)
@pytest.mark.parametrize("indexed", [False, True])
def test_every_interpolation_reaches_its_corners(interpolation, indexed) -> None:
    stage, mesh = define(*CUBE)
    count = COUNTS[interpolation]
    values = np.random.default_rng(1).random((count, 2))
    order = np.random.default_rng(2).permutation(count)
    author(mesh, "uv", values, interpolation, order if indexed else None)
    expected = values[order] if indexed else values
    t = triangles(mesh)
    ring = np.array(CUBE[2]).reshape(6, 4)
    for points, found, face in zip(t.corners, t.primvars["uv"], t.source, strict=True):
        for point, value in zip(points, found, strict=True):
            place = int(face * 4 + np.flatnonzero(ring[face] == point)[0])
            which = {"constant": 0, "uniform": face, "faceVarying": place}.get(interpolation, point)
            np.testing.assert_allclose(value, expected[which], atol=FLOAT32)
    assert stage


def test_values_stay_with_their_corners_through_mirrors_and_holes() -> None:
    """A primvar that is the position itself stays so."""
    points, counts, indices = CUBE
    stage, mesh = define(points, counts, indices, orientation="leftHanded", holeIndices=[1])
    author(mesh, "p", np.array(points, float), "vertex")
    t = triangles(mesh, "p", 3)
    np.testing.assert_allclose(t.primvars["p"], t.points[t.corners], atol=FLOAT32)
    mirror = np.diag([-1.0, 1, 1, 1])
    moved = t.transformed(mirror, "/Mesh")
    np.testing.assert_allclose(moved.primvars["p"] * [-1, 1, 1], moved.points[moved.corners], atol=FLOAT32)
    assert stage


@pytest.mark.parametrize("scheme", ["catmullClark", "bilinear"])
def test_vertex_values_follow_the_limit_surface(scheme) -> None:
    """Vertex interpolation is the rule of the points: so the points as a primvar lie on the surface."""
    stage, mesh = define(*CUBE, scheme, creaseIndices=[0, 1, 3], creaseLengths=[3], creaseSharpnesses=[2.0])
    author(mesh, "p", np.array(CUBE[0], float), "vertex")
    t = triangles(mesh, "p", 3)
    np.testing.assert_allclose(t.primvars["p"], t.points[t.corners], atol=FLOAT32)
    assert stage


def test_varying_values_are_bilinear_on_a_smooth_surface() -> None:
    stage, mesh = define(*CUBE, "catmullClark")
    author(mesh, "p", np.array(CUBE[0], float), "varying")
    smooth = triangles(mesh, "p", 3)
    mesh.GetSubdivisionSchemeAttr().Set("bilinear")
    flat = triangles(mesh, "p", 3)
    np.testing.assert_allclose(smooth.primvars["p"], flat.points[flat.corners], atol=FLOAT32)
    assert stage


MODES = {
    "none": "SMOOTH_ALL",
    "cornersOnly": "PRESERVE_CORNERS",
    "cornersPlus1": "PRESERVE_CORNERS_AND_JUNCTIONS",
    "cornersPlus2": "PRESERVE_CORNERS_JUNCTIONS_AND_CONCAVE",
    "boundaries": "PRESERVE_BOUNDARIES",
    "all": "NONE",
}


def grid(n=4):
    """A flat n x n grid of quadrangles: points, counts, indices, and the st (0 to 1) of its points."""
    s, t = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0))
    points = np.stack([s.ravel(), t.ravel(), 0 * s.ravel()], 1)
    corner = np.arange((n + 1) * n).reshape(n, n + 1)[:, :n].ravel()
    ring = np.stack([corner, corner + 1, corner + n + 2, corner + n + 1], 1)
    return points, [4] * len(ring), ring.ravel().tolist()


def islands(name):
    """(sum of counts, 2) values at the corners of `grid()`: its points, bent, cut into islands."""
    points, _, indices = grid()
    at = points[indices][:, :2]
    bent = at + 0.2 * np.sin(3 * at[:, ::-1])
    column, row = (np.arange(16) % 4).repeat(4), (np.arange(16) // 4).repeat(4)
    island = {
        "whole": 0 * column,
        "halves": column // 2,
        "quarters": column // 2 + 2 * (row // 2),
        "corner": 1 * ((column > 1) & (row > 1)),
        "dart": 1 * ((column > 1) & (row < 2)),
    }[name]
    if name == "dart":  # torn along two edges, of which one ends inside; Blender splits faces that turn over
        island = -0.1 * ((column == 2) & (at[:, 0] == 2) & (at[:, 1] < 2))
    return bent + 3 * island[:, None]


def blender_corners(values, mode):
    """(N, 2) xy on the surface and (N, 2) values of Blender's own subdivision, two levels."""
    points, _, indices = grid()
    mesh = bpy.data.meshes.new("grid")
    mesh.from_pydata(points.tolist(), [], np.array(indices).reshape(-1, 4).tolist())
    mesh.uv_layers.new(name="uv").data.foreach_set("uv", values.astype(np.float32).ravel())
    thing = bpy.data.objects.new("grid", mesh)
    bpy.context.scene.collection.objects.link(thing)
    modifier = thing.modifiers.new("subdivide", "SUBSURF")
    modifier.levels, modifier.uv_smooth, modifier.use_limit_surface = 2, MODES[mode], True
    modifier.boundary_smooth, modifier.quality = "PRESERVE_CORNERS", 6
    evaluated = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    uv = np.zeros(len(evaluated.loops) * 2, np.float32)
    evaluated.uv_layers["uv"].data.foreach_get("uv", uv)
    place = np.zeros(len(evaluated.vertices) * 3, np.float32)
    evaluated.vertices.foreach_get("co", place)
    vertex = np.zeros(len(evaluated.loops), np.int32)
    evaluated.loops.foreach_get("vertex_index", vertex)
    bpy.data.objects.remove(thing)
    bpy.data.meshes.remove(mesh)
    return place.reshape(-1, 3)[vertex][:, :2], uv.reshape(-1, 2)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("name", ["whole", "halves", "quarters", "corner", "dart"])
def test_face_varying_values_are_those_of_blenders_opensubdiv(mode, name) -> None:
    values = islands(name)
    points, counts, indices = grid()
    distinct, number = np.unique(np.round(values, 9), axis=0, return_inverse=True)
    stage, mesh = define(points, counts, indices, "catmullClark", faceVaryingLinearInterpolation=mode)
    author(mesh, "uv", distinct, "faceVarying", number.reshape(-1))
    t = triangles(mesh)
    place, uv = blender_corners(values, mode)
    ours = np.concatenate([t.points[t.corners][..., :2].reshape(-1, 2), t.primvars["uv"].reshape(-1, 2)], 1)
    theirs = np.concatenate([place, uv], 1)
    distance = np.linalg.norm(ours[:, None] - theirs[None], axis=-1)
    tolerance = SMOOTH_CORNER_TOLERANCE if mode == "none" else LIMIT_TOLERANCE
    assert distance.min(1).max() < tolerance
    assert distance.min(0).max() < tolerance
    assert stage


def test_corners_that_share_no_index_are_not_smoothed_together() -> None:
    """Without indices each corner has its own value, though the numbers agree: every face is an island."""
    points, counts, indices = grid()
    values = islands("whole")
    stage, mesh = define(points, counts, indices, "catmullClark")
    author(mesh, "uv", values, "faceVarying")
    loose = triangles(mesh)
    mesh.GetFaceVaryingLinearInterpolationAttr().Set("all")
    np.testing.assert_allclose(loose.primvars["uv"], triangles(mesh).primvars["uv"], atol=FLOAT32)
    assert stage


@pytest.mark.parametrize(
    ("interpolation", "values", "indices", "saying"),
    [
        ("vertex", 7, None, "holds 7 values, vertex interpolation needs 8"),
        ("faceVarying", 8, None, "holds 8 values, faceVarying interpolation needs 24"),
        ("constant", 2, None, "holds 2 values, constant interpolation needs 1"),
        ("vertex", 2, [0, 1, 2, 0, 0, 0, 0, 0], r"indices\[2\] is 2, but there are 2 values"),
    ],
)
@pytest.mark.parametrize("scheme", ["none", "catmullClark"])
def test_counts_that_do_not_fit(interpolation, values, indices, saying, scheme) -> None:
    stage, mesh = define(*CUBE, scheme)
    author(mesh, "uv", np.zeros((values, 2)), interpolation, indices)
    with pytest.raises(StageError, match=rf"^/Mesh.primvars:uv: {saying}"):
        triangles(mesh)
    assert stage


def test_numbers_that_are_not_finite() -> None:
    stage, mesh = define(*CUBE)
    author(mesh, "uv", np.array([[0, np.nan]]), "constant")
    with pytest.raises(StageError, match=r"^/Mesh: primvars:uv\[0\] is .*must be finite"):
        triangles(mesh)
    assert stage


def test_constant_primvars_are_inherited_and_shapes_take_them(read_scene) -> None:
    geometry = """
    def Xform "Group"
    {
        float primvars:rough = 0.25
        def Cube "Box" (
            prepend apiSchemas = ["MaterialBindingAPI"]
        )
        {
            rel material:binding = </World/Target/Paint>
            %s
        }
    }
    def Material "Paint"
    {
        token outputs:surface.connect = </World/Target/Paint/Surface.outputs:surface>
        def Shader "Surface"
        {
            uniform token info:id = "UsdPreviewSurface"
            float inputs:roughness.connect = </World/Target/Paint/Rough.outputs:result>
            token outputs:surface
        }
        def Shader "Rough"
        {
            uniform token info:id = "UsdPrimvarReader_float"
            string inputs:varname = "rough"
            float outputs:result
        }
    }"""
    values = read_scene(geometry % "").bodies[0].target.mesh.primvars["rough"]
    assert values.shape == (12, 3, 1)
    np.testing.assert_array_equal(values, 0.25)
    varying = 'float[] primvars:rough = [0, 1, 0, 1, 0, 1, 0, 1] (\ninterpolation = "vertex"\n)'
    with pytest.raises(UnsupportedError, match=r"^/World/Target/Group/Box.primvars:rough: varies over the Cube"):
        read_scene(geometry % varying, name="b.usda")


def test_display_color_over_the_faces_of_a_mesh(read_scene) -> None:
    mesh = """def Mesh "Pair"
    {
        int[] faceVertexCounts = [3, 3]
        int[] faceVertexIndices = [0, 1, 2, 0, 2, 3]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
        uniform token subdivisionScheme = "none"
        color3f[] primvars:displayColor = [(1, 0, 0), (0, 0, 1)] (
            interpolation = "uniform"
        )
        float[] primvars:displayOpacity = [0.5, 1] (
            interpolation = "uniform"
        )
    }"""
    target = read_scene(mesh).bodies[0].target
    assert target.materials[0].diffuse_color.name == "displayColor"
    assert target.materials[0].opacity.name == "displayOpacity"
    np.testing.assert_array_equal(target.mesh.primvars["displayColor"][:, 0], [[1, 0, 0], [0, 0, 1]])
    np.testing.assert_array_equal(target.mesh.primvars["displayOpacity"][:, 2], [[0.5], [1]])
    with pytest.raises(StageError, match=r"displayOpacity: its displayOpacity is 1.5"):
        read_scene(mesh.replace("[0.5, 1]", "[0.5, 1.5]"), name="b.usda")
