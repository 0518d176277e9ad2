"""Loop subdivision: trimesh's own as an authority for one step, and the properties of its limit surface."""

import numpy as np
import pytest
import trimesh
from pxr import Sdf, Usd, UsdGeom, Vt

from spin_usd.stage.read.shapes import loop
from spin_usd.stage.read.shapes.cage import INFINITE, cage
from spin_usd.stage.read.shapes.mesh import read_mesh
from spin_usd.stage.read.shapes.primvars import find_primvar

ROUNDING = 1e-12
FLOAT32 = 1e-6
CLOSED = {
    "tetrahedron": trimesh.Trimesh(
        [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ),
    "icosahedron": trimesh.creation.icosahedron(),
    "torus": trimesh.creation.torus(2.0, 0.7, major_sections=9, minor_sections=7),
}


def of(mesh, creases=None, corners=None):
    points = np.asarray(mesh.vertices, float)
    sharp = np.zeros(len(points)) if corners is None else corners
    return cage(points, np.full(len(mesh.faces), 3), np.asarray(mesh.faces).reshape(-1), creases or {}, sharp)


def refined(c, levels):
    for _ in range(levels):
        c = loop.refine(c)
    return c


def sheet(n):
    """A flat sheet of triangles whose inner points all have six neighbours."""
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij")
    points = np.stack([x + y / 2, y * np.sqrt(3) / 2, 0 * x], -1).reshape(-1, 3)
    at = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]
    faces = np.stack([np.stack([a, b, d], -1), np.stack([b, c, d], -1)]).reshape(-1, 3)
    return trimesh.Trimesh(points, faces, process=False)


@pytest.mark.parametrize("name", CLOSED)
def test_a_step_is_the_one_that_trimesh_takes(name) -> None:
    mesh = CLOSED[name]
    points, faces = trimesh.remesh.subdivide_loop(mesh.vertices, mesh.faces, iterations=1)
    own = refined(of(mesh), 1)
    theirs = points[faces].mean(1)
    mine = own.points[own.indices.reshape(-1, 3)].mean(1)
    order = [np.lexsort(np.round(each, 9).T) for each in (theirs, mine)]
    np.testing.assert_allclose(mine[order[1]], theirs[order[0]], atol=ROUNDING)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name == "torus" else name for name in CLOSED]
)
def test_the_limit_is_where_the_steps_lead(name) -> None:
    c = of(CLOSED[name])
    at_once, after_some = loop.limit(c), refined(c, 7).points[: len(c.points)]
    np.testing.assert_allclose(at_once, after_some, atol=1e-3)  # a step brings it nearer by a constant factor
    np.testing.assert_allclose(at_once, loop.limit(refined(c, 2))[: len(c.points)], atol=ROUNDING)


def test_inside_a_regular_sheet_linear_functions_are_kept() -> None:
    """Points and limit of a linear function on a regular net are the function itself, at the middles too."""
    mesh = sheet(6)
    c = refined(of(mesh), 2)
    plane = loop.limit(c)
    lifted = mesh.copy()
    lifted.vertices[:, 2] = mesh.vertices @ [0.3, -0.7, 0] + 0.25
    heights = loop.limit(refined(of(lifted), 2))[:, 2]
    inside = (plane[:, 1] > 1.8) & (plane[:, 1] < 3.4) & (plane[:, 0] > 3.2) & (plane[:, 0] < 5.4)
    assert inside.sum() > 50
    np.testing.assert_allclose(heights[inside], plane[inside] @ [0.3, -0.7, 0] + 0.25, atol=ROUNDING)
    regular = c.points[inside]  # every point of a regular net is the mean of its neighbours, before and after
    np.testing.assert_allclose(regular, plane[inside], atol=ROUNDING)


def test_creases_follow_the_cubic_b_spline_and_sharp_corners_stay() -> None:
    mesh = CLOSED["icosahedron"]
    a = int(mesh.edges[0, 0])
    ring = [int(v) for v in mesh.vertex_neighbors[a]][:2]
    creases = {tuple(sorted((a, b))): INFINITE for b in ring}
    limit = loop.limit(refined(of(mesh, creases), 2))
    first, second = mesh.vertices[ring]
    np.testing.assert_allclose(limit[a], (first + 4 * mesh.vertices[a] + second) / 6, atol=ROUNDING)
    corners = np.zeros(12)
    corners[a] = INFINITE
    np.testing.assert_allclose(loop.limit(refined(of(mesh, None, corners), 2))[a], mesh.vertices[a])


def read(mesh, **attributes):
    stage = Usd.Stage.CreateInMemory()
    prim = UsdGeom.Mesh.Define(stage, "/Mesh")
    prim.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(mesh.vertices.astype(np.float32)))
    prim.CreateFaceVertexCountsAttr([3] * len(mesh.faces))
    prim.CreateFaceVertexIndicesAttr(mesh.faces.reshape(-1).tolist())
    prim.CreateSubdivisionSchemeAttr("loop")
    for name, value in attributes.items():
        prim.GetPrim().GetAttribute(name).Set(value)
    rest = UsdGeom.PrimvarsAPI(prim).CreatePrimvar("rest", Sdf.ValueTypeNames.Float3Array, "vertex")
    rest.Set(Vt.Vec3fArray.FromNumpy(mesh.vertices.astype(np.float32)))
    time = Usd.TimeCode.Default()
    found = find_primvar(prim.GetPrim(), "rest", 3, time)
    assert found is not None
    return read_mesh(prim.GetPrim(), time, [found])


def test_a_mesh_becomes_a_smooth_closed_surface() -> None:
    read_one = read(CLOSED["icosahedron"])
    surface = trimesh.Trimesh(read_one.points, read_one.corners, process=False)
    assert len(read_one.corners) == 20 * 16
    assert (np.bincount(read_one.source) == 16).all()
    assert surface.is_watertight
    assert 0 < surface.volume < CLOSED["icosahedron"].volume
    radius = np.linalg.norm(read_one.points, axis=1)
    assert np.ptp(radius) < 0.02 * radius.mean()  # nearly round
    assert ((read_one.normals * read_one.points[read_one.corners]).sum(-1) > 0.99 * radius.min()).all()


def test_vertex_values_follow_the_surface_and_handedness_turns_it() -> None:
    own = read(CLOSED["torus"])
    np.testing.assert_allclose(own.primvars["rest"], own.points[own.corners], atol=FLOAT32)
    assert trimesh.Trimesh(own.points, own.corners, process=False).volume > 0
    mirrored = read(CLOSED["torus"], orientation="leftHanded")
    assert trimesh.Trimesh(mirrored.points, mirrored.corners, process=False).volume < 0
