"""Cameras whose lens others wrote: NVIDIA's names of OpenCV's lenses are read, any other projection is refused."""

import pytest

from spin_usd.commands.author.cameras import open_camera
from spin_usd.errors import SpinError
from spin_usd.geometry.camera import Camera
from spin_usd.stage.author.camera_layer import camera_layer_of, lens_of
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.read.stage_reader import StageReader

FLOAT32_PX = 1e-4
POINT = [0.6, 0.0, 2.0]


@pytest.mark.parametrize(("name", "u"), [("ocv", 495.14), ("fish", 494.8740767), ("none", 500.0)])
def test_the_lens_is_read_as_its_names_say(shared, name, u) -> None:
    """u = 320 + 600 (0.3 - 0.3 0.3^3), 320 + 600 arctan 0.3, and without a lens 320 + 600 0.3."""
    reader = StageReader(shared / "data" / "strangers" / "lens" / f"{name}.usda")
    found = reader.scene(reader.frames[0]).camera.project(POINT)
    assert found.tolist() == pytest.approx([u, 240.0], abs=FLOAT32_PX)


def test_author_takes_it_as_a_camera(shared) -> None:
    layer, _, notes = open_camera(str(shared / "data" / "strangers" / "lens" / "fish.usda"))
    assert lens_of(layer).project(POINT)[0] == pytest.approx(494.8740767, abs=FLOAT32_PX)
    assert notes == (
        "fish.usda is read by NVIDIA's names, as opencvFisheye: a fisheye of 640 x 480 pixels with its fx, fy, cx and "
        "cy at 600, 600, 320, 240",
    )


def test_words_of_a_document_make_no_lens_anothers(tmp_path) -> None:
    """The layer that author has written from one is ours: it says so in words alone."""
    layer = camera_layer_of(
        Camera(width=64, height=48, fx=60, fy=60, cx=32, cy=24), pixel_pitch=1e-5, documentation="The lens of a bench."
    )
    layer.Export(str(tmp_path / "ours.usda"))
    assert open_camera(str(tmp_path / "ours.usda"))[2] == ()


OTHERS = [
    ("opencvFisheye", "ftheta", "projection 'ftheta'"),
    ('"opencvPinhole"', '"generalizedProjection"', "generalizedProjection"),
    ("uniform token omni:lensdistortion:model = \"opencvPinhole\"", "token cameraProjectionType = \"fisheyeSpherical\"",
     "fisheyeSpherical"),
    ("omni:lensdistortion:opencvPinhole:k1", "omni:lensdistortion:opencvPinhole:k4", "its lens has k4"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "found"), OTHERS)
def test_any_other_projection_is_refused_and_found_by_check(shared, tmp_path, old, new, found) -> None:
    lens = "fish" if "Fisheye" in old else "ocv"
    path = tmp_path / "stage.usda"
    path.write_text((shared / "data" / "strangers" / "lens" / f"{lens}.usda").read_text().replace(old, new))
    reader = StageReader(path)
    with pytest.raises(SpinError, match=found):
        reader.scene(reader.frames[0])
    assert any(found in each.message for each in check_stage(path))
    with pytest.raises(SpinError, match=found):
        open_camera(str(path))


def test_a_back_plate_of_usd_is_refused_not_left_out(shared, tmp_path) -> None:
    text = (shared / "data" / "strangers" / "lens" / "none.usda").read_text()
    opening = 'def Camera "C" ('
    assert opening in text
    (tmp_path / "stage.usda").write_text(
        text.replace(opening, f'{opening}\n prepend apiSchemas = ["BackPlateAPI:sky"]')
    )
    reader = StageReader(tmp_path / "stage.usda")
    with pytest.raises(SpinError, match="BackPlateAPI"):
        reader.scene(reader.frames[0])
    assert any("BackPlateAPI" in each.message for each in check_stage(tmp_path / "stage.usda"))
