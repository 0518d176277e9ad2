"""Surface points against exact rational arithmetic, and shading normals against a sphere's own."""

import tracemalloc
from fractions import Fraction

import numpy as np
import pytest
import trimesh

from spin_usd.geometry.camera import Camera
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.derived.surface import geometric_normals, shading_normals, visible_surface, weights_at
from spin_usd.scene.passes import Visibility
from tests.cases.instanced import placed
from tests.cases.scenes import GREY, SMALL, SPEEDPLUS, pose, scene, soup, target

RANGES = [1.0, 1e3, 1e5, 1e7]  # metres
EPSILON = np.finfo(float).eps
# The distance of a pixel's ray from the target's centre is the one number that carries the range: a few roundings of
# it, and of the target's own size, are all that may be off; divided by the cosine where the ray grazes the triangle.
ROUNDINGS = 8
GRAZING = 0.05  # cosine below which the division above is a matter of its own
SPHERE_NORMAL = 5e-3  # interpolated between vertices 5 degrees apart


def exact_hit(scene, column, row, face, ray):
    """Depth and body point (Fractions) of the ray (doubles, taken at their word) on the face's plane."""
    R = [[Fraction(float(v)) for v in line] for line in scene.T_cam_body.rotation]
    t = [Fraction(float(v)) for v in scene.T_cam_body.translation]
    corners = [[Fraction(float(v)) for v in scene.target.mesh.points[i]] for i in scene.target.mesh.faces[face]]
    a, b, c = ([sum(R[i][j] * p[j] for j in range(3)) + t[i] for i in range(3)] for p in corners)
    u, v = [b[i] - a[i] for i in range(3)], [c[i] - a[i] for i in range(3)]
    n = [u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3] for i in range(3)]
    d = [Fraction(float(x)) for x in ray]
    slope = sum(n[i] * d[i] for i in range(3))
    z = sum(n[i] * a[i] for i in range(3)) / slope
    p = [z * d[i] - t[i] for i in range(3)]
    cosine = abs(float(slope)) / np.sqrt(float(sum(x * x for x in n)) * float(sum(x * x for x in d)))
    return z, [sum(R[j][i] * p[j] for j in range(3)) for i in range(3)], cosine


def at_range(z, seed):
    """A soup of triangles at range z, as large in the picture at every range, and off the camera's axis."""
    points, faces, parts = soup(seed, size=0.3)
    camera = Camera(width=48, height=40, fx=40 * z, fy=39 * z, cx=23.0 - 8 * z, cy=21.0 + 5 * z)
    q = np.random.default_rng(seed).normal(size=4)
    return scene(target(points, faces, parts=parts), camera=camera, T_cam_body=pose(q, (0.2 * z, -5 / 39 * z, z)))


@pytest.mark.parametrize("z", RANGES)
@pytest.mark.parametrize("seed", [0, 1])
def test_points_are_exact_at_any_range(z, seed) -> None:
    """On their own ray and on their own triangle, to the rounding of the range."""
    s = at_range(z, seed)
    surface = visible_surface(s, EmbreeCaster().visibility(s))
    rays = s.camera.rays(np.stack([surface.columns + 0.5, surface.rows + 0.5], -1))
    rounding = ROUNDINGS * EPSILON * (z + s.target.mesh.radius)
    checked = 0
    for i in range(0, len(surface.z), 4):
        z_exact, body_exact, cosine = exact_hit(s, surface.columns[i], surface.rows[i], surface.face[i], rays[i])
        if cosine < GRAZING:
            continue
        checked += 1
        assert abs(float(Fraction(float(surface.z[i])) - z_exact)) <= rounding / cosine
        off = [float(Fraction(float(surface.body[i, k])) - body_exact[k]) for k in range(3)]
        assert np.abs(off).max() <= rounding / cosine
    assert checked > 50


@pytest.mark.parametrize("z", RANGES)
def test_points_project_onto_their_own_pixels(z) -> None:
    s = at_range(z, 2)
    surface = visible_surface(s, EmbreeCaster().visibility(s))
    uv = s.camera.project(s.T_cam_body.points(surface.body))
    np.testing.assert_allclose(uv, np.stack([surface.columns + 0.5, surface.rows + 0.5], -1), rtol=0, atol=1e-6)


def test_rows_columns_and_parts_are_those_of_the_pixels() -> None:
    points, faces, parts = soup(3)
    s = scene(target(points, faces, parts=parts))
    visibility = EmbreeCaster().visibility(s)
    surface = visible_surface(s, visibility)
    frame = np.full(s.camera.frame.shape, -1)
    frame[visibility.region.slices] = visibility.face
    np.testing.assert_array_equal(np.argwhere(frame >= 0), np.stack([surface.rows, surface.columns], -1))
    np.testing.assert_array_equal(frame[surface.rows, surface.columns], surface.face)
    np.testing.assert_array_equal(surface.part, parts[surface.face])


def test_a_triangle_seen_edge_on_keeps_its_own_depth() -> None:
    """A renderer may see a triangle whose plane holds the ray; its depth then is one of the triangle's."""
    camera = Camera(width=3, height=3, fx=3, fy=3, cx=1.5, cy=1.5)
    s = scene(target([[0, -1, -1], [0, 1, -1], [0, 0, 1.0]], [[0, 1, 2]]), camera=camera, T_cam_body=pose(t=(0, 0, 5)))
    region = s.region
    face = np.full(region.shape, -1, np.int32)
    face[1 - region.y0, 1 - region.x0] = 0
    surface = visible_surface(s, Visibility(region=region, face=face))
    assert 4 <= surface.z[0] <= 6
    assert np.isfinite(surface.body).all()


def test_nothing_visible_is_no_points() -> None:
    s = scene(target(*soup(0)[:2]), T_cam_body=pose(t=(0, 0, -9)))
    surface = visible_surface(s, EmbreeCaster().visibility(s))
    assert s.region.empty
    assert surface.z.shape == (0,)
    assert surface.body.shape == (0, 3)


def sphere():
    ball = trimesh.creation.uv_sphere(radius=1, count=[36, 72])
    vertices, faces = np.asarray(ball.vertices), np.asarray(ball.faces)
    return target(vertices, faces, corner_normals=vertices[faces])


@pytest.mark.parametrize("camera", [SMALL, SPEEDPLUS])
def test_shading_normals_of_a_sphere_are_its_radii(camera) -> None:
    s = scene(sphere(), camera=camera, T_cam_body=pose((0.3, 0.2, -0.7, 0.5), (0.4, 0.1, 6)))
    surface = visible_surface(s, EmbreeCaster().visibility(s))
    normals = shading_normals(s, surface.face, surface.body, weights_at(s.target.mesh, surface.face, surface.body))
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, rtol=1e-12)
    radii = surface.body / np.linalg.norm(surface.body, axis=1, keepdims=True)
    view = surface.body - s.T_cam_body.inverse().translation
    inside = -(radii * view).sum(1) / np.linalg.norm(view, axis=1) > 0.1  # not at the rim, where a chord looks away
    assert inside.mean() > 0.9
    np.testing.assert_allclose(normals[inside], radii[inside], rtol=0, atol=SPHERE_NORMAL)


def test_normals_face_the_camera_from_either_side() -> None:
    points, faces, parts = soup(5)
    s = scene(target(points, faces, parts=parts))
    surface = visible_surface(s, EmbreeCaster().visibility(s))
    towards = s.T_cam_body.inverse().translation - surface.body
    own = s.target.mesh.corner_normals[surface.face, 0]
    for normals in (
        shading_normals(s, surface.face, surface.body, weights_at(s.target.mesh, surface.face, surface.body)),
        geometric_normals(s, surface.face),
    ):
        assert ((normals * towards).sum(1) >= 0).all()
        np.testing.assert_allclose(np.abs((normals * own).sum(1)), 1, rtol=0, atol=1e-6)
    assert ((own * towards).sum(1) < 0).any()
    assert ((own * towards).sum(1) > 0).any()


def test_copies_of_a_shape_take_few_bytes_a_face() -> None:
    of = scene(placed(materials=(GREY, GREY), count=800))
    face = np.arange(10, dtype=np.int32)
    geometric_normals(of, face)  # fills what is kept
    tracemalloc.start()
    geometric_normals(of, face)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert of.target.mesh.count > 1_000_000
    assert peak < 6 * of.target.mesh.count
