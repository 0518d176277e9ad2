"""Lights and environments by name or file: in the authored stage exactly as in their own layer."""

import shutil
from collections.abc import Iterator

import numpy as np
import pytest
from PIL import Image
from pxr import Sdf, Usd, UsdGeom

from spin_usd.basics.resources import bundled, bundled_names, stages
from spin_usd.commands.author.in_child import author_stage
from spin_usd.commands.author.sources import earth_maps
from spin_usd.errors import InputError, SpinError
from spin_usd.renderers.background.sky import place_image
from spin_usd.scene.derived import srgb
from spin_usd.scene.light import DiskLight, DistantLight, RectLight
from spin_usd.stage.author.target_root import origin_of
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.composition import images
from spin_usd.stage.read.stage_reader import StageReader
from tests.cases.image_files import write_image_file
from tests.conftest import REPOSITORY

POSES = stages() / "examples" / "tango_speedplus_poses.json"
WHITE = np.full((6, 9, 3), 255)


def authored(out, **choices):
    return author_stage(poses=POSES, target="cubesat", camera="speedplus", out=out, frames="0:1", **choices).root


def scene(root):
    reader = StageReader(root)
    return reader.scene(reader.frames[0])


def test_those_that_travel_along_are_reported_apart_by_their_kind() -> None:
    assert bundled_names("lights") == ("lightbox", "sun", "sunlamp")
    assert bundled_names("environment") == ("back_plate", "deep_space", "earth", "earth_full", "near_earth", "stars")


@pytest.mark.parametrize(
    ("lights", "kinds"), [("sun", [DistantLight]), ("lightbox", [RectLight] * 6), ("sunlamp", [DiskLight])]
)
def test_lights_by_name(tmp_path, lights, kinds) -> None:
    root = authored(tmp_path / "stage", lights=lights)
    assert [type(light) for light in scene(root).lights] == kinds
    assert not check_stage(root)


def test_every_light_that_travels_along_says_the_unit_that_its_kind_and_normalisation_give_it() -> None:
    said = {"W/m2": 0, "W/m2/sr": 0, "W/sr": 0}
    for file in stages().rglob("*.usda"):
        layer = Sdf.Layer.FindOrOpen(str(file))
        for light in lights_of(layer.pseudoRoot):
            normalised = light.attributes["inputs:normalize"].default
            distant = light.typeName == "DistantLight"
            unit = ("W/m2" if distant else "W/sr") if normalised else "W/m2/sr"
            assert light.customData["spin"]["intensityUnit"] == unit, (file, light.path)
            said[unit] += 1
    assert all(said.values())


def lights_of(prim: Sdf.PrimSpec) -> Iterator[Sdf.PrimSpec]:
    for child in prim.nameChildren:
        if child.typeName.endswith("Light"):
            yield child
        yield from lights_of(child)


@pytest.mark.parametrize("name", bundled_names("environment"))
def test_environments_by_name_hold_what_their_layers_hold(tmp_path, name) -> None:
    root = authored(tmp_path / "stage", environment=name)
    own, there = Usd.Stage.Open(str(bundled("environment", name))), Usd.Stage.Open(root)
    names = [prim.GetName() for prim in own.GetDefaultPrim().GetChildren()]
    assert [prim.GetName() for prim in there.GetPrimAtPath("/World/Environment").GetChildren()] == names
    found = scene(root).environment
    assert (len(found.planets), len(found.stars), found.back_plate is not None) == (
        {"earth": 1, "earth_full": 1, "near_earth": 2}.get(name, 0),  # and the Moon
        name in ("stars", "near_earth"),
        name == "back_plate",
    )
    assert not check_stage(root)


def test_they_stand_instead_of_the_presets_own(tmp_path) -> None:
    root = authored(tmp_path / "stage", preset="spin_synthetic", lights="sunlamp", environment="earth")
    assert [type(light) for light in scene(root).lights] == [DiskLight]
    assert len(scene(root).environment.planets) == 1
    assert scene(root).sensor.auto_exposure is not None


def test_a_file_is_as_good_as_a_name(tmp_path) -> None:
    given = authored(tmp_path / "file", lights=bundled("lights", "lightbox"))
    named = authored(tmp_path / "name", lights="lightbox")
    assert StageReader(given).stage_hash == StageReader(named).stage_hash


def test_the_wrong_kind_and_unknown_names_are_refused(tmp_path) -> None:
    with pytest.raises(InputError, match="default prim is not Environment"):
        authored(tmp_path / "a", environment=bundled("lights", "sun"))
    with pytest.raises(InputError, match="name one of lightbox, sun, sunlamp"):
        authored(tmp_path / "b", lights="earth")
    assert not list(tmp_path.iterdir())


def test_maps_of_the_earth_are_those_that_a_user_gives(tmp_path) -> None:
    maps = tmp_path / "maps"
    maps.mkdir()
    write_image_file(maps / "blue_marble.png", np.full((8, 16, 3), 255))
    write_image_file(maps / "Cloud_Cover.png", np.full((4, 8, 1), 51))
    write_image_file(maps / "night_lights.png", np.full((4, 8, 3), 255))
    (maps / "readme.txt").write_text("no map")
    root = authored(tmp_path / "stage", earth=maps)
    (planet,) = scene(root).environment.planets
    assert planet.albedo.pixels.shape == (8, 16, 4)
    assert (planet.albedo.pixels == 1).all()
    np.testing.assert_allclose(planet.clouds.pixels[..., 3], 0.2)
    assert planet.night.pixels.shape == (4, 8, 4)
    assert planet.night_radiance == pytest.approx((0.002,) * 3)
    assert not check_stage(root)
    inputs = origin_of(Usd.Stage.Open(root)).inputs
    assert inputs["earth_clouds"].name == "Cloud_Cover.png"
    assert len(inputs["earth_albedo"].sha256) == 64


def test_a_map_alone_is_under_our_own_clouds(tmp_path) -> None:
    file = write_image_file(tmp_path / "land.png", np.full((8, 16, 3), 128))
    (planet,) = scene(authored(tmp_path / "stage", earth=file, environment="earth_full")).environment.planets
    assert planet.albedo.pixels.shape == (8, 16, 4)
    assert planet.clouds.pixels.shape == (1024, 2048, 4)
    assert planet.night is None


@pytest.mark.parametrize(
    ("names", "environment", "found"),
    [
        (("a.png", "b.png"), None, "two maps of albedo"),
        ((), None, "contains no map"),
        (("a.png",), "stars", "has 0 planets"),
    ],
)
def test_what_is_no_map_of_the_earth_is_refused(tmp_path, names, environment, found) -> None:
    maps = tmp_path / "maps"
    maps.mkdir()
    for name in names:
        write_image_file(maps / name, np.zeros((4, 8, 3)))
    with pytest.raises(InputError, match=found):
        authored(tmp_path / "stage", earth=maps, environment=environment)
    assert not (tmp_path / "stage").exists()


def test_a_damaged_map_is_refused_in_a_sentence(tmp_path) -> None:
    (tmp_path / "land.jpg").write_bytes(b"\xff\xd8\xff\xe0 no picture")
    with pytest.raises(SpinError, match=r"land\.jpg"):
        authored(tmp_path / "stage", earth=tmp_path / "land.jpg")


@pytest.mark.parametrize(
    ("name", "kind"),
    [("cloudless_albedo", "albedo"), ("daylight", "albedo"), ("CloudCover", "clouds"), ("city_lights", "night")],
)
def test_a_maps_kind_is_in_its_name(tmp_path, name, kind) -> None:
    assert list(earth_maps(write_image_file(tmp_path / f"{name}.png", np.zeros((4, 8, 3))))) == [kind]


@pytest.mark.parametrize(
    ("name", "number", "found"),
    [
        ("land", np.nan, "holds NaN or infinity"),
        ("land", 1e30, "holds colours from 0.5 to 1e\\+30"),
        ("night", -1, "holds colours from -1 to 0.5"),
    ],
)
def test_a_map_that_cannot_be_rendered_is_refused_before_a_stage_is_written(tmp_path, name, number, found) -> None:
    pixels = np.full((4, 8, 3), 0.5)
    pixels[2, 3] = number
    with pytest.raises(InputError, match=rf"{name}\.exr: {found}"):
        authored(tmp_path / "stage", earth=write_image_file(tmp_path / f"{name}.exr", pixels))
    assert not (tmp_path / "stage").exists()


def test_a_map_of_another_projection_is_refused(tmp_path) -> None:
    with pytest.raises(InputError, match=r"land\.png: has 8 x 8 pixels, and a map .* is twice as wide as high"):
        authored(tmp_path / "stage", earth=write_image_file(tmp_path / "land.png", np.zeros((8, 8, 3))))


def test_a_map_that_is_cut_short_is_refused(tmp_path) -> None:
    noise = np.random.default_rng(1).integers(0, 256, (64, 128, 3))
    file = write_image_file(tmp_path / "land.png", noise)
    file.write_bytes(file.read_bytes()[:4000])
    with pytest.raises(InputError, match=r"land\.png: is cut short or damaged"):
        authored(tmp_path / "stage", earth=file)


def test_pictures_of_a_folder_are_behind_the_target_upright_one_in_each_picture(tmp_path) -> None:
    folder = tmp_path / "photos"
    folder.mkdir()
    for name, level in (("a.png", 10), ("b.jpg", 200), ("c.png", 90)):
        write_image_file(folder / name, np.full((6, 9, 3), level))
    (folder / "notes.txt").write_text("not a picture")
    plate = scene(authored(tmp_path / "stage", background=folder)).environment.back_plate
    assert [image.size for image in plate.images] == [(6, 9)] * 3
    assert (plate.probability, plate.roll, plate.mirror) == (1.0, (0.0, 0.0), 0.0)
    assert {int(place_image(plate, seed).image is plate.images[2]) for seed in range(50)} == {0, 1}
    shutil.rmtree(folder)  # the stage has its own
    plate = scene(tmp_path / "stage" / "dataset.usda").environment.back_plate
    assert plate.images[0].pixels[0, 0, 0] < plate.images[2].pixels[0, 0, 0] < plate.images[1].pixels[0, 0, 0]


def test_grey_photographs_are_as_bright_as_coloured_ones(tmp_path) -> None:
    """USD's "auto" would take them for linear numbers."""
    folder = tmp_path / "photos"
    folder.mkdir()
    write_image_file(folder / "colour.png", np.full((6, 9, 3), 90))
    Image.fromarray(np.full((6, 9), 90, np.uint8)).save(folder / "grey.png")
    colour, grey = scene(authored(tmp_path / "stage", background=folder)).environment.back_plate.images
    assert np.array_equal(colour.pixels, grey.pixels)


def test_white_of_a_photograph_comes_out_as_the_page_says(tmp_path) -> None:
    stage = Usd.Stage.Open(authored(tmp_path / "stage", background=write_image_file(tmp_path / "a.png", WHITE)))
    radiance = stage.GetPrimAtPath("/World/Environment/BackPlate").GetAttribute("spin:backPlate:radiance").Get()[0]
    signal = radiance * UsdGeom.Camera(stage.GetPrimAtPath("/World/Camera")).ComputeLinearExposureScale()
    page = (REPOSITORY / "docs" / "how-to" / "own-lights.md").read_text()
    assert f"{radiance} W/m²/sr: level {255 * srgb.encode(signal):.0f} of 255" in page
    assert f"radiance = ({radiance / signal:.1f}, " in page


def test_a_back_plate_that_is_chosen_keeps_its_chances(tmp_path) -> None:
    file = write_image_file(tmp_path / "photo.png", np.full((6, 9, 3), 128))
    plate = scene(authored(tmp_path / "stage", background=file, environment="back_plate")).environment.back_plate
    assert (len(plate.images), plate.probability, plate.mirror) == (1, 0.5, 0.5)


def test_many_large_backgrounds_are_no_more_than_one(tmp_path, monkeypatch) -> None:
    """Nothing keeps the pixels of all."""
    monkeypatch.setattr(images, "MAX_TOTAL_PIXELS", 100)
    for name in "abc":
        write_image_file(tmp_path / f"{name}.png", np.full((6, 9, 3), 128))
    assert len(scene(authored(tmp_path / "stage", background=tmp_path)).environment.back_plate.images) == 3


@pytest.mark.parametrize(
    ("name", "environment", "found"),
    [
        ("photo.txt", None, "is not a supported picture"),
        (".", None, "contains no picture"),
        ("photo.png", "earth", "0 back"),
    ],
)
def test_what_is_no_background_is_refused(tmp_path, name, environment, found) -> None:
    if name.startswith("photo"):
        write_image_file(tmp_path / "photo.png", np.full((6, 9, 3), 128)).rename(tmp_path / name)
    with pytest.raises(InputError, match=found):
        authored(tmp_path / "stage", background=tmp_path / name, environment=environment)
    assert not (tmp_path / "stage").exists()
