"""Planets, stars and back plates: places in double precision, units, images, and the refusal of what makes no sense."""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio  # noqa: N813  the name its own documentation uses
import pytest
from pxr import Usd, UsdValidation

from spin_usd.basics.resources import stages
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.stage.read.environment import irradiance, random_stars, star_count
from spin_usd.stage.read.stage_reader import StageReader
from tests.cases.image_files import write_image_file

DOUBLE = 1e-12
FLOAT32 = 1e-6
APIS = {"planet": "SpinPlanetAPI", "stars": "SpinStarsAPI", "plate": "SpinBackPlateAPI"}
RADII = "double3 spin:planet:radii = (6378137, 6378137, 6356752.3142)"
AWAY = 'double3 xformOp:translate = (0, 0, -7078137)\nuniform token[] xformOpOrder = ["xformOp:translate"]'


def prim(kind, attributes="", name=None) -> str:
    return f"""def Xform "{name or kind.capitalize()}" (
        prepend apiSchemas = ["{APIS[kind]}"]
    )
    {{
        {attributes}
    }}"""


def earth(attributes="", place=AWAY):
    return prim("planet", f"{RADII}\n{place}\n{attributes}")


def test_deep_space_is_empty(read_scene) -> None:
    environment = read_scene().environment
    assert (environment.planets, environment.stars, environment.back_plate) == ((), (), None)


def test_planet(read_scene) -> None:
    (planet,) = read_scene(world=earth("color3f spin:planet:albedo = (0.1, 0.2, 0.3)")).environment.planets
    assert planet.radii == (6378137, 6378137, 6356752.3142)
    np.testing.assert_allclose(planet.T_cam_planet.translation, (0, 0, 7078137), rtol=DOUBLE)
    np.testing.assert_allclose(planet.T_cam_planet.rotation, np.diag([1, -1, -1]), atol=DOUBLE)
    np.testing.assert_allclose(planet.albedo, (0.1, 0.2, 0.3), rtol=FLOAT32)
    assert (planet.clouds, planet.atmosphere, planet.illuminates) == (None, 0, True)


def test_a_planet_may_be_seen_without_lighting_the_target(read_scene) -> None:
    (planet,) = read_scene(world=earth("bool spin:planet:illuminates = 0")).environment.planets
    assert not planet.illuminates


def test_lengths_are_in_the_prims_own_units(read_scene) -> None:
    """A planet of radius 6,371 under a scale of 1000, on a stage of centimetres, 70,000 m away."""
    place = """double3 xformOp:translate = (0, 0, -7000000)
        double3 xformOp:scale = (1000, 1000, 1000)
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]"""
    air = "double spin:planet:atmosphere:scaleHeight = 8\ndouble3 spin:planet:radii = (2371, 2371, 2371)"
    scene = read_scene(world=prim("planet", f"{place}\n{air}"), metadata="metersPerUnit = 0.01")
    (planet,) = scene.environment.planets
    np.testing.assert_allclose(planet.radii, 23710, rtol=DOUBLE)
    np.testing.assert_allclose(planet.atmosphere, 80, rtol=DOUBLE)
    np.testing.assert_allclose(planet.T_cam_planet.translation, (0, 0, 70000), rtol=DOUBLE)


def test_a_far_origin_costs_a_planet_nothing(make_stage) -> None:
    """A whole scene 1e11 m from the stage's origin: what remains is the rounding of 1e11 m in double precision."""
    near = StageReader(make_stage(world=earth()))
    place = 'double3 xformOp:translate = (1e11, 2e10, {z})\nuniform token[] xformOpOrder = ["xformOp:translate"]'
    path = make_stage(
        name="far.usda",
        camera=place.format(z=0),
        pose=place.format(z=-10),
        world=earth(place=place.format(z=-7078137)),
    )
    far = StageReader(path)
    one, other = (reader.scene(reader.frames[0]).environment.planets[0] for reader in (near, far))
    np.testing.assert_allclose(
        one.T_cam_planet.translation, other.T_cam_planet.translation, rtol=0, atol=2 * np.spacing(1e11)
    )


def test_images_of_a_planet(tmp_path, read_scene) -> None:
    """The albedo is a colour; clouds are an opacity: the grey itself, or alpha where there is one."""
    write_image_file(tmp_path / "albedo.png", np.full((2, 4, 3), 128))
    write_image_file(tmp_path / "clouds.png", np.full((2, 4, 1), 51))
    files = "asset spin:planet:albedo:file = @./albedo.png@\nasset spin:planet:clouds:file = @./clouds.png@"
    (planet,) = read_scene(world=earth(files)).environment.planets
    np.testing.assert_allclose(planet.albedo.pixels[0, 0, :3], 0.21586, rtol=1e-4)  # of 128, IEC 61966-2-1
    np.testing.assert_allclose(planet.clouds.pixels[0, 0], (0.7, 0.7, 0.7, 0.2), rtol=FLOAT32)
    write_image_file(tmp_path / "clouds.png", np.tile(np.array([255, 255, 255, 102]), (2, 4, 1)))
    white = files + "\ncolor3f spin:planet:clouds:albedo = (0.5, 0.6, 0.7)"
    (planet,) = read_scene(world=earth(white), name="b.usda").environment.planets
    np.testing.assert_allclose(planet.clouds.pixels[0, 0], (0.5, 0.6, 0.7, 0.4), rtol=FLOAT32)


@pytest.mark.parametrize(("kind", "number"), [("albedo", 2), ("night", -1)])
def test_an_image_of_impossible_light_is_refused(tmp_path, read_scene, kind, number) -> None:
    write_image_file(tmp_path / "map.exr", np.full((4, 8, 3), float(number)))
    with pytest.raises(
        StageError,
        match=rf"Planet.spin:planet:{kind}:file: its image .*map\.exr holds colours from {number} to {number}",
    ):
        read_scene(world=earth(f"asset spin:planet:{kind}:file = @./map.exr@"))


def test_hidden_parts_are_not_there(read_scene) -> None:
    hidden = 'token visibility = "invisible"'
    environment = read_scene(world="\n".join((earth(hidden), prim("stars", hidden), prim("plate", hidden)))).environment
    assert (environment.planets, environment.stars, environment.back_plate) == ((), (), None)


def test_random_stars_follow_the_law() -> None:
    """Counts by magnitude follow N(<m) = 9000 x 10^(0.51 (m - 6.5)), directions are uniform, within five sigma."""
    directions, magnitudes = random_stars(7, 8.0)
    assert len(magnitudes) == star_count(8.0)
    assert star_count(6.5) == 9000
    for limit in (4.0, 6.5, 7.5):
        wanted = 9000 * 10 ** (0.51 * (limit - 6.5))
        assert (magnitudes < limit).sum() == pytest.approx(wanted, abs=5 * np.sqrt(wanted))
    sigma = 1 / np.sqrt(3 * len(directions))
    np.testing.assert_allclose(directions.mean(0), 0, atol=5 * sigma)
    np.testing.assert_allclose(directions.T @ directions / len(directions), np.eye(3) / 3, atol=5 * sigma)
    np.testing.assert_array_equal(random_stars(7, 8.0)[0], directions)
    assert not np.array_equal(random_stars(8, 8.0)[0][:5], directions[:5])


def test_the_suns_magnitude() -> None:
    """IAU 2015 resolution B2, table: the nominal solar irradiance, 1361 W/m2, is of magnitude -26.832."""
    assert irradiance(-26.832) == pytest.approx(1361, rel=1e-3)


def test_catalogue(read_scene) -> None:
    """Sirius and a star 5 magnitudes fainter: a hundredth of its light, and red."""
    listed = """double3[] spin:stars:directions = [(0, 0, -2), (3, 0, -4)]
        double[] spin:stars:magnitudes = [-1.46, 3.54]
        double[] spin:stars:temperatures = [10000, 3000]"""
    (stars,) = read_scene(world=prim("stars", listed)).environment.stars
    np.testing.assert_allclose(stars.T_cam_sky.directions(stars.directions), [(0, 0, 1), (0.6, 0, 0.8)], atol=DOUBLE)
    luminance = stars.irradiance @ (0.2126, 0.7152, 0.0722)
    np.testing.assert_allclose(luminance, irradiance([-1.46, 3.54]), rtol=1e-3)  # UsdLux's colours, of luminance 1
    assert luminance[0] / luminance[1] == pytest.approx(100, rel=2e-3)
    assert stars.irradiance[1, 0] > 2 * stars.irradiance[1, 2]


def test_back_plate(tmp_path, read_scene) -> None:
    write_image_file(tmp_path / "a.png", np.full((2, 4, 3), 255))
    plate = """asset[] spin:backPlate:files = [@./a.png@, @./a.png@]
        double3 spin:backPlate:radiance = (10, 20, 30)
        double2 spin:backPlate:roll = (-90, 180)
        double spin:backPlate:probability = 0.25
        double spin:backPlate:mirror = 0.5"""
    found = read_scene(world=prim("plate", plate)).environment.back_plate
    assert len(found.images) == 2
    assert (found.radiance, found.probability, found.mirror) == ((10, 20, 30), 0.25, 0.5)
    assert found.roll == pytest.approx((-np.pi / 2, np.pi))
    for name, ours, wrong in (("radiance", "(10, 20, 30)", "(10, 1e300, 30)"), ("roll", "(-90, 180)", "(-90, 1e300)")):
        with pytest.raises(StageError, match=f"^/World/Plate.spin:backPlate:{name}: is .*; choose numbers from"):
            read_scene(world=prim("plate", plate.replace(ours, wrong)), name=f"{name}.usda")


@pytest.mark.parametrize(
    ("world", "error", "saying"),
    [
        (prim("planet", AWAY), StageError, "Planet.spin:planet:radii: is not authored; give the planet its semi-axes"),
        (prim("planet", f"double3 spin:planet:radii = (1, 0, 1)\n{AWAY}"), StageError, "Planet.spin:planet:radii: is"),
        (
            prim("planet", f"double3 spin:planet:radii = (1, 1e-300, 1)\n{AWAY}"),
            StageError,
            "Planet.spin:planet:radii: is",
        ),
        (
            prim("planet", f"double3 spin:planet:radii = (1, 1e300, 1)\n{AWAY}"),
            StageError,
            "Planet.spin:planet:radii: is",
        ),
        (
            prim("planet", f"double3 spin:planet:radii = (1, 101, 1)\n{AWAY}"),
            StageError,
            "Planet.spin:planet:radii: is",
        ),
        (
            earth("double spin:planet:atmosphere:scaleHeight = 1e-300"),
            StageError,
            "Planet.spin:planet:atmosphere:scaleHeight: is 1e-300 m; choose 0, or numbers from 1e-06 to",
        ),
        (
            earth("double spin:planet:atmosphere:scaleHeight = 7e5"),
            StageError,
            "Planet.spin:planet:atmosphere:scaleHeight: is 700000 m, more than 0.1 of the shortest semi-axis",
        ),
        (
            earth("double3 spin:planet:atmosphere:opticalDepth = (1, 1e300, 1)"),
            StageError,
            "Planet.spin:planet:atmosphere:opticalDepth: is",
        ),
        (earth(place=AWAY.replace("-7078137", "-1e200")), UnsupportedError, "Planet: is 1e.200 m from the camera"),
        (earth("color3f spin:planet:albedo = (1, 1, 2)"), StageError, "Planet.spin:planet:albedo: is"),
        (earth("asset spin:planet:clouds:file = @./none.png@"), StageError, "Planet: its image @./none.png@ does not"),
        (earth(place=""), UnsupportedError, "Planet: the camera is -.* m above it"),
        (
            earth(
                "double spin:planet:atmosphere:scaleHeight = 300000\n"
                "double3 spin:planet:atmosphere:opticalDepth = (1, 1, 1)"
            ),
            UnsupportedError,
            "Planet: the camera is 721385 m above it: inside it, or in its air",
        ),
        (
            earth(place=AWAY.replace("-7078137", "-6356757.3142")),
            UnsupportedError,
            "Planet: hides or cuts the target: it meets",  # which stands 10 m away, and this ground 5 m
        ),
        (prim("stars", "double spin:stars:limitingMagnitude = 30"), StageError, "Stars.spin:stars:limitingMagnitude"),
        (prim("stars", "double[] spin:stars:magnitudes = [1]"), StageError, "Stars: lists 0 directions and 1"),
        (prim("stars", "double[] spin:stars:temperatures = [5000]"), StageError, "Stars: lists 1 temperatures for"),
        (
            prim("stars", "double3[] spin:stars:directions = [(0, 0, 0)]\ndouble[] spin:stars:magnitudes = [1]"),
            StageError,
            r"Stars.spin:stars:directions\[0\]: its length is 0; choose",
        ),
        (
            prim("stars", "double3[] spin:stars:directions = [(0, 0, 1)]\ndouble[] spin:stars:magnitudes = [-1e9]"),
            StageError,
            r"Stars.spin:stars:magnitudes\[0\]: is -1e\+09; choose numbers from -30 to 40, or remove the star",
        ),
        (prim("plate"), StageError, "Plate.spin:backPlate:files: names no image"),
        (
            prim("plate") + "\n" + prim("plate", name="Other"),
            StageError,
            "Other: there is another back plate, /World/Plate",
        ),
        ('def Xform "Bare"\n{\nint64 spin:stars:seed = 1\n}', StageError, "Bare.spin:stars:seed: is authored, but"),
    ],
)
def test_what_makes_no_sense_is_refused(read_scene, world, error, saying) -> None:
    with pytest.raises(error, match=f"^/World/{saying}"):
        read_scene(world=world)


SPHERE = "double3 spin:planet:radii = (2, 2, 2)\ndouble3 xformOp:translate = ({x}, 0, {z})\n" + AWAY.splitlines()[1]
BOX_RADIUS = np.sqrt(3)  # of the sphere around the target, a cube of 2 m, 10 m away


@pytest.mark.parametrize(
    ("z", "touching"),
    [
        (-12, np.sqrt((2 + BOX_RADIUS) ** 2 - 2**2)),  # the sphere around the target, 2 m behind its middle
        (-6, (2 + 6 * BOX_RADIUS / 10) / np.sqrt(1 - (BOX_RADIUS / 10) ** 2)),  # the side of the cone around it
    ],
    ids=["beside", "before"],
)
def test_a_planet_may_come_as_near_the_view_of_the_target_as_it_does_not_touch_it(read_scene, z, touching) -> None:
    assert read_scene(world=prim("planet", SPHERE.format(x=touching + 1e-6, z=z))).environment.planets
    with pytest.raises(UnsupportedError, match=r"^/World/Planet: hides or cuts the target"):
        read_scene(world=prim("planet", SPHERE.format(x=touching - 1e-6, z=z)), name="b.usda")


ANGLE = 0.53
SUN = f"""
def DistantLight "Sun"
{{
    float inputs:angle = {ANGLE}
    float inputs:intensity = 1361
    bool inputs:normalize = 1
}}"""


def test_a_planet_eclipses_the_sun_frame_by_frame(make_stage) -> None:
    """The Sun stands behind the camera, and a planet of a few Suns' size beyond it crosses its disc: the target, a cube
    of 2 m around its origin, is lit, half lit, dark, and lit again. The Sun of the planet stays whole."""
    half = np.tan(np.radians(ANGLE / 2))
    distance, radius = 1e9, 1e9 * np.sin(np.arctan(3 * half))
    places = {0: 9 * half, 1: 3 * half, 2: 0, 3: -9 * half}
    samples = ", ".join(f"{t}: ({distance * x}, 0, {distance - 10})" for t, x in places.items())
    body = f"""double3 spin:planet:radii = ({radius}, {radius}, {radius})
        double3 xformOp:translate.timeSamples = {{ {samples} }}
        {AWAY.splitlines()[1]}"""
    world = prim("planet", body) + SUN
    metadata = "metersPerUnit = 1\nstartTimeCode = 0\nendTimeCode = 3"
    reader = StageReader(make_stage(world=world, metadata=metadata))
    suns = [reader.scene(frame).lights[0] for frame in reader.frames]
    assert [light.obscuration for light in suns] == pytest.approx([0, 0.5, 1, 0], abs=0.08)  # its limb is no line
    assert (suns[0].at_target, suns[2].at_target) == ((1361,) * 3, (0,) * 3)
    assert {light.irradiance for light in suns} == {(1361.0,) * 3}
    bare = StageReader(make_stage(world=SUN, name="bare.usda"))
    assert bare.scene(bare.frames[0]).lights == (suns[0],) == (suns[3],)


@pytest.mark.parametrize("name", sorted(path.stem for path in (stages() / "environments").glob("*.usda")))
def test_our_own_environments_are_read(tmp_path, make_stage, name) -> None:
    """By a reference to their default prim; and USD finds no fault with them."""
    shutil.copytree(stages() / "environments", tmp_path / "environments")
    layer = f"@./environments/{name}.usda@"
    reader = StageReader(make_stage(world=f'def "Referenced" (\n prepend references = {layer}\n)\n{{\n}}'))
    scene = reader.scene(reader.frames[0])
    environment = scene.environment
    empty = not (scene.lights or environment.planets or environment.stars or environment.back_plate)
    assert empty == (name == "deep_space")
    stage = Usd.Stage.Open(str(tmp_path / "environments" / f"{name}.usda"))
    assert str(stage.GetDefaultPrim().GetName()) in ("Lights", "Environment")
    registry = UsdValidation.ValidationRegistry()
    context = UsdValidation.ValidationContext(registry.GetOrLoadAllValidators())
    assert not [error.GetMessage() for error in context.Validate(stage)]


@pytest.mark.campaign
def test_the_committed_images_are_what_their_script_makes(tmp_path) -> None:
    """Up to what other processors and JPEG libraries round: a fifth of a level in the mean."""
    script = Path(__file__).resolve().parents[3] / "tools" / "build_environments"
    subprocess.run([sys.executable, script, tmp_path], check=True)
    committed = stages() / "environments" / "textures"
    names = sorted(path.name for path in committed.iterdir())
    assert names == sorted(path.name for path in tmp_path.iterdir())
    assert sum(path.stat().st_size for path in committed.iterdir()) < 1_000_000
    for name in names:
        made, kept = (
            np.asarray(oiio.ImageBuf(str(folder / name)).get_pixels(oiio.UINT8), int)
            for folder in (tmp_path, committed)
        )
        assert np.abs(made - kept).mean() < 0.2
