"""What a record says of its picture beside its files: where it comes from, whom it shows, and in what light."""

import shutil

import numpy as np
import pytest

from spin_usd.geometry.transform import Transform
from spin_usd.reading.dataset import Dataset
from spin_usd.reading.measures import values_of
from tests.cases.records import record_at


def render(spin_usd, stage, out, *more):
    spin_usd("render", stage, "--out", out, "--renderer", "raycast", "--frames", "0:1", *more)
    return record_at(out / "records" / "nominal" / "img000001.json")


def test_it_names_the_source_the_target_and_the_sun(small_stage, tmp_path, spin_usd) -> None:
    record = render(spin_usd, small_stage, tmp_path, "--labels", "none")
    q, t = record["pose"]["q_cam_body"], record["pose"]["t_cam_body"]
    assert record["source_file"] == "img000001.jpg"
    (target,) = record["targets"]
    assert (target["id"], target["name"], target["pose"]) == (1, "cubesat", record["pose"])
    assert target["range"] == pytest.approx(np.linalg.norm(t))
    sun, pose = record["sun"], Transform.from_quaternion(to="cam", of="body", q=q, t=t)
    assert np.linalg.norm(sun["towards_cam"]) == pytest.approx(1)
    np.testing.assert_allclose(pose.directions(np.array(sun["towards_body"])), sun["towards_cam"], atol=1e-12)
    image = record["files"]["image"]
    assert (image["dtype"], image["channels"], image["encoding"]) == ("uint8", {"Y": "grey"}, "srgb")


def test_names_that_change_nothing_else_are_reported_and_nothing_is_made_again(small_stage, tmp_path, spin_usd) -> None:
    stage, out = tmp_path / "stage" / small_stage.name, tmp_path / "dataset"
    shutil.copytree(small_stage.parent, stage.parent)
    before = render(spin_usd, stage, out, "--labels-only")
    assert "sun" not in before
    stage.write_text(stage.read_text().replace('spin:target:name = "cubesat"', 'spin:target:name = "mango"'))
    image = (out / "depth" / "nominal" / "img000001.exr").stat()
    after = render(spin_usd, stage, out, "--labels-only")
    assert (out / "depth" / "nominal" / "img000001.exr").stat() == image
    assert after["targets"] == [{**before["targets"][0], "name": "mango"}]
    assert (after["source_file"], after["files"]) == (before["source_file"], before["files"])


def test_it_says_how_the_image_was_exposed_and_lit(small_stage, tmp_path, spin_usd) -> None:
    """The camera's numbers, what auto-exposure made of them, the Sun's strength, and nothing of labels alone."""
    stage = tmp_path / "stage" / small_stage.name
    shutil.copytree(small_stage.parent, stage.parent)
    layer = stage.parent / "layers" / "camera.usda"
    exposing = "float exposure:fStop"
    layer.write_text(layer.read_text().replace(exposing, f"bool spin:sensor:autoExposure = 1\n    {exposing}", 1))
    record = render(spin_usd, stage, tmp_path / "set", "--labels", "none")
    found = record["appearance"]
    (sun,) = found["lights"]
    assert (sun["unit"], sun["strength"]) == ("W/m2", [pytest.approx(1361)] * 3)
    assert found["exposure_chosen"] == pytest.approx(found["exposure"] * record["provenance"]["auto_exposure"])
    assert found["read_noise"] == 7
    pictures = Dataset(tmp_path / "set")
    assert len(pictures.where("record.appearance.read_noise == 7 and record.appearance.lights[0].strength[0] > 1")) == 1
    assert values_of(pictures[0])["record.appearance.exposure"] == found["exposure"]
    assert "appearance" not in render(spin_usd, stage, tmp_path / "labels", "--labels-only")
