"""The ray caster against every triangle tried in double precision, and light worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from spin_usd.geometry.camera import Camera
from spin_usd.renderers.raycast.renderer import RaycastRenderer
from spin_usd.scene.derived.surface import visible_surface
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import DistantLight
from spin_usd.scene.material import Material
from tests.cases.scenes import BARREL, SMALL, box, pose, scene, soup, target

EDGE = 2e-6  # of a triangle, in barycentric weights: float32 may take a ray that passes so near an edge for either side
RADIANCE = 1e-6  # relative: float32 of the result
SILHOUETTE = 0.02  # relative: area of a triangle counted by 64 rays for each of 2,000 pixels of its rim

RENDERER = RaycastRenderer()
WHITE = Material(path="/white", diffuse_color=(1, 1, 1))


def faces_by_trial(s):
    """First face (rows, columns) by trying each triangle in double precision (Moeller and Trumbore, 1997), or -1; and
    the pixels whose ray passes an edge of any triangle in front too near to call."""
    region, mesh = s.region, s.target.mesh
    rays = np.insert(s.camera.centres(region).reshape(-1, 2), 2, 1.0, axis=1)
    nearest, face = np.full(len(rays), np.inf), np.full(len(rays), -1)
    unsure = np.zeros(len(rays), bool)
    for i, (a, b, c) in enumerate(s.T_cam_body.points(mesh.points)[mesh.faces]):
        p = np.cross(rays, c - a)
        det = p @ (b - a)
        q = np.cross(-a, b - a)
        u, v, z = (p @ -a) / det, (rays @ q) / det, ((c - a) @ q) / det
        weights = np.stack([u, v, 1 - u - v], -1).min(-1)
        near_edge = (np.abs(weights) < EDGE) & (z > 0)
        closer = (weights >= 0) & (z > 0) & (z < nearest)
        nearest, face = np.where(closer, z, nearest), np.where(closer, i, face)
        unsure |= near_edge
    return face.reshape(region.shape), unsure.reshape(region.shape)


def assert_sees_what_trial_sees(s, least=50) -> None:
    face, unsure = faces_by_trial(s)
    found = RENDERER.visibility(s)
    assert found.region == s.region
    np.testing.assert_array_equal(found.face[~unsure], face[~unsure])
    assert unsure.mean() < 0.01
    assert (face >= 0).sum() >= least


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
    assert (visible_surface(s, RENDERER.visibility(s)).z > 0).all()


@pytest.mark.parametrize("z", [2.5, 1e6])
def test_a_closed_body_has_no_holes(z) -> None:
    """No ray slips between two triangles that share an edge."""
    ball = trimesh.creation.icosphere(subdivisions=4)
    focal = 150 * z
    camera = Camera(width=400, height=400, fx=focal, fy=focal, cx=200, cy=200)
    face = RENDERER.visibility(
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
    face = RENDERER.cast(s, points[:, :2] / points[:, 2:])
    assert len(points) > 30_000
    middles = s.T_cam_body.points(s.target.mesh.points[s.target.mesh.faces].mean(1))
    assert (face >= 0).all()
    assert (middles[face, 2] < 4).all()


def test_the_same_faces_whatever_the_region() -> None:
    """A pixel's face does not depend on which other pixels are rendered with it."""
    points, faces, parts = soup(2)
    s = scene(target(points, faces, parts=parts))
    whole = RENDERER.visibility(s)
    row = s.region.shape[0] // 2
    one = RENDERER.cast(s, s.camera.centres(s.region)[row, 20:21])
    assert one[0] == whole.face[row, 20]


def test_nothing_in_view_is_an_empty_picture() -> None:
    s = scene(target(*box()), T_cam_body=pose(t=(0, 0, -5)))
    assert RENDERER.visibility(s).face.shape == (0, 0)
    assert RENDERER.radiance(s, Effort(samples=2), seed=0).rgb.shape == (0, 0, 3)


def test_meshes_are_kept_apart_and_let_go() -> None:
    renderer = RaycastRenderer()
    near, far = scene(target(*box())), scene(target(*box((-0.1,) * 3, (0.1,) * 3)))
    first = renderer.visibility(near).face
    assert (renderer.visibility(far).face >= 0).sum() < (first >= 0).sum()
    np.testing.assert_array_equal(renderer.visibility(near).face, first)
    assert len(renderer._opened) == 2
    del near, far
    assert len(renderer._opened) == 0


SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]])
SQUARE_FACES = np.array([[0, 2, 1], [0, 3, 2]])  # seen from -z


def sun(direction, irradiance=(1361.0, 1361.0, 1361.0)):
    return DistantLight(path="/sun", direction_cam=tuple(np.array(direction) / np.linalg.norm(direction)), irradiance=irradiance)  # fmt: skip  # noqa: E501


def lit_square(material=WHITE, **kwargs):
    return scene(target(SQUARE, SQUARE_FACES, materials=(material,)), **kwargs)


def middle(s, samples=1):
    radiance = RENDERER.radiance(s, Effort(samples=samples), seed=1)
    rows, columns = radiance.region.shape
    return radiance.rgb[rows // 2, columns // 2].astype(float)


@pytest.mark.parametrize("degrees", [0, 30, 60, 85])
@pytest.mark.parametrize("material", [WHITE, Material(path="/c", diffuse_color=(0.2, 0.5, 0.7))])
def test_a_matt_plate_reflects_by_lamberts_law(degrees, material) -> None:
    angle = np.radians(degrees)
    light = sun((np.sin(angle), 0, np.cos(angle)), (1361.0, 100.0, 1.0))
    expected = np.array(light.irradiance) * material.diffuse_color * np.cos(angle) / np.pi
    np.testing.assert_allclose(middle(lit_square(material, lights=[light])), expected, rtol=RADIANCE)


def test_lights_add_and_emission_needs_none() -> None:
    lights = [sun((0, 0, 1)), sun((1, 0, 1), (1.0, 2.0, 3.0))]
    glowing = replace(WHITE, emissive_color=(4.0, 5.0, 6.0))
    alone = [middle(lit_square(lights=[light])) for light in lights]
    np.testing.assert_allclose(middle(lit_square(glowing)), (4, 5, 6), rtol=RADIANCE)
    np.testing.assert_allclose(middle(lit_square(glowing, lights=lights)), np.add(sum(alone), (4, 5, 6)), rtol=RADIANCE)


def test_light_from_behind_does_not_shine_through() -> None:
    np.testing.assert_array_equal(middle(lit_square(lights=[sun((0, 0, -1))])), 0)
    np.testing.assert_array_equal(middle(lit_square(lights=[sun((1, 0, -1e-6))])), 0)


def test_metals_are_not_black() -> None:
    gold = Material(path="/gold", diffuse_color=(1, 0.8, 0.3), metallic=1.0)
    specular = Material(path="/s", diffuse_color=(0, 0, 0), specular_color=(1, 0.8, 0.3), use_specular_workflow=True)
    for material in (gold, specular):
        colour = middle(lit_square(material, lights=[sun((0, 0, 1), (np.pi,) * 3)]))
        np.testing.assert_allclose(colour, (1, 0.8, 0.3), rtol=RADIANCE)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_shadows_are_hard_and_where_they_belong(size) -> None:
    """A small plate above a large one, the Sun at 45 degrees: its shadow is the plate itself, moved aside."""
    small, height = 0.2, 0.5
    points = np.concatenate([SQUARE, SQUARE * small - (0, 0, height)]) * size
    faces = np.concatenate([SQUARE_FACES, SQUARE_FACES + 4])
    s = scene(
        target(points, faces, parts=np.array([1, 1, 2, 2]), materials=(WHITE,)),
        T_cam_body=pose(t=np.array((0, 0, 4)) * size),
        lights=[sun((1, 0, 1))],
    )
    surface = visible_surface(s, RENDERER.visibility(s))
    lit = (
        RENDERER.radiance(s, Effort(samples=1), seed=0).rgb[
            surface.rows - s.region.y0, surface.columns - s.region.x0, 0
        ]
        > 0
    )
    x, y = surface.body[:, 0] / size - height, surface.body[:, 1] / size
    shaded = (surface.part == 1) & (np.abs(x) < small) & (np.abs(y) < small)
    rim = (surface.part == 1) & (np.abs(np.maximum(np.abs(x), np.abs(y)) - small) < 1e-3)
    assert shaded.sum() > 20
    np.testing.assert_array_equal(lit[~rim], ~shaded[~rim])


def test_a_round_body_does_not_shade_itself() -> None:
    """No speckles: on a faceted sphere with smooth normals all that faces the Sun is lit."""
    ball = trimesh.creation.icosphere(subdivisions=4)
    normals = np.asarray(ball.vertices)[ball.faces]
    s = scene(target(ball.vertices, ball.faces, corner_normals=normals, materials=(WHITE,)), lights=[sun((0, 0, 1))])
    surface = visible_surface(s, RENDERER.visibility(s))
    rgb = RENDERER.radiance(s, Effort(samples=1), seed=0).rgb[surface.rows - s.region.y0, surface.columns - s.region.x0]
    facing = surface.body[:, 2] < -0.1
    assert facing.sum() > 500
    expected = -surface.body[facing, 2] / np.linalg.norm(surface.body[facing], axis=1) * 1361 / np.pi
    np.testing.assert_allclose(rgb[facing, 0], expected, rtol=0.02)


def test_samples_fill_the_pixel() -> None:
    """The light gathered from a small glowing triangle is that of its exact area."""
    corners = np.array([[-0.31, -0.22, 0], [0.17, 0.33, 0], [0.27, -0.19, 0]])
    camera = Camera(width=24, height=24, fx=30, fy=30, cx=12, cy=12)
    glowing = Material(path="/g", diffuse_color=(0, 0, 0), emissive_color=(1.0, 1.0, 1.0))
    s = scene(target(corners, [[0, 1, 2]], materials=(glowing,)), camera=camera)
    a, b = (corners[1:] - corners[0])[:, :2] * camera.fx / 4
    area = abs(a[0] * b[1] - a[1] * b[0]) / 2
    total = RENDERER.radiance(s, Effort(samples=64), seed=3).rgb[..., 0].sum()
    assert total == pytest.approx(area, rel=SILHOUETTE)


def test_the_seed_decides_the_samples() -> None:
    points, faces, parts = soup(4)
    s = scene(target(points, faces, parts=parts, materials=(WHITE,)), lights=[sun((0.3, 0.2, 1))])
    first, again, other = (RENDERER.radiance(s, Effort(samples=4), seed=seed).rgb for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


def test_one_sample_is_the_pixel_centre() -> None:
    """Then the preview shows exactly what the labels describe."""
    points, faces, parts = soup(4)
    s = scene(target(points, faces, parts=parts, materials=(replace(WHITE, emissive_color=(1, 1, 1)),)))
    bright = RENDERER.radiance(s, Effort(samples=1), seed=9).rgb[..., 0] > 0
    np.testing.assert_array_equal(bright, RENDERER.visibility(s).face >= 0)


def test_versions_name_what_decides() -> None:
    assert set(RENDERER.versions()) == {"embreex", "numpy"}
