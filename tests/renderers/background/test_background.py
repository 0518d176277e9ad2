"""The background: places, energy and light of planets, stars, domes and back plates, against formulas and sums."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spin_usd.basics.arrays import digest
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.geometry.transform import Transform
from spin_usd.renderers.background.globe import Air, Globe, Rays
from spin_usd.renderers.background.noise_octaves import faces_of, octave, resolved
from spin_usd.renderers.background.planet_radiance import DetailMaker
from spin_usd.renderers.background.planet_view import BLOCK, PlanetView, blocks
from spin_usd.renderers.background.sky import place_image, sky, solid_angles
from spin_usd.scene.content import content
from spin_usd.scene.environment import BackPlate, Environment, Planet, Stars
from spin_usd.scene.light import DistantLight, DomeLight
from spin_usd.scene.texture import Image
from tests.cases import scenes

CAMERA = replace(scenes.SPEEDPLUS, width=240, height=150, fx=373.6, fy=373.5, cx=120, cy=75)
SUN = 1361.0
WGS84 = (6378137.0, 6378137.0, 6356752.3142)
FLOAT32 = 2e-6
NODES = 2e-4  # relative: between nodes a cosine is interpolated over 0.03 radians at most, which is off by 0.03^2 / 8
COVER = 0.04  # views hold some tens of the longest waves: their means differ by up to 0.1, those of six by half of it
ENERGY = 1e-5  # relative: float32 sums of a few pixels


def axes(of, rotation=None, translation=(0, 0, 0)):
    return Transform(
        to="cam", of=of, rotation=np.eye(3) if rotation is None else rotation, translation=np.array(translation, float)
    )


def sun(direction=(0, 0, 1), angle=0.0093):
    direction = np.asarray(direction, float) / np.linalg.norm(direction)
    return DistantLight(path="/Sun", direction_cam=tuple(direction), irradiance=(SUN, SUN, SUN), angle=angle)


def planet(centre, radii=WGS84, rotation=None, albedo=(0.5, 0.25, 0.125), **fields):
    return Planet(path="/P", T_cam_planet=axes("planet", rotation, centre), radii=radii, albedo=albedo, **fields)


def stars(directions, irradiance=1e-6, rotation=None):
    directions = np.atleast_2d(np.asarray(directions, float))
    directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    light = np.broadcast_to(irradiance, directions.shape)
    return Stars(path="/S", T_cam_sky=axes("sky", rotation), directions=directions, irradiance=light)


def behind(*, planets=(), stars=(), plate=None, lights=(), camera=CAMERA):
    scene = scenes.scene(scenes.target(*scenes.box()), camera=camera, lights=lights)
    return replace(scene, environment=Environment(planets=tuple(planets), stars=tuple(stars), back_plate=plate))


def image(pixels):
    pixels = np.asarray(pixels, np.float32)
    return Image(name="i", pixels=np.concatenate([pixels, np.ones((*pixels.shape[:2], 1))], -1))


def directions(camera):
    """(H, W, 3) unit rays through the pixels' centres."""
    u, v = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    rays = camera.rays(np.stack([u, v], -1))
    return rays / np.linalg.norm(rays, axis=-1, keepdims=True)


def irradiance_of(frame, camera):
    """(3,) at the lens, of all that a picture holds."""
    u, v = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    solid = solid_angles(camera, camera.normalised(np.stack([u, v], -1)).reshape(-1, 2))
    return (frame.reshape(-1, 3).astype(float) * solid[:, None]).sum(0)


def test_black_is_none() -> None:
    assert sky(behind(lights=[sun()]), seed=0) is None
    assert sky(behind(planets=[planet((0, 0, -1e7))], lights=[sun()]), seed=0) is None  # behind the camera
    assert sky(behind(lights=[replace(dome(), radiance=(0.0, 0.0, 0.0))]), seed=0) is None


# Stars.


@pytest.mark.parametrize(
    "camera", [CAMERA, scenes.BARREL, scenes.PINCUSHION], ids=["speedplus", "barrel", "pincushion"]
)
def test_a_star_keeps_its_light_and_its_place_wherever_in_a_pixel_it_falls(camera) -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        uv = rng.uniform((20, 20), (camera.width - 20, camera.height - 20))
        ray = camera.rays(uv)
        frame = sky(behind(stars=[stars(ray, (1e-6, 2e-6, 4e-6))], camera=camera), seed=0)
        solid = solid_angles(camera, ray[None, :2])[0]
        np.testing.assert_allclose(frame.sum((0, 1)) * solid, (1e-6, 2e-6, 4e-6), rtol=ENERGY)
        weight = frame[..., 0] / frame[..., 0].sum()
        rows, columns = np.indices(weight.shape)
        found = ((columns + 0.5) * weight).sum(), ((rows + 0.5) * weight).sum()
        np.testing.assert_allclose(found, uv, atol=1e-4)


def test_solid_angles_are_those_of_the_pixels() -> None:
    """The area of the pixel's corners on the unit sphere, by the formula of Girard for two triangles."""
    for camera in (CAMERA, scenes.BARREL):
        centre = np.array([[40.5, 30.5], [120.5, 75.5], [200.5, 100.5]])
        corners = [camera.rays(centre + 0.5 * np.array(d)) for d in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        a, b, c, d = (ray / np.linalg.norm(ray, axis=1, keepdims=True) for ray in corners)
        wanted = _triangle(a, b, c) + _triangle(a, c, d)
        np.testing.assert_allclose(solid_angles(camera, camera.normalised(centre)), wanted, rtol=1e-4)


def _triangle(a, b, c):
    """Solid angle. Source: van Oosterom and Strackee (1983)."""
    triple = np.einsum("ij,ij->i", a, np.cross(b, c))
    dots = (np.einsum("ij,ij->i", *pair) for pair in ((a, b), (b, c), (c, a)))
    return 2 * np.arctan2(np.abs(triple), 1 + sum(dots))


def test_stars_behind_the_camera_or_outside_are_not_seen() -> None:
    ways = [(0, 0, -1), (1, 0, 0.1), (0, 0, 1)]
    frame = sky(behind(stars=[stars(ways)]), seed=0)
    solid = solid_angles(CAMERA, np.zeros((1, 2)))[0]
    np.testing.assert_allclose(frame.sum((0, 1)) * solid, 1e-6, rtol=ENERGY)


def test_planets_hide_stars() -> None:
    """Those behind its disc, big or small; the unlit planet itself is black."""
    ways = [(0, 0, 1), (0.15, 0, 1)]
    for distance in (1e8, 1e10):
        globe = planet((0, 0, distance))
        frame = sky(behind(stars=[stars(ways)], planets=[globe]), seed=0)
        solid = solid_angles(CAMERA, np.array([[0.15, 0.0]]))[0]
        np.testing.assert_allclose(frame.sum((0, 1)) * solid, 1e-6, rtol=ENERGY)


# Planets.


@pytest.mark.parametrize("centre", [(0, 6.5e6, 3e6), (-2e6, 1e6, 4e7), (3e7, -2e7, 4e8)])
def test_rays_meet_the_ellipsoid_where_algebra_says(centre) -> None:
    """Rows of Rays.meet against the quadratic equation in extended precision."""
    rotation = matrix_from_quaternion(np.array([0.5, 0.1, -0.7, 0.5]) / np.linalg.norm([0.5, 0.1, -0.7, 0.5]))
    globe = Globe(planet=planet(centre, rotation=rotation), eye=np.zeros(3))
    d = directions(CAMERA).reshape(-1, 3)
    one = np.ones(len(d), np.float32)
    meeting = globe.meet(Rays(x=d[:, 0], y=d[:, 1], z=d[:, 2], length=one, angle=one * np.float32(1e-9)))
    radii = np.array(WGS84, np.longdouble)
    o = -(rotation.T @ np.array(centre)) / radii
    w = (d @ rotation) / radii
    a, b, c = (w * w).sum(1), w @ o, o @ o - 1
    inside = b * b - a * c
    hit = (inside > 0) & (b < 0)
    assert hit.any()
    assert not hit.all()
    assert np.mean(hit != (meeting.covered > 0.5)) < 1e-4
    t = (-b[hit] - np.sqrt(inside[hit])) / a[hit]
    normal = (o + t[:, None] * w[hit]) / radii
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    found = np.stack(meeting.normal, -1)[hit]
    clear = inside[hit] / a[hit] > 1e-3  # not at the very limb, where a rounding moves the point far
    np.testing.assert_allclose(found[clear], np.asarray(normal[clear], float), atol=FLOAT32)


def test_the_limb_is_where_the_horizon_is() -> None:
    """700 km above a sphere, its limb is acos(R / (R + h)) below the horizontal."""
    radius, height = 6.4e6, 7e5
    dip = np.arccos(radius / (radius + height))
    axis = np.array([0, np.cos(dip), np.sin(dip)])  # so that the limb goes through the middle of the frame
    globe = planet(axis * (radius + height), (radius,) * 3)
    frame = sky(behind(planets=[globe], lights=[sun((0, 1, 0.2))]), seed=0)
    column = frame[:, CAMERA.width // 2, 0]
    assert (column[76:] > 0).all()
    assert (column[:74] == 0).all()


def test_ground_that_faces_the_sun_is_albedo_times_irradiance_over_pi() -> None:
    globe = planet((0, 0, 7e6))
    frame = sky(behind(planets=[globe], lights=[sun()]), seed=0)
    middle = frame[CAMERA.height // 2, CAMERA.width // 2]
    np.testing.assert_allclose(middle, np.array([0.5, 0.25, 0.125]) * SUN / np.pi, rtol=1e-3)


def test_night_is_black_and_the_terminator_soft() -> None:
    """Radiance falls with the cosine to the terminator and is 0 where all of the Sun's disc has set."""
    globe = planet((0, 0, 3e7), (6.4e6,) * 3)
    frame = sky(behind(planets=[globe], lights=[sun((1, 0, 0), angle=0.1)]), seed=0)
    d = directions(CAMERA)[CAMERA.height // 2]
    row = frame[CAMERA.height // 2, :, 0] / (0.5 * SUN / np.pi)
    along = -d @ (0, 0, 3e7)
    root = along**2 - ((3e7) ** 2 - 6.4e6**2)
    seen = root > 1e12
    t = -along - np.sqrt(np.where(seen, root, 0))
    cosine = -((d * t[:, None]) - (0, 0, 3e7)) @ (1, 0, 0) / 6.4e6
    day, night = seen & (cosine > 0.06), seen & (cosine < -0.06)
    np.testing.assert_allclose(row[day], cosine[day], rtol=NODES)
    assert (row[night] == 0).all()
    dusk = seen & (np.abs(cosine) < 0.04)
    assert dusk.any()
    assert (row[dusk] > 0).all()


def lambert_phase(angle):
    return (np.sin(angle) + (np.pi - angle) * np.cos(angle)) / np.pi


@pytest.mark.parametrize("size_px", [0.05, 1.0, 7.0, 30.0])
@pytest.mark.parametrize("angle", [0.0, 70.0, 110.0])
def test_a_planet_has_all_of_its_light_at_any_size(size_px, angle) -> None:
    """(2/3) albedo E (R / d)^2 phase: a dot, a disc rendered ray by ray, and one rendered pixel by pixel."""
    radius, turn = 1e6, np.radians(angle)
    camera = replace(CAMERA, fx=37360.0, fy=37360.0, distortion=(0.0,) * 5)  # so that it is far at any size
    distance = radius * camera.fx / size_px
    light = sun((np.sin(turn), 0, np.cos(turn)))
    frame = sky(behind(planets=[planet((0, 0, distance), (radius,) * 3)], lights=[light], camera=camera), seed=0)
    wanted = 2 / 3 * np.array([0.5, 0.25, 0.125]) * SUN * (radius / distance) ** 2 * lambert_phase(turn)
    tolerance = 0.005 if size_px < 8 else 0.02  # antialiasing of the limb
    np.testing.assert_allclose(irradiance_of(frame, camera), wanted, rtol=tolerance)


def test_the_map_lies_as_it_should() -> None:
    """North is +z, longitude 0 is +x, east is +y: from +x, north up, east is on the right."""
    pixels = np.zeros((90, 180, 3))
    pixels[:45, 90:], pixels[45:, 90:], pixels[:45, :90] = (1, 0, 0), (0, 1, 0), (0, 0, 1)  # north-east, south-east, …
    rotation = np.array([[0, 1, 0], [0, 0, -1], [-1, 0, 0.0]])  # the planet's y to the right, z up, x to the camera
    globe = planet((0, 0, 3e7), rotation=rotation, albedo=image(pixels))
    frame = sky(behind(planets=[globe], lights=[sun()]), seed=0)
    step = 30
    row, column = CAMERA.height // 2, CAMERA.width // 2
    for up, right, rgb in ((1, 1, (1, 0, 0)), (-1, 1, (0, 1, 0)), (1, -1, (0, 0, 1)), (-1, -1, (0, 0, 0))):
        seen = frame[row - up * step, column + right * step]
        assert (seen > 50).tolist() == [bool(c) for c in rgb]


def test_latitude_is_that_of_the_normal() -> None:
    """Of a flat ellipsoid, where its normal is 45 degrees north its point is in another direction."""
    radii = (2.0, 2.0, 1.0)
    bands = np.zeros((180, 360, 3))
    bands[40:50] = 1  # 40 to 50 degrees north
    turn = np.radians(45)
    rotation = np.array([[0, 1, 0], [np.sin(turn), 0, -np.cos(turn)], [-np.cos(turn), 0, -np.sin(turn)]])
    normal = np.array([np.cos(turn), 0, np.sin(turn)])
    point = normal * np.square(radii) / np.sqrt((np.square(normal) * np.square(radii)).sum())
    centre = np.array([0, 0, 10.0]) - rotation @ point
    globe = planet(centre, radii, rotation, image(bands))
    frame = sky(behind(planets=[globe], lights=[sun()]), seed=0)
    assert frame[CAMERA.height // 2, CAMERA.width // 2, 0] > 0.5 * SUN / np.pi


def points_near(place, step, shape=(256, 256)):
    """x, y, z of points of a sphere, `step` radians from one another."""
    latitude, longitude = place
    up = np.array([np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)])
    east = np.array([-np.sin(longitude), np.cos(longitude), 0.0])
    rows, columns = ((np.arange(size) - size / 2) * step for size in shape)
    points = up + rows[:, None, None] * np.cross(up, east) + columns[:, None] * east
    return list(np.moveaxis(points / np.linalg.norm(points, axis=-1, keepdims=True), -1, 0))


@pytest.mark.parametrize("place", [(0.0, 0.0), (1.5, 0.3), (0.615, 0.785), (0.0, 0.785)])
def test_noise_is_as_large_as_it_says_everywhere(place) -> None:
    """On a face of the cube, at a pole, where three faces meet, and where two do: mean 0, variance 1."""
    for wave in (1e-4, 1e-2):
        noise = octave(faces_of(points_near(place, wave / 3)), wave, 3)
        assert noise.mean() == pytest.approx(0, abs=0.05)
        assert noise.var() == pytest.approx(1, rel=0.15)


def test_noise_has_no_seam_where_faces_meet() -> None:
    """Neighbours differ no more there than elsewhere."""
    longitude = np.linspace(-0.2, 1.8, 20000)
    normal = [np.cos(longitude) * 0.98, np.sin(longitude) * 0.98, np.full_like(longitude, 0.2)]
    normal = [n / np.sqrt(0.98**2 + 0.04) for n in normal]
    slope = np.abs(np.diff(octave(faces_of(normal), 0.01, 0)))
    edge = np.abs(longitude[1:] - np.pi / 4) < 0.1
    assert slope[edge].max() < 1.2 * slope[~edge].max()


def test_waves_that_a_pixel_cannot_hold_are_not_there() -> None:
    """A wave has its whole amplitude where it is many pixels long, and none where it is less than two."""
    footprint = np.array([1e-4, 1e-3, 1e-2, 2e-2], np.float32)
    share = resolved(footprint, 0.02)
    assert share[0] == pytest.approx(1, abs=1e-3)
    assert share[2:].tolist() == [0, 0]
    assert (np.diff(share) <= 0).all()


@pytest.mark.parametrize("cover", [0.1, 0.4, 0.7])
@pytest.mark.parametrize("height", [3e5, 8e5])
def test_clouds_cover_as_much_as_their_image_says_however_they_are_torn(cover, height) -> None:
    """The mean opacity of six views, in which there are clouds and clear air, under an image of one opacity."""
    clouds = Image(name="c", pixels=np.full((4, 2048, 4), (1, 1, 1, cover), np.float32))
    found = [opacity(clouds, height, rotation) for rotation in Rotation.random(6, random_state=0).as_matrix()]
    assert min(view.min() for view in found) < 0.1 < 0.8 < max(view.max() for view in found)
    assert np.mean(found) == pytest.approx(cover, abs=COVER)


def opacity(clouds, height, rotation):
    """The opacity of clouds at all pixels of a view straight down."""
    globe = Globe(planet=planet((0, 0, 6.4e6 + height), (6.4e6,) * 3, rotation, clouds=clouds), eye=np.zeros(3))
    view = PlanetView(CAMERA, globe, (sun(),), CAMERA.frame)
    parts = [view.nodes(block) for block in blocks(CAMERA.frame, BLOCK)]
    return np.concatenate([DetailMaker(each, each.points.weather).surface().clouds.opacity.ravel() for each in parts])


def test_air_masses_are_chapmans() -> None:
    """1 straight up; along the horizon sqrt(pi R / 2 H); from space to space twice that."""
    air = Air(scale_height=8.0 / 6371, depth=(0.1, 0.1, 0.1))
    horizon = np.sqrt(np.pi / 2 * 6371 / 8)
    np.testing.assert_allclose(air.mass(np.array([1.0, 0.5, 0.0], np.float32)), (1, 2, horizon), rtol=5e-3)
    assert air.limb_mass == pytest.approx(2 * horizon)


def test_a_thin_atmosphere_scatters_what_rayleigh_says() -> None:
    """Straight down on black ground, the Sun behind the camera: E P(180 deg) t / 4 pi, P = 3/2, for a small depth t."""
    depth = 1e-3
    globe = planet((0, 0, 7.2e6), (6.4e6,) * 3, albedo=(0.0,) * 3, atmosphere=8e3, haze=(depth, 2 * depth, 0.0))
    frame = sky(behind(planets=[globe], lights=[sun()]), seed=0)
    middle = frame[CAMERA.height // 2, CAMERA.width // 2]
    wanted = SUN * 1.5 / (4 * np.pi) * depth
    np.testing.assert_allclose(middle, (wanted, 2 * wanted, 0), rtol=0.01)


def test_the_atmosphere_glows_above_the_limb_and_dims_stars_there() -> None:
    radius, height, scale = 6.4e6, 7e5, 8e3
    dip = np.arccos(radius / (radius + height))
    axis = np.array([0, np.cos(dip), np.sin(dip)])
    bare = planet(axis * (radius + height), (radius,) * 3, albedo=(0.3,) * 3)
    hazy = replace(bare, atmosphere=scale, haze=(0.05, 0.1, 0.2))
    star = stars(CAMERA.rays(np.array([120.0, 74.0])), 1e-3)
    glow, dark = (sky(behind(planets=[p], lights=[sun((0, 1, 0.2))]), seed=0)[:, 120] for p in (hazy, bare))
    assert (dark[:74] == 0).all()
    assert glow[73, 2] > glow[73, 0] > 0  # blue
    assert glow[60].max() < 0.02 * glow[74].max()
    through, free = (sky(behind(planets=[p], stars=[star]), seed=0).sum() for p in (hazy, bare))
    assert through < 0.9 * free


def test_a_planet_of_an_eclipsed_sun_is_as_bright_as_ever() -> None:
    lights = [sun((0.5, 0, 1)), replace(sun((0.5, 0, 1)), obscuration=1.0)]
    one, other = (sky(behind(planets=[planet((0, 0, 2e7))], lights=[light]), seed=0) for light in lights)
    np.testing.assert_array_equal(one, other)
    assert one.any()


@pytest.mark.parametrize("radii", [(1e-3,) * 3, (1e10,) * 3, (1e8, 1e10, 1e10), (0.1, 1e-3, 1e-3)])
@pytest.mark.parametrize("air", [(0.0, 0.0), (1e-6, 1e-30), (1e-6, 1000.0), (None, 1000.0)])
@pytest.mark.filterwarnings("error")
def test_planets_at_the_ends_of_what_is_read_are_numbers(radii, air) -> None:
    """Sizes, shapes, atmospheres and distances: in float32 nothing overflows, and nothing is lost or made up."""
    height, haze = air[0] if air[0] is not None else 0.1 * min(radii), air[1]
    texture = image(np.random.default_rng(0).random((8, 16, 3)))
    for distance in (1.001 * max(radii) + 5 * height, 1e4 * max(radii) + 5 * height, 1e15):
        globe = planet((0, 0, distance), radii=radii, albedo=texture, atmosphere=height, haze=(haze, haze, 0.0))
        frame = sky(behind(planets=[globe], lights=[sun((0.5, 0, 1))]), seed=0)
        assert frame is None or (np.isfinite(frame).all() and frame.min() >= 0)


# Domes and back plates.


def dome(rotation=None, pixels=None):
    return DomeLight(
        path="/D",
        T_cam_dome=axes("dome", rotation),
        radiance=(2.0, 3.0, 4.0),
        image=None if pixels is None else image(pixels),
    )


def test_a_dome_is_seen_where_it_is() -> None:
    """Its image's middle along its -z, its top along its +y, its right half on the right."""
    np.testing.assert_array_equal(sky(behind(lights=[dome()]), seed=0)[3, 5], (2, 3, 4))
    height = 180
    column, row = np.meshgrid((np.arange(2 * height) + 0.5) / height - 1, 1 - (np.arange(height) + 0.5) / height * 2)
    pixels = np.stack([column * 180, row * 90, 0 * row], -1)  # degrees of longitude and latitude
    for turn in (np.diag([1.0, -1, -1]), np.diag([-1.0, 1, -1])):  # upright before the camera, and upside down
        frame = sky(behind(lights=[dome(turn, pixels)]), seed=0)
        d = directions(CAMERA) @ turn
        longitude, latitude = np.degrees(np.arctan2(d[..., 0], -d[..., 2])), np.degrees(np.arcsin(d[..., 1]))
        np.testing.assert_allclose(frame[..., 0] / 2, longitude, atol=2e-3)
        np.testing.assert_allclose(frame[..., 1] / 3, latitude, atol=2e-3)


def plate(pixels=None, **fields):
    return BackPlate(
        path="/B",
        images=(image(np.ones((30, 60, 3)) if pixels is None else pixels),),
        radiance=(5.0, 6.0, 7.0),
        **fields,
    )


def test_a_back_plate_fills_the_frame_however_it_is_turned() -> None:
    for roll in np.linspace(-4, 4, 17):
        frame = sky(behind(plate=plate(roll=(roll, roll))), seed=0)
        np.testing.assert_allclose(frame, np.broadcast_to((5, 6, 7), frame.shape), rtol=FLOAT32)


def test_a_back_plate_turns_clockwise_and_mirrors() -> None:
    pixels = np.zeros((60, 96, 3))
    pixels[:, 48:] = 1  # white on the right
    for roll, mirror, white in (
        (0, 0, (75, 200)),
        (np.pi / 2, 0, (130, 120)),
        (0, 1, (75, 40)),
        (np.pi / 2, 1, (20, 120)),
    ):
        frame = sky(behind(plate=plate(pixels, roll=(roll, roll), mirror=float(mirror))), seed=0)
        row, column = white
        assert frame[row, column, 0] == pytest.approx(5)
        assert frame[149 - row, 239 - column, 0] == pytest.approx(0)


def test_a_large_back_plate_is_averaged_not_sampled() -> None:
    """A checkerboard finer than pixels is grey."""
    pixels = np.indices((600, 960)).sum(0)[..., None] % 2 * np.ones(3)
    frame = sky(behind(plate=plate(pixels)), seed=0)
    np.testing.assert_allclose(frame[..., 0], 2.5, rtol=1e-5)


def test_a_share_of_the_pictures_has_a_back_plate() -> None:
    seeds = range(2000)
    chosen = [place_image(plate(probability=0.25, mirror=0.5, roll=(0.0, 1.0)), seed) for seed in seeds]
    there = [image for image in chosen if image]
    assert len(there) == pytest.approx(500, abs=5 * np.sqrt(2000 * 0.25 * 0.75))
    assert sum(image.mirrored for image in there) == pytest.approx(len(there) / 2, abs=5 * np.sqrt(len(there)) / 2)
    rolls = [image.roll for image in there]
    assert np.mean(rolls) == pytest.approx(0.5, abs=5 / np.sqrt(12 * len(rolls)))
    assert place_image(plate(), 7).roll == place_image(plate(), 7).roll

    assert sky(behind(plate=plate(probability=0.0)), seed=0) is None


def test_a_back_plate_hides_stars_but_not_planets() -> None:
    globe = planet((0, 0, 3e7))
    frame = sky(behind(plate=plate(), stars=[stars((0.2, 0, 1), 1.0)], planets=[globe]), seed=0)
    assert frame[75, 120].tolist() == [0, 0, 0]
    np.testing.assert_allclose(frame[75, 120 + 100], (5, 6, 7), rtol=FLOAT32)


def test_stars_in_another_attitude_have_the_content_of_new_ones() -> None:
    directions, rotation = np.eye(3), np.diag([-1.0, -1, 1])
    turned = stars(directions, irradiance=[1e-6, 2e-6, 3e-6]).turned(axes("sky", rotation))
    anew = stars(directions, irradiance=[1e-6, 2e-6, 3e-6], rotation=rotation)
    assert content(turned) == content(anew)
    assert content(turned)["directions"] == digest(turned.directions)
    assert content(turned) != content(stars(directions, irradiance=[1e-6, 2e-6, 3e-6]))
    np.testing.assert_array_equal(turned.T_cam_sky.rotation, rotation)
