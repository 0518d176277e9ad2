"""The caster of rays against every triangle tried in double precision."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from spin_usd.geometry.camera import Camera
from spin_usd.renderers.embree.caster import EmbreeCaster, SceneInParts, first_stop, in_target_units, mesh_scene
from spin_usd.scene.derived.surface import visible_surface
from tests.authorities.first_hit import first_hit
from tests.cases.scenes import BARREL, SMALL, box, copied, pose, scene, soup, target

EDGE = (
    2e-6  # of a triangle, in barycentric weights, and of the target's radius: float32 may take either so near an edge
)

CASTER = EmbreeCaster()


def assert_sees_what_trial_sees(s, least=50) -> None:
    rays = np.insert(s.camera.centres(s.region).reshape(-1, 2), 2, 1.0, axis=1)
    triangles = s.T_cam_body.points(s.target.mesh.points)[s.target.mesh.faces]
    of_range = s.target.mesh.radius / max(s.T_cam_body.translation[2], s.target.mesh.radius)
    expected = first_hit(rays, triangles, doubt=EDGE, apart=EDGE * of_range)
    found = CASTER.visibility(s)
    assert found.region == s.region
    np.testing.assert_array_equal(found.face.ravel()[expected.sure], expected.face[expected.sure])
    assert expected.sure.mean() > 0.99
    assert (expected.face >= 0).sum() >= least


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("camera", [SMALL, BARREL])
def test_sees_the_nearest_triangle(seed, camera) -> None:
    q = np.random.default_rng(seed).normal(size=4)
    points, faces, parts = soup(seed)
    assert_sees_what_trial_sees(
        scene(target(points, faces, parts=parts), camera=camera, T_cam_body=pose(q, (0.4, -0.3, 5)))
    )


@pytest.mark.parametrize("z", [1.0, 1e3, 1e5, 1e7])
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_range_and_size_cost_no_precision(z, size) -> None:
    """A long lens shows the same at 10,000 km as a wide one nearby, and a millimetre as a kilometre; far off axis."""
    points, faces, parts = soup(7, size=0.2)
    focal, aside = 60 * z, 0.3
    camera = Camera(width=64, height=48, fx=focal, fy=focal, cx=30 - aside * focal, cy=25 + aside * focal)
    s = scene(
        target(points * size, faces, parts=parts),
        camera=camera,
        T_cam_body=pose((0.3, 0.5, -0.2, 0.7), np.array((aside * z, -aside * z, z)) * size),
    )
    assert_sees_what_trial_sees(s, least=300)


@pytest.mark.parametrize("seed", range(6))
def test_a_camera_among_the_triangles_sees_none_behind_it(seed) -> None:
    points, faces, parts = soup(seed, count=60)
    q = np.random.default_rng(seed).normal(size=4)
    s = scene(target(points, faces, parts=parts), T_cam_body=pose(q, (0.1, 0.2, 0.3)))
    assert s.region == s.camera.frame
    assert_sees_what_trial_sees(s)
    assert (visible_surface(s, CASTER.visibility(s)).z > 0).all()


@pytest.mark.parametrize("z", [2.5, 1e6])
def test_a_closed_body_has_no_holes(z) -> None:
    """No ray slips between two triangles that share an edge."""
    ball = trimesh.creation.icosphere(subdivisions=4)
    focal = 150 * z
    camera = Camera(width=400, height=400, fx=focal, fy=focal, cx=200, cy=200)
    face = CASTER.visibility(
        scene(target(ball.vertices, ball.faces), camera=camera, T_cam_body=pose((0.1, 0.7, 0.3, -0.2), (0, 0, z)))
    ).face
    rows = (face >= 0).any(axis=1)
    assert rows.sum() > 250
    first, last = (face >= 0).argmax(1), face.shape[1] - 1 - (face >= 0)[:, ::-1].argmax(1)
    columns = np.arange(face.shape[1])
    inside = rows[:, None] & (columns >= first[:, None]) & (columns <= last[:, None])
    assert (face[inside] >= 0).all()


def test_rays_aimed_at_edges_do_not_slip_between_the_triangles() -> None:
    """Through the edges of a ball's near half one would see its far half; where no random ray goes."""
    ball = trimesh.creation.icosphere(subdivisions=4)
    s = scene(target(ball.vertices, ball.faces), T_cam_body=pose((0.1, 0.7, 0.3, -0.2), (0.3, -0.2, 4)))
    share = np.random.default_rng(0).random((len(ball.edges_unique), 20, 1))
    start, end = ball.vertices[ball.edges_unique].swapaxes(0, 1)[:, :, None]
    points = s.T_cam_body.points(start + share * (end - start)).reshape(-1, 3)
    points = points[points[:, 2] < 3.5]
    face = CASTER.cast(s, points[:, :2] / points[:, 2:])
    assert len(points) > 30_000
    middles = s.T_cam_body.points(s.target.mesh.points[s.target.mesh.faces].mean(1))
    assert (face >= 0).all()
    assert (middles[face, 2] < 4).all()


def test_the_same_faces_whatever_the_region() -> None:
    """A pixel's face does not depend on which other pixels are rendered with it."""
    points, faces, parts = soup(2)
    s = scene(target(points, faces, parts=parts))
    whole = CASTER.visibility(s)
    row = s.region.shape[0] // 2
    one = CASTER.cast(s, s.camera.centres(s.region)[row, 20:21])
    assert one[0] == whole.face[row, 20]


def test_nothing_in_view_is_an_empty_picture() -> None:
    s = scene(target(*box()), T_cam_body=pose(t=(0, 0, -5)))
    assert CASTER.visibility(s).face.shape == (0, 0)


def test_meshes_are_kept_apart_and_let_go() -> None:
    caster = EmbreeCaster()
    near, far = scene(target(*box())), scene(target(*box((-0.1,) * 3, (0.1,) * 3)))
    first = caster.visibility(near).face
    assert (caster.visibility(far).face >= 0).sum() < (first >= 0).sum()
    np.testing.assert_array_equal(caster.visibility(near).face, first)
    assert len(caster._opened) == 2
    del near, far
    assert len(caster._opened) == 0


@pytest.mark.parametrize("seed", range(5))
def test_rays_meet_in_parts_what_they_meet_in_the_whole(monkeypatch, seed) -> None:
    """The nearest faces, and their places to the bit; what blocks; and what they meet behind holes."""
    monkeypatch.setattr("spin_usd.renderers.embree.caster.PART_FACES", 100)
    rng = np.random.default_rng(seed)
    points, faces, _ = soup(seed)
    matrices = np.zeros((9, 3, 4))
    matrices[..., :3] = np.linalg.qr(rng.normal(size=(9, 3, 3)))[0]
    matrices[..., 3] = rng.uniform(-1, 1, (9, 3))
    mesh = copied(target(points, faces).mesh, matrices)
    parts, whole = SceneInParts(mesh), mesh_scene(*in_target_units(mesh, mesh.placed))
    origins = rng.uniform(-1, 1, (2000, 3)).astype(np.float32)
    ways = rng.normal(size=origins.shape)
    ways = (ways / np.linalg.norm(ways, axis=1, keepdims=True)).astype(np.float32)
    ends = rng.uniform(0, 1, len(origins)).astype(np.float32)
    found = parts.run(origins, ways)
    assert len(np.unique(found // len(faces))) == 1 + len(matrices)
    np.testing.assert_array_equal(found, whole.run(origins, ways))
    found, expected = (each.run(origins, ways, dists=ends.copy(), output=True) for each in (parts, whole))
    for name, values in found.items():
        np.testing.assert_array_equal(values, expected[name])
    found, expected = (each.run(origins, ways, dists=ends.copy(), query="OCCLUDED") for each in (parts, whole))
    np.testing.assert_array_equal(found == -1, expected == -1)
    found, expected = (first_stop(each, origins, ways, lambda face, _: face % 3 == 0) for each in (parts, whole))
    np.testing.assert_array_equal(found, expected)


def test_copies_of_many_faces_are_opened_in_parts(monkeypatch) -> None:
    """And have the pictures of the same faces alone."""
    points, faces = box()
    matrices = np.tile(np.eye(3, 4), (30, 1, 1))
    matrices[..., 3] = np.random.default_rng(1).uniform(-1, 1, (30, 3))
    one = scene(replace(target(points, faces), mesh=copied(target(points, faces).mesh, matrices)))
    expected = EmbreeCaster().visibility(one).face
    monkeypatch.setattr("spin_usd.renderers.embree.caster.PART_FACES", 40)
    np.testing.assert_array_equal(EmbreeCaster().visibility(one).face, expected)
