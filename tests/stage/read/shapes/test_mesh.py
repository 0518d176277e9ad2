"""Meshes of every face size: triangulated without loss, refused when they are none."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from pxr import Gf, Usd, UsdGeom, Vt

from spin_usd.errors import StageError, UnsupportedError
from spin_usd.geometry.triangles import newell
from spin_usd.stage.read.shapes.mesh import read_mesh, triangulate
from spin_usd.stage.read.shapes.triangles import face_normals

AREA_TOLERANCE = 1e-12  # double precision sums of a few triangles
FLOAT32 = 1e-6


def define(points, counts, indices, scheme="none", **attributes):
    stage = Usd.Stage.CreateInMemory()
    mesh = UsdGeom.Mesh.Define(stage, "/Mesh")
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.asarray(points, np.float32).reshape(-1, 3)))
    mesh.CreateFaceVertexCountsAttr(counts)
    mesh.CreateFaceVertexIndicesAttr(indices)
    mesh.CreateSubdivisionSchemeAttr(scheme)
    for name, value in attributes.items():
        mesh.GetPrim().GetAttribute(name).Set(value)
    return stage, mesh


def triangles(*arguments, **attributes):
    stage, mesh = define(*arguments, **attributes)
    assert stage
    return read_mesh(mesh.GetPrim(), Usd.TimeCode(0))


def solid(t):
    return trimesh.Trimesh(t.points, t.corners, process=False)


CUBE = (
    [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)],
    [4] * 6,
    [0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3],
)
SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


def star(radii, tilt):
    """A star-shaped polygon (n, 3) with these radii, in a tilted plane."""
    angle = np.linspace(0, 2 * np.pi, len(radii), endpoint=False)
    flat = np.stack([radii * np.cos(angle), radii * np.sin(angle), 0 * angle], 1)
    c, s = np.cos(tilt), np.sin(tilt)
    return flat @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]]) + [3, 4, 5]


@settings(deadline=None, max_examples=60)
@given(st.lists(st.floats(0.2, 3.0), min_size=4, max_size=14), st.floats(0, 6.0))
def test_any_star_shaped_polygon_keeps_its_area_and_winding(radii, tilt) -> None:
    points = star(np.array(radii), tilt)
    corners, source, crossing = triangulate(points, np.array([len(points)]), np.arange(len(points)), "/Mesh")
    assert len(corners) == len(points) - 2
    assert not source.any()
    assert not len(crossing)
    areas = newell(points[corners])
    whole = newell(points)
    np.testing.assert_allclose(areas.sum(0), whole, atol=AREA_TOLERANCE * 1e3)
    assert (areas @ whole > -1e-9).all()  # none turned over: so none overlap


def test_faces_of_three_to_nine_corners_keep_their_order() -> None:
    polygons = [star(np.full(n, float(n)), 0.3) for n in range(3, 10)]
    counts = np.array([len(p) for p in polygons])
    corners, source, _ = triangulate(np.concatenate(polygons), counts, np.arange(counts.sum()), "/Mesh")
    assert (np.bincount(source) == counts - 2).all()
    assert (np.diff(source) >= 0).all()
    assert (np.searchsorted(np.cumsum(counts), corners, side="right") == source[:, None]).all()


CROSSING = {
    "with a rest": [[0, 0, 0], [2, 2, 0], [2, 0, 0], [0, 2, 0], [-1, 1, 0]],
    "whose areas cancel out": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]],
    "a sliver folded by rounding": [[0.66, 0.26, 4.53e-4], [0.66, -0.26, 4.53e-4], [0.66, -0.09, 4.63e-4],
                                    [0.66, 0.09, 4.22e-4]],
}  # fmt: skip


@pytest.mark.parametrize("kind", CROSSING)
def test_a_polygon_that_crosses_itself_is_a_fan_and_is_told(kind) -> None:
    points = np.array(CROSSING[kind], float)
    square = np.add(SQUARE, [0, 0, 9])
    counts = np.array([4, len(points)])
    corners, source, crossing = triangulate(np.concatenate([square, points]), counts, np.arange(counts.sum()), "/Mesh")
    assert crossing.tolist() == [1]
    assert corners[source == 1].tolist() == [[4, i, i + 1] for i in range(5, 3 + len(points))]


def test_a_polygon_with_a_hole_by_a_bridge() -> None:
    outer = [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]]
    inner = [[1, 1, 0], [1, 3, 0], [3, 3, 0], [3, 1, 0]]
    t = triangles(outer + inner, [10], [0, 1, 2, 3, 0, 4, 5, 6, 7, 4])
    assert solid(t).area == pytest.approx(12)


def test_a_square_ring_of_cubes_is_closed() -> None:
    assert solid(triangles(*CUBE)).is_watertight
    assert solid(triangles(*CUBE)).volume == pytest.approx(1)


def test_left_handed_faces_are_turned() -> None:
    points, counts, indices = CUBE
    mirrored = [[-x, y, z] for x, y, z in points]
    t = triangles(mirrored, counts, indices, orientation="leftHanded")
    assert solid(t).volume == pytest.approx(1)
    np.testing.assert_allclose(t.normals[:, 0], solid(t).face_normals, atol=FLOAT32)


def test_holes_are_left_out() -> None:
    t = triangles(*CUBE, holeIndices=[2, 5])
    assert set(t.source) == {0, 1, 3, 4}


def test_triangles_without_area_are_dropped() -> None:
    t = triangles([*SQUARE, [2, 0, 0]], [4, 3, 3], [0, 1, 2, 3, 0, 1, 4, 0, 0, 2])
    assert list(t.source) == [0, 0]


def test_velocities_do_not_move_the_points_of_their_own_sample() -> None:
    t = triangles(SQUARE, [4], [0, 1, 2, 3], velocities=Vt.Vec3fArray([Gf.Vec3f(1, 1, 1)] * 4))
    np.testing.assert_allclose(t.points, SQUARE)


@pytest.mark.parametrize(
    ("interpolation", "count"), [("constant", 1), ("uniform", 6), ("vertex", 8), ("varying", 8), ("faceVarying", 24)]
)
def test_normals_of_every_interpolation(interpolation, count) -> None:
    stage, mesh = define(*CUBE)
    normals = np.random.default_rng(1).normal(size=(count, 3)).astype(np.float32)
    mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(normals))
    mesh.SetNormalsInterpolation(interpolation)
    t = read_mesh(mesh.GetPrim(), Usd.TimeCode(0))
    indices = np.array(CUBE[2]).reshape(6, 4)
    assert ((t.normals.sum(1) * face_normals(t.points, t.corners)).sum(1) >= 0).all()  # those against it are turned
    for corner_points, corner_normals, face in zip(t.corners, t.normals, t.source, strict=True):
        for point, normal in zip(corner_points, corner_normals, strict=True):
            place = int(face * 4 + np.flatnonzero(indices[face] == point)[0])
            which = {"constant": 0, "uniform": face, "faceVarying": place}.get(interpolation, point)
            own = normals[which] / np.linalg.norm(normals[which])
            np.testing.assert_allclose(np.abs(normal), np.abs(own), atol=FLOAT32)
    assert stage


def test_primvar_normals_win_and_follow_their_indices() -> None:
    stage, mesh = define(*CUBE)
    mesh.CreateNormalsAttr(Vt.Vec3fArray([Gf.Vec3f(1, 0, 0)] * 8))
    primvar = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("normals", mesh.GetNormalsAttr().GetTypeName(), "uniform")
    primvar.Set(Vt.Vec3fArray([Gf.Vec3f(0, 1, 0), Gf.Vec3f(0, 0, 2)]))
    primvar.SetIndices(Vt.IntArray([1, 0, 0, 0, 0, 0]))
    t = read_mesh(mesh.GetPrim(), Usd.TimeCode(0))
    np.testing.assert_allclose(t.normals[t.source == 0], np.broadcast_to([0, 0, 1], (2, 3, 3)))
    np.testing.assert_allclose(np.abs(t.normals[t.source > 0]), np.broadcast_to([0, 1, 0], (10, 3, 3)))
    assert stage


BAD = {
    "a face needs 3 corners": (SQUARE, [2, 4], [0, 1, 0, 1, 2, 3], {}),
    "faceVertexCounts require 5 indices": (SQUARE, [5], [0, 1, 2, 3], {}),
    r"faceVertexIndices\[3\] is 4, but there are 4 points": (SQUARE, [4], [0, 1, 2, 4], {}),
    r"faceVertexIndices\[0\] is -1": (SQUARE, [4], [-1, 1, 2, 3], {}),
    r"points\[1\] is \[nan": ([[0, 0, 0], [np.nan, 0, 0], [1, 1, 0]], [3], [0, 1, 2], {}),
    r"points\[2\] is \[inf": ([[0, 0, 0], [1, 0, 0], [np.inf, 1, 0]], [3], [0, 1, 2], {}),
    "mesh of 4 points and 0 faces": (SQUARE, [], [], {}),
    "mesh of 0 points and 1 faces": ([], [3], [0, 1, 2], {}),
    "no face with an area": (SQUARE, [3], [0, 0, 1], {}),
    r"holeIndices\[0\] is 1": (SQUARE, [4], [0, 1, 2, 3], {"holeIndices": [1]}),
    "holds 3 values, vertex interpolation needs 4": (
        SQUARE,
        [4],
        [0, 1, 2, 3],
        {"normals": Vt.Vec3fArray([Gf.Vec3f(0, 0, 1)] * 3)},
    ),
    r"normals\[2\] is \[ *0. +0. +nan": (
        SQUARE,
        [4],
        [0, 1, 2, 3],
        {"normals": Vt.Vec3fArray([Gf.Vec3f(0, 0, v) for v in (1, 1, float("nan"), 1)])},
    ),
}


@pytest.mark.parametrize("saying", BAD)
def test_numbers_that_are_no_mesh(saying) -> None:
    points, counts, indices, attributes = BAD[saying]
    with pytest.raises(StageError, match=f"^/Mesh.*{saying}"):
        triangles(points, counts, indices, **attributes)


@pytest.mark.parametrize(
    ("scheme", "attributes", "saying"),
    [
        ("loop", {}, "subdivision scheme loop and a face of 4 corners; triangulate it"),
        ("catmullClark", {"interpolateBoundary": "none"}, "interpolateBoundary"),
        (
            "catmullClark",
            {"creaseIndices": [0, 1], "creaseLengths": [2], "creaseSharpnesses": [1.5]},
            "creaseSharpnesses such as",
        ),
        ("catmullClark", {"cornerIndices": [0], "cornerSharpnesses": [0.5]}, "cornerSharpnesses such as"),
    ],
)
def test_what_subdivision_does_not_do_is_refused(scheme, attributes, saying) -> None:
    with pytest.raises(UnsupportedError, match=f"^/Mesh: has {saying}"):
        triangles(*CUBE, scheme, **attributes)
