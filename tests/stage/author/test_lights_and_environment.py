"""Lights and environments by name or file: in the authored stage exactly as in their own layer."""

import pytest
from pxr import Usd

from spin_usd.dataset.author.author import author_stage
from spin_usd.errors import InputError
from spin_usd.resources import bundled, bundled_names, stages
from spin_usd.scene.light import DiskLight, DistantLight, RectLight
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.read.stage_reader import StageReader

POSES = stages() / "examples" / "tango_speedplus_poses.json"


def authored(out, **choices):
    return author_stage(poses=POSES, target="cubesat", camera="speedplus", out=out, frames="0:1", **choices).root


def scene(root):
    reader = StageReader(root)
    return reader.scene(reader.frames[0])


def test_those_that_travel_along_are_reported_apart_by_their_kind() -> None:
    assert bundled_names("lights") == ("lightbox", "sun", "sunlamp")
    assert bundled_names("environment") == ("back_plate", "deep_space", "earth", "earth_full", "stars")


@pytest.mark.parametrize(
    ("lights", "kinds"), [("sun", [DistantLight]), ("lightbox", [RectLight] * 6), ("sunlamp", [DiskLight])]
)
def test_lights_by_name(tmp_path, lights, kinds) -> None:
    root = authored(tmp_path / "stage", lights=lights)
    assert [type(light) for light in scene(root).lights] == kinds
    assert not check_stage(root)


@pytest.mark.parametrize("name", bundled_names("environment"))
def test_environments_by_name_hold_what_their_layers_hold(tmp_path, name) -> None:
    root = authored(tmp_path / "stage", environment=name)
    own, there = Usd.Stage.Open(str(bundled("environment", name))), Usd.Stage.Open(root)
    names = [prim.GetName() for prim in own.GetDefaultPrim().GetChildren()]
    assert [prim.GetName() for prim in there.GetPrimAtPath("/World/Environment").GetChildren()] == names
    found = scene(root).environment
    assert (len(found.planets), len(found.stars), found.back_plate is not None) == (
        name.startswith("earth"),
        name == "stars",
        name == "back_plate",
    )
    assert not check_stage(root)


def test_they_stand_instead_of_the_presets_own(tmp_path) -> None:
    root = authored(tmp_path / "stage", preset="speedplus_synthetic", lights="sunlamp", environment="earth")
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
