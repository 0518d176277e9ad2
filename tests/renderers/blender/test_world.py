"""Light from all around on surfaces, against integrals worked out by hand or by quadrature."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.geometry.transform import Transform
from spin_usd.renderers.background.dome import bilinear_latlong, planes
from spin_usd.renderers.background.surroundings import Surroundings
from spin_usd.scene.derived.light_groups import LightGroups
from spin_usd.scene.effort import Effort
from spin_usd.scene.environment import Environment, Planet
from spin_usd.scene.light import DistantLight, DomeLight
from spin_usd.scene.material import Material
from spin_usd.scene.texture import Image
from tests.cases import scenes
from tests.cases.scenes import with_first

PRECISION = 0.005  # relative, at SAMPLES
SAMPLES = 4096
SUN = 1361.0
AROUND_X = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0.0]])


def axes(name, rotation=None):
    return Transform(to="cam", of=name, rotation=np.eye(3) if rotation is None else rotation, translation=np.zeros(3))


def dome(radiance=(1.0, 1.0, 1.0), image=None, rotation=None):
    return DomeLight(path="/Dome", T_cam_dome=axes("dome", rotation), radiance=radiance, image=image)


def planet(centre, radius=6.4e6, albedo=(0.3, 0.3, 0.3), **fields):
    T_cam_planet = replace(axes("planet"), translation=np.asarray(centre, float))
    return Planet(path="/Planet", T_cam_planet=T_cam_planet, radii=(radius,) * 3, albedo=albedo, **fields)


def sun(direction, irradiance=SUN):
    direction = np.asarray(direction, float) / np.linalg.norm(direction)
    return DistantLight(path="/Sun", direction_cam=tuple(direction), irradiance=(irradiance,) * 3)


def seen(blender, scene, samples=SAMPLES):
    """Mean radiance (3,) of the pixels that the target fills."""
    rgba = blender.radiance(scene, Effort(samples=samples), seed=3).rgba
    full = rgba[..., 3] > 0.9999
    assert full.sum() > 20
    return rgba[full][:, :3].mean(0)


@pytest.fixture
def tiny(speedplus):
    """Some 20 pixels across a body of a metre or two at 4 m."""
    return replace(speedplus, width=24, height=24, fx=40.0, fy=40.0, cx=12.0, cy=12.0, distortion=(0.0,) * 5)


@pytest.fixture
def facing(make_scene, square, tiny):
    """A white square that faces the camera, filling the middle of its picture."""

    def make(*, lights=(), planets=(), **options):
        scene = make_scene(*square, camera=tiny, lights=list(lights), **options)
        return replace(scene, environment=Environment(planets=tuple(planets)))

    return make


def test_without_domes_and_planets_there_is_no_world(blender, facing) -> None:
    import bpy

    blender.radiance(facing(lights=[dome()]), Effort(samples=1), seed=0)
    assert bpy.context.scene.world
    blender.radiance(facing(lights=[sun((0, 0, 1))], planets=()), Effort(samples=1), seed=0)
    assert bpy.context.scene.world is None
    assert Surroundings.of(facing(planets=[planet((0, 0, 1e8))])) is None  # no Sun shines on it


def test_white_furnace(blender, make_scene, tiny, lambert) -> None:
    """A white convex body in the light of 1 from everywhere is 1 everywhere: it cannot be seen."""
    scene = make_scene(*scenes.box(), camera=tiny, q=(0.8, 0.3, 0.4, 0.2), materials=[lambert], lights=[dome()])
    rgba = blender.radiance(scene, Effort(samples=SAMPLES), seed=0).rgba
    full = rgba[..., 3] > 0.9999
    assert full.sum() > 50
    np.testing.assert_allclose(rgba[full][:, :3], 1, rtol=PRECISION)


@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (100.0, 50.0, 0.0)])
def test_uniform_dome_gives_its_radiance(blender, facing, scale) -> None:
    np.testing.assert_allclose(seen(blender, facing(lights=[dome(scale)]), samples=64), scale, rtol=PRECISION)


def patch(row, column, height=32, value=100.0):
    """An image, black but for a bright patch of 3 x 3 texels around row and column."""
    pixels = np.zeros((height, 2 * height, 4), np.float32)
    pixels[..., 3] = 1
    pixels[row - 1 : row + 2, column - 1 : column + 2, :3] = value, 0.5 * value, 0.25 * value
    return Image(name="patch", pixels=pixels)


def irradiance_of(image, rotation, normal):
    """(3,) on a plane of `normal`, of a dome's image, by the sum over its bilinear interpolation at finer texels."""
    height = 16 * image.pixels.shape[0]
    longitude, latitude = np.meshgrid(
        ((np.arange(2 * height) + 0.5) / (2 * height) - 0.5) * 2 * np.pi,
        (0.5 - (np.arange(height) + 0.5) / height) * np.pi,
    )
    own = np.stack(
        [np.cos(latitude) * np.sin(longitude), np.sin(latitude), -np.cos(latitude) * np.cos(longitude)]
    ).reshape(3, -1)
    cosine = np.maximum(np.asarray(normal) @ rotation @ own, 0)
    solid = np.cos(latitude).ravel() * (np.pi / height) ** 2
    texels = bilinear_latlong(planes(image)[:3], np.float32(longitude.ravel()), np.float32(latitude.ravel()))
    return np.array([(channel * cosine * solid).sum() for channel in texels])


@pytest.mark.parametrize(
    ("row", "column", "turn"),
    [
        (16, 32, np.eye(3)),
        pytest.param(10, 20, np.eye(3), marks=pytest.mark.slow),
        pytest.param(22, 40, np.eye(3), marks=pytest.mark.slow),
        (5, 8, AROUND_X),
        pytest.param(12, 2, AROUND_X @ AROUND_X, marks=pytest.mark.slow),
        (20, 44, np.diag([-1.0, -1, 1])),
    ],
)
def test_an_image_lights_from_where_its_patch_is(blender, facing, row, column, turn) -> None:
    """A square that faces the camera; the dome is turned so that the patch is here and there."""
    image = patch(row, column)
    wanted = irradiance_of(image, turn, (0, 0, -1)) / np.pi
    got = seen(blender, facing(lights=[dome((2.0, 2.0, 1.0), image, turn)]), samples=SAMPLES)
    np.testing.assert_allclose(got, wanted * (2, 2, 1), rtol=PRECISION, atol=1e-6)


def lambert_phase(angle):
    """Of a Lambert sphere, 1 at 0. Source: J. H. Lambert, Photometria (1760); Russell (1916)."""
    return (np.sin(angle) + (np.pi - angle) * np.cos(angle)) / np.pi


@pytest.mark.parametrize("angle", [0.0, 60.0, 80.0])
@pytest.mark.parametrize("range_radii", [40.0, 1e5])
def test_a_far_planet_lights_by_lamberts_phase_law(blender, facing, angle, range_radii) -> None:
    """(2/3) albedo E (R / d)^2 phase(angle) on a plane that faces it; the Sun, at the plane's back, lights only it."""
    scene, wanted = far_planet(facing, angle, range_radii)
    got = seen(blender, scene, samples=1024) * np.pi
    # The nearer half is seen from nearer: of the series in R / d the first term is below this.
    np.testing.assert_allclose(got, wanted, rtol=PRECISION + 1.1 / range_radii)


@pytest.mark.parametrize("angle", [0.0, 90.0, 120.0, 150.0])
@pytest.mark.parametrize("range_radii", [1e4, 1e6])
def test_a_far_planet_has_all_its_light_in_the_image(facing, angle, range_radii) -> None:
    """Where the Sun stands before the plane too: the image alone."""
    scene, wanted = far_planet(facing, angle, range_radii)
    pixels = Surroundings.of(scene).pixels
    edges = np.sin(np.linspace(0.5, -0.5, len(pixels) + 1) * np.pi)
    solid = (edges[:-1] - edges[1:]) * np.pi / len(pixels)
    np.testing.assert_allclose((pixels.sum(1) * solid[:, None]).sum(0), wanted, rtol=PRECISION)


def far_planet(facing, angle, range_radii):
    """A scene whose only light is a planet behind the camera, and the irradiance of a plane that faces it."""
    radius, albedo, turn = 1e6, 0.6, np.radians(angle)
    light = sun((np.sin(turn), 0, -np.cos(turn)))  # from the planet the Sun is `angle` away from the plane
    scene = facing(lights=[light], planets=[planet((0, 0, -range_radii * radius), radius, (albedo,) * 3)])
    return scene, 2 / 3 * albedo * SUN / range_radii**2 * lambert_phase(turn)


@pytest.mark.parametrize("range_radii", [1.1, 2.0])
def test_a_planet_below_lights_as_its_disc_is_wide(blender, facing, range_radii) -> None:
    """Lit evenly it would be E sin^2 of its angular radius; here by the Sun: against quadrature over its surface."""
    radius, albedo = 6.4e6, 0.3
    scene = facing(lights=[sun((0, 0.3, -1))], planets=[planet((0, 0, -range_radii * radius), radius, (albedo,) * 3)])
    got = seen(blender, scene)
    np.testing.assert_allclose(got, by_quadrature(range_radii, albedo, scene.lights[0]) / np.pi, rtol=PRECISION)


def by_quadrature(range_radii, albedo, light, count=1500):
    """Irradiance on a plane that faces a Lambert sphere of radius 1 at that range, by the sum over its surface."""
    z = (np.arange(count) + 0.5) / count  # the near half
    turn = (np.arange(count) + 0.5) / count * 2 * np.pi
    z, turn = np.meshgrid(z, turn)
    side = np.sqrt(1 - z * z)
    normal = np.stack([side * np.cos(turn), side * np.sin(turn), z])
    way = np.array([0, 0, range_radii])[:, None, None] - normal
    distance = np.linalg.norm(way, axis=0)
    out = (normal * way).sum(0) / distance
    onto = way[2] / distance
    lit = np.maximum(-np.tensordot(light.direction_cam, normal, 1), 0)
    area = 2 * np.pi / count**2
    return (albedo * SUN / np.pi * lit * np.maximum(out, 0) * onto / distance**2 * area).sum()


def test_a_change_of_the_world_takes_effect(blender, facing) -> None:
    image = patch(16, 60)
    first = facing(lights=[dome((1.0, 1.0, 1.0), image)])
    second = facing(lights=[dome((1.0, 1.0, 1.0), image, AROUND_X)])
    third = facing(lights=[dome((3.0, 3.0, 3.0))])
    pictures = [
        blender.radiance(scene, Effort(samples=8), seed=0).rgba.tobytes() for scene in (first, second, third, first)
    ]
    assert len(set(pictures)) == 3
    assert pictures[0] == pictures[3]


def test_the_image_does_not_depend_on_how_the_camera_is_turned(facing) -> None:
    """A turned camera sees the same dome and planet from elsewhere: one image, another rotation."""
    scene = facing(lights=[sun((0, 0, 1)), dome(image=patch(10, 8))], planets=[planet((0, 2e7, 3e7))])
    turn = AROUND_X
    there = scene.T_cam_body
    turned = replace(there, rotation=turn @ there.rotation, translation=turn @ there.translation)
    other = replace(
        with_first(scene, T_cam_body=turned),
        lights=(
            replace(scene.lights[0], direction_cam=tuple(turn @ scene.lights[0].direction_cam)),
            replace(scene.lights[1], T_cam_dome=axes("dome", turn)),
        ),
        environment=Environment(
            planets=(
                replace(
                    scene.environment.planets[0],
                    T_cam_planet=replace(axes("planet", turn), translation=turn @ (0, 2e7, 3e7)),
                ),
            )
        ),
    )
    one, two = Surroundings.of(scene), Surroundings.of(other)
    assert one.key == two.key
    np.testing.assert_allclose(one.pixels, two.pixels, rtol=1e-3, atol=1e-3 * one.pixels.max())
    assert not np.allclose(one.rotation, two.rotation)


def test_reflections_show_the_world(blender, facing) -> None:
    """A mirror that faces the camera shows what is behind the camera, at the brightness it has."""
    mirror = Material(path="/mirror", diffuse_color=(1, 1, 1), metallic=1.0, roughness=0.0)
    pixels = np.ones((32, 64, 4), np.float32)
    pixels[:, 16:48] = 0.25  # the half around the dome's own -z, here behind the camera
    image = Image(name="halves", pixels=pixels)
    got = seen(blender, facing(lights=[dome(image=image)], materials=[mirror]), samples=64)
    np.testing.assert_allclose(got, 0.25, rtol=PRECISION)


@pytest.mark.parametrize("share", [0.0, 0.25, 1.0])
def test_an_eclipse_dims_the_sun_on_the_target_but_not_on_planets(blender, facing, share) -> None:
    """The light of a planet behind the camera stays, that of the Sun is what the planets leave of it."""
    light = replace(sun((0, 0, 1)), obscuration=share)
    np.testing.assert_allclose(seen(blender, facing(lights=[light]), 64), (1 - share) * SUN / np.pi, rtol=PRECISION)
    scene, wanted = far_planet(facing, 30, 2.0)
    (whole,) = scene.lights
    dim = replace(scene, lights=(replace(whole, obscuration=share),))
    assert Surroundings.of(dim).key == Surroundings.of(scene).key
    np.testing.assert_array_equal(Surroundings.of(dim).pixels, Surroundings.of(scene).pixels)
    assert wanted > 0


def test_a_planet_hides_a_dome_without_a_sun_too(facing) -> None:
    """A black ball that fills the directions within 30 degrees of an axis: of a dome's light all else is left."""
    dark = planet((0, 0, -2e6), 1e6, (0.0,) * 3)
    pixels = Surroundings.of(facing(lights=[dome()], planets=[dark])).pixels
    edges = np.sin(np.linspace(0.5, -0.5, len(pixels) + 1) * np.pi)
    solid = (edges[:-1] - edges[1:]) * np.pi / len(pixels)
    left = (pixels.sum(1) * solid[:, None]).sum(0)
    np.testing.assert_allclose(left, 4 * np.pi - 2 * np.pi * (1 - np.cos(np.radians(30))), rtol=PRECISION)


def test_a_planet_that_does_not_illuminate_leaves_the_target_as_it_is_without(blender, facing) -> None:
    """Of two planets, only the light of the one is there; and it hides no dome's light either."""
    lights = [sun((0, 0, 1)), dome(image=patch(10, 8))]
    one, other = planet((0, 2e7, 3e7)), planet((0, 1e7, -2e7), albedo=(0.9, 0.5, 0.1))
    seen_only = replace(other, illuminates=False)
    for planets in ([], [one]):
        with_it, without = facing(lights=lights, planets=[*planets, seen_only]), facing(lights=lights, planets=planets)
        assert Surroundings.of(with_it).key == Surroundings.of(without).key
        assert LightGroups.of(with_it) == LightGroups.of(without)
    both = facing(lights=lights, planets=[one, other])
    assert Surroundings.of(both).key != Surroundings.of(facing(lights=lights, planets=[one])).key
    dark = facing(lights=lights[:1], planets=[seen_only])
    assert Surroundings.of(dark) is None
    assert LightGroups.of(dark).count == 1
    plain = [blender.radiance(scene, Effort(samples=4), seed=0).rgba for scene in (dark, facing(lights=lights[:1]))]
    np.testing.assert_array_equal(*plain)
