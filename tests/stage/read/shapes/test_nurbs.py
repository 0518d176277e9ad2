"""NURBS patches: a rational cylinder and sphere, which are exact, and a bicubic patch against SciPy's splines."""

import numpy as np
import pytest
import trimesh
from pxr import Gf, Usd, UsdGeom, Vt
from scipy.interpolate import RectBivariateSpline

from spin_usd.errors import StageError, UnsupportedError
from spin_usd.stage.read.shapes.primitives import read_gprim

CHORD = 2e-4  # of a radius near 1: the patch's own chords, of its extent
ROOT = np.sqrt(0.5)
CIRCLE = np.array([[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]], float)
CIRCLE_WEIGHTS = np.array([1, ROOT, 1, ROOT, 1, ROOT, 1, ROOT, 1])
CIRCLE_KNOTS = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]
HALF = np.array([[0, -1], [1, -1], [1, 0], [1, 1], [0, 1]], float)  # distance from the axis, height
HALF_WEIGHTS = np.array([1, ROOT, 1, ROOT, 1])
HALF_KNOTS = [0, 0, 0, 1, 1, 2, 2, 2]


def patch(points, u, v, weights=None, **attributes):
    """points (v, u, 3); u and v: knots and order. Returns the prim and its stage, with which it dies."""
    stage = Usd.Stage.CreateInMemory()
    prim = UsdGeom.NurbsPatch.Define(stage, "/Patch")
    prim.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points.reshape(-1, 3).astype(np.float32)))
    for name, count, (knots, order) in (("u", points.shape[1], u), ("v", points.shape[0], v)):
        prim.GetPrim().GetAttribute(f"{name}VertexCount").Set(count)
        prim.GetPrim().GetAttribute(f"{name}Order").Set(order)
        prim.GetPrim().GetAttribute(f"{name}Knots").Set(Vt.DoubleArray(knots))
    if weights is not None:
        prim.CreatePointWeightsAttr(Vt.DoubleArray(weights.reshape(-1).tolist()))
    for name, value in attributes.items():
        prim.GetPrim().GetAttribute(name).Set(value)
    return prim.GetPrim(), stage


def sphere():
    ring = np.concatenate([CIRCLE, np.ones((9, 1))], 1)
    points = np.array([[[x * r, y * r, z] for x, y, _ in ring] for r, z in HALF])
    return points, (CIRCLE_KNOTS, 3), (HALF_KNOTS, 3), HALF_WEIGHTS[:, None] * CIRCLE_WEIGHTS


def read(prim):
    return read_gprim(prim, Usd.TimeCode.Default())


def test_a_rational_sphere_is_round_closed_and_has_its_normals() -> None:
    prim, _stage = patch(*sphere())
    found = read(prim)
    np.testing.assert_allclose(np.linalg.norm(found.points[np.unique(found.corners)], axis=1), 1, atol=1e-6)
    away = (found.normals * found.points[found.corners]).sum(-1)
    at_pole = abs(found.points[found.corners][..., 2]) > 1 - 1e-6
    np.testing.assert_allclose(away[~at_pole], 1, atol=1e-6)
    assert (away[at_pole] > 0.99).all()
    solid = trimesh.Trimesh(found.points, found.corners)
    assert solid.volume == pytest.approx(4 / 3 * np.pi, rel=5 * CHORD)


def test_a_range_cuts_the_patch_and_handedness_turns_it() -> None:
    prim, _stage = patch(*sphere(), vRange=Gf.Vec2d(1, 2))
    upper = read(prim)
    assert upper.points[np.unique(upper.corners), 2].min() == pytest.approx(0, abs=1e-7)
    turned, _other = patch(*sphere(), orientation="leftHanded")
    assert trimesh.Trimesh(read(turned).points, read(turned).corners).volume < 0


def test_a_bicubic_patch_is_scipys_surface() -> None:
    x, y = np.linspace(0, 3, 7), np.linspace(0, 2, 6)
    spline = RectBivariateSpline(x, y, np.sin(x)[:, None] * np.cos(y), kx=3, ky=3)
    tx, ty = spline.get_knots()
    coefficients = spline.get_coeffs().reshape(7, 6)
    greville = [np.array([t[i + 1 : i + 4].mean() for i in range(n)]) for t, n in ((tx, 7), (ty, 6))]
    points = np.stack([*np.meshgrid(*greville, indexing="ij"), coefficients], -1).swapaxes(0, 1)  # u along x
    prim, _stage = patch(points, (tx.tolist(), 4), (ty.tolist(), 4))
    found = read(prim)
    np.testing.assert_allclose(found.points[:, 2], spline.ev(found.points[:, 0], found.points[:, 1]), atol=1e-6)
    assert (found.normals[..., 2] > 0).all()


def test_a_flat_patch_takes_few_triangles() -> None:
    corners = np.array([[[0, 0, 0], [1, 0, 0]], [[0, 1, 0], [1, 1, 0]]], float)
    prim, _stage = patch(corners, ([0, 0, 1, 1], 2), ([0, 0, 1, 1], 2))
    assert len(read(prim).corners) == 8


def test_what_is_no_patch() -> None:
    points, u, v, weights = sphere()
    prim, _stage = patch(points, (u[0][:-1], 3), v, weights)
    with pytest.raises(StageError, match=r"^/Patch: has 9 points, order 3 and 11 knots along u"):
        read(prim)
    prim, _stage = patch(points, u, v, weights[:-1])
    with pytest.raises(StageError, match=r"^/Patch: has 45 points and 36 weights, expected 9 x 5"):
        read(prim)
    trimmed, _other = patch(points, u, v, weights)
    trimmed.GetAttribute("trimCurve:counts").Set(Vt.IntArray([1]))
    with pytest.raises(UnsupportedError, match=r"^/Patch: is trimmed by curves"):
        read(trimmed)
