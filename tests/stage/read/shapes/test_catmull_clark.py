"""Catmull-Clark: the properties of its limit surface, and those of sharp edges."""

from typing import Any

import numpy as np
import pytest
import trimesh
from pxr import Usd, UsdGeom, Vt
from scipy.interpolate import BSpline

from spin_usd.stage.read.shapes import cage as cages
from spin_usd.stage.read.shapes import catmull_clark
from spin_usd.stage.read.shapes.mesh import read_mesh

ROUNDING = 1e-12
FLOAT32 = 1e-6
CUBE = (
    np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float),
    np.full(6, 4),
    np.array([0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3]),
)
CUBE_EDGES = [(a, b) for a in range(8) for b in range(a + 1, 8) if bin(a ^ b).count("1") == 1]


def cage(points, counts, indices, creases=None, corners=None):
    return cages.cage(points, counts, indices, creases or {}, np.zeros(len(points)) if corners is None else corners)


def refined(c, levels):
    for _ in range(levels):
        c = catmull_clark.refine(c)
    return c


def grid(n):
    """A flat-topped sheet of n x n quadrangles over [0, n]^2, bumpy in z."""
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij")
    points = np.stack([x, y, np.sin(2 * x) + np.cos(3 * y) + x * y / 5], -1).reshape(-1, 3)
    corner = np.arange((n + 1) * (n + 1)).reshape(n + 1, n + 1)
    quads = np.stack([corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]], -1).reshape(-1, 4)
    return points, np.full(n * n, 4), quads.reshape(-1)


def bspline(points, n, u, v):
    """The uniform bicubic B-spline of a grid: what Catmull-Clark's limit is, away from boundaries."""
    basis = BSpline.basis_element([-2, -1, 0, 1, 2], extrapolate=False)
    net = points.reshape(n + 1, n + 1, 3)
    wu, wv = (np.nan_to_num(basis(at - np.arange(n + 1))) for at in (u, v))
    return np.einsum("i,j,ijk->k", wu, wv, net)


def test_inside_a_grid_the_limit_is_the_bicubic_b_spline() -> None:
    points, counts, indices = grid(6)
    c = refined(cage(points, counts, indices), 2)
    limit = catmull_clark.limit(c)

    inside = (limit[:, :2] >= 1.5).all(1) & (limit[:, :2] <= 4.5).all(1)
    assert inside.sum() > 100
    for x, y, z in limit[inside]:
        np.testing.assert_allclose([x, y, z], bspline(points, 6, x, y), atol=1e-9)


def test_the_limit_does_not_depend_on_the_level_it_is_taken_from() -> None:
    ring = dict.fromkeys([(0, 1), (1, 3), (2, 3), (0, 2)], cages.INFINITE)
    for creases in ({}, ring):
        once, thrice = refined(cage(*CUBE, creases), 1), refined(cage(*CUBE, creases), 3)
        # Points keep their numbers from level to level: the first of the third level are those of the first.
        a, b = catmull_clark.limit(once), catmull_clark.limit(thrice)[: len(once.points)]
        np.testing.assert_allclose(a, b, atol=ROUNDING)


def test_affine_invariance() -> None:
    rng = np.random.default_rng(3)
    linear, shift = rng.normal(size=(3, 3)), rng.normal(size=3)
    points, counts, indices = CUBE
    a = catmull_clark.limit(refined(cage(points, counts, indices), 2)) @ linear + shift
    b = catmull_clark.limit(refined(cage(points @ linear + shift, counts, indices), 2))
    np.testing.assert_allclose(a, b, atol=ROUNDING)


def test_a_cubes_corner_goes_where_the_valence_rule_says() -> None:
    """(n^2 v + 4 sum of neighbours + sum of the quads' far corners) / (n (n + 5)) with n = 3 on the first level."""
    points = catmull_clark.limit(refined(cage(*CUBE), 1))
    # First level: corner 5/9 (1, 1, 1); neighbours (3/4, 3/4, 0) and so on; far corners (1, 0, 0) and so on.
    expected = (9 * 5 / 9 + 4 * 2 * 3 / 4 + 1) / 24
    np.testing.assert_allclose(abs(points[:8]), np.full((8, 3), expected), atol=ROUNDING)


def test_everything_sharp_keeps_the_shape() -> None:
    creases = dict.fromkeys(CUBE_EDGES, cages.INFINITE)
    c = refined(cage(*CUBE, creases), 2)
    mesh = trimesh.Trimesh(catmull_clark.limit(c), c.indices.reshape(-1, 4)[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3))
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(8)


def test_a_sharpness_of_one_lasts_one_step() -> None:
    creases = dict.fromkeys(CUBE_EDGES, 1.0)
    once = refined(cage(*CUBE, creases), 1)
    assert not once.edge_sharpness.any()
    np.testing.assert_allclose(abs(once.points).max(1), 1)  # after one sharp step it is still the cube
    smooth = catmull_clark.limit(refined(cage(once.points, once.counts, once.indices), 1))
    np.testing.assert_allclose(catmull_clark.limit(refined(cage(*CUBE, creases), 2)), smooth, atol=ROUNDING)


def test_a_sharpness_of_two_lasts_two_steps() -> None:
    once = refined(cage(*CUBE, dict.fromkeys(CUBE_EDGES, 2.0)), 1)
    assert set(once.edge_sharpness) == {0.0, 1.0}
    twice = catmull_clark.refine(once)
    assert not twice.edge_sharpness.any()
    np.testing.assert_allclose(abs(twice.points).max(1), 1)


def test_a_boundary_is_a_cubic_b_spline_curve_and_its_corners_stay() -> None:
    points, counts, indices = grid(4)
    corners = cages.lonely_corners(counts, indices, len(points))
    limit = catmull_clark.limit(refined(cage(points, counts, indices, corners=corners), 2))
    np.testing.assert_allclose(limit[[0, 4, 20, 24]], points[[0, 4, 20, 24]])
    side = points[:5]
    np.testing.assert_allclose(limit[2], (side[1] + 4 * side[2] + side[3]) / 6, atol=ROUNDING)


def test_any_polygon_gives_quadrangles_and_a_closed_surface() -> None:
    prism = np.array([[np.cos(a), np.sin(a), z] for z in (-1, 1) for a in np.linspace(0, 2 * np.pi, 5, endpoint=False)])
    faces = [[4, 3, 2, 1, 0], [5, 6, 7, 8, 9], *([i, (i + 1) % 5, 5 + (i + 1) % 5, 5 + i] for i in range(5))]
    counts, indices = np.array([len(f) for f in faces]), np.concatenate(faces)
    c = refined(cage(prism, counts, indices), 2)
    assert (np.bincount(c.source) == counts * 4).all()
    mesh = trimesh.Trimesh(catmull_clark.limit(c), c.indices.reshape(-1, 4)[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3))
    assert mesh.is_watertight
    assert 0 < mesh.volume < trimesh.convex.convex_hull(prism).volume


def read(**attributes):
    stage = Usd.Stage.CreateInMemory()
    mesh = UsdGeom.Mesh.Define(stage, "/Mesh")
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(CUBE[0].astype(np.float32)))
    mesh.CreateFaceVertexCountsAttr(CUBE[1].tolist())
    mesh.CreateFaceVertexIndicesAttr(CUBE[2].tolist())
    for name, value in attributes.items():
        mesh.GetPrim().GetAttribute(name).Set(value)
    return read_mesh(mesh.GetPrim(), Usd.TimeCode(0))


def test_normals_are_smooth_and_point_outwards() -> None:
    t = read()
    facing = trimesh.Trimesh(t.points, t.corners, process=False).face_normals
    assert ((t.normals * facing[:, None]).sum(-1) > 0.9).all()
    by_point: dict[Any, Any] = {}
    for point, normal in zip(t.corners.reshape(-1), t.normals.reshape(-1, 3), strict=True):
        np.testing.assert_allclose(by_point.setdefault(point, normal), normal, atol=ROUNDING)


def test_creases_as_the_schema_writes_them() -> None:
    """One crease around the bottom face, one sharpness for it or one for each of its edges: a flat, square bottom."""
    ring = {"creaseIndices": [0, 2, 6, 4, 0], "creaseLengths": [5]}
    for sharpness in ([10.0], [10.0] * 4):
        t = read(**ring, creaseSharpnesses=sharpness, cornerIndices=[0, 2, 4, 6], cornerSharpnesses=[10.0] * 4)
        bottom = t.source == 4
        np.testing.assert_allclose(t.points[t.corners[bottom]][..., 2], -1, atol=FLOAT32)
        np.testing.assert_allclose(np.ptp(t.points[t.corners[bottom]].reshape(-1, 3), axis=0)[:2], 2, atol=FLOAT32)
        np.testing.assert_allclose(
            t.normals[bottom], np.broadcast_to([0, 0, -1], t.normals[bottom].shape), atol=FLOAT32
        )


def test_bilinear_keeps_the_cube_and_its_flat_faces() -> None:
    t = read(subdivisionScheme="bilinear")
    mesh = trimesh.Trimesh(t.points, t.corners, process=False)
    assert len(t.corners) == 6 * 16 * 2
    assert mesh.volume == pytest.approx(8)
    np.testing.assert_allclose(t.normals, np.repeat(mesh.face_normals[:, None], 3, axis=1), atol=FLOAT32)


def test_left_handed_subdivision_keeps_normals_with_faces() -> None:
    t = read(orientation="leftHanded")
    facing = trimesh.Trimesh(t.points, t.corners, process=False).face_normals
    assert ((t.normals * facing[:, None]).sum(-1) > 0.9).all()
    assert trimesh.Trimesh(t.points, t.corners, process=False).volume < 0
