"""The values of a picture: against formulas of their own, and in pictures with planted light."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import spin_usd
from spin_usd.commands.evidence.calls import MeasureRow
from spin_usd.commands.evidence.picture_row import background_of, blur_of, picture_row, roll_of, signal_to_noise
from spin_usd.formats.image_file import encoded_image
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.realism.picture_view import PictureView
from tests.cases.lit_scenes import EARTH, MATT, a_scene
from tests.cases.root_layers import over_stage
from tests.conftest import speedplus_camera

NEAR = 0.1  # of a signal to noise: the noise in the dark is of the darkest blocks, its growth of the flattest
READ, SHOT = 2.0, 0.2  # steps of 8 bits, and variance per step of signal


@pytest.fixture(scope="module")
def picture(sets):
    return spin_usd.Dataset(sets / "close" / "dataset")[0]


@pytest.mark.parametrize("signal", [40.0, 160.0])
def test_signal_to_noise_is_that_of_the_planted_noise(signal) -> None:
    """A plate of even steps of grey about the signal, before the dark."""
    rng, side = np.random.default_rng(0), 320
    light = np.zeros((side, side))
    light[80:240, 80:240] = np.repeat(np.linspace(signal - 30, signal + 30, 10), 16)[None]
    noise = np.sqrt(READ**2 + SHOT * light) * rng.standard_normal(light.shape)
    view = PictureView(grey=(light + noise + 10).astype(np.float32), parts=(light > 0).astype(np.uint16))
    assert signal_to_noise(view) == pytest.approx(signal / np.sqrt(READ**2 + SHOT * signal), rel=NEAR)


def test_a_target_of_few_pixels_has_none() -> None:
    parts = np.zeros((64, 64), np.uint16)
    parts[30:33, 30:33] = 1
    assert signal_to_noise(PictureView(grey=np.ones((64, 64), np.float32), parts=parts)) is None


def test_blur_across_is_the_way_of_the_nearest_corner(picture) -> None:
    """Without rotation every corner moves alike: the nearest goes farthest."""
    target = replace(picture.targets[0], velocity=np.array([2.0, 0, 0]), angular_velocity=np.zeros(3))
    corners = np.array([[x, y, z] for x in target.box[:, 0] for y in target.box[:, 1] for z in target.box[:, 2]])
    nearest = (corners @ target.T_cam_body[:3, :3].T)[:, 2].min() + target.t_cam_body[2]
    time = picture.recorded.appearance.time
    plain = replace(picture, camera=replace(picture.camera, distortion=(0.0,) * 5))
    assert blur_of(plain, target) == pytest.approx(2.0 * time * plain.camera.fx / nearest, rel=1e-9)


def test_blur_of_a_turning_target_is_that_of_its_poses_at_both_ends(picture) -> None:
    target = replace(picture.targets[0], velocity=np.zeros(3), angular_velocity=np.array([0, 0, 0.5]))
    half = picture.recorded.appearance.time * 0.5 / 2  # radians
    corners = np.array([[x, y, z] for x in target.box[:, 0] for y in target.box[:, 1] for z in target.box[:, 2]])
    ends = []
    for sign in (-1, 1):
        turn = matrix_from_quaternion([np.cos(half / 2), 0, 0, sign * np.sin(half / 2)])
        places = corners @ (turn @ target.T_cam_body[:3, :3]).T + target.t_cam_body
        ends.append(picture.camera.project(places))
    assert blur_of(picture, target) == pytest.approx(np.linalg.norm(ends[1] - ends[0], axis=1).max(), rel=1e-3)


def test_a_stage_without_motion_is_sharp(picture) -> None:
    assert np.isnan(picture.targets[0].velocity).any()
    assert blur_of(picture, picture.targets[0]) == 0.0


@pytest.mark.parametrize("degrees", [0, 45, 170, 300])
def test_roll_turns_clockwise_in_the_picture(picture, degrees) -> None:
    """The body's z axis, up in the image at 0, right at 90."""
    angle = np.radians(degrees)
    T = np.eye(4)
    T[:3, :3] = np.stack([[0, 0, -1.0], [np.cos(angle), np.sin(angle), 0], [np.sin(angle), -np.cos(angle), 0]], -1)
    T[:3, 3] = (0, 0, 5)
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1)
    turned = replace(picture.targets[0], T_cam_body=T, t_cam_body=T[:3, 3])
    assert roll_of(turned) == pytest.approx(degrees, abs=1e-9)


@pytest.mark.parametrize(
    ("place", "behind"), [((0, 7e6, 1e6), "planet"), ((0, 7e6, -2e6), "space"), ((0, 0, 7e6), "planet")]
)
def test_a_planet_in_the_view_is_behind(place, behind) -> None:
    """Earth below the camera: its limb is 66 degrees off its centre, half the view 19 degrees."""
    at = replace(EARTH, T_cam_planet=replace(EARTH.T_cam_planet, translation=np.array(place, float)))
    assert background_of(a_scene(MATT, planets=(at,))) == behind


def test_without_a_planet_it_is_space() -> None:
    assert background_of(a_scene(MATT)) == "space"


def test_without_its_stage_light_around_the_target_is_a_planet(sets, tmp_path) -> None:
    shutil.copytree(sets / "close" / "dataset", tmp_path / "set")
    picture = spin_usd.Dataset(tmp_path / "set")[0]
    lit = picture.image.copy()
    lit[:, : lit.shape[1] // 3] += 60
    (tmp_path / "set" / picture.files["image"].path).write_bytes(encoded_image(lit, ".png", channels=("Y",)))

    def behind(name):
        request = MeasureRow(dataset=str(tmp_path / "set"), record=f"records/nominal/{name}.json")
        return picture_row(request).background

    assert behind("img000001") == "space"
    shutil.rmtree(tmp_path / "set" / "stage")
    assert (behind("img000001"), behind("img000002")) == ("planet", "space")


@pytest.mark.parametrize("shutter", [False, True])
def test_pictures_of_a_motion_are_blurred_by_a_shutter_alone(tmp_path, shutter) -> None:
    (tmp_path / "camera.json").write_text(json.dumps(speedplus_camera(divide=8)))
    made = spin_usd.author(
        sample="fly_around", frames="0:6", target="cubesat", camera=tmp_path / "camera.json", out=tmp_path / "stage"
    )
    body = "double shutter:open = -0.001\ndouble shutter:close = 0.001" if shutter else ""
    root, rates = Path(made.root).parent / "shutter.usda", re.compile(r"\w+PerSecond = \S+")
    own = {found.split()[0]: found for found in rates.findall(Path(made.root).read_text())}
    layer = over_stage(frames=made.frames, body=f'over "Camera"\n{{\n{body}\n}}')
    root.write_text(rates.sub(lambda found: own[found[0].split()[0]], layer))
    spin_usd.render(root, out=tmp_path / "set", renderer="raycast", samples=1, labels="segmentation", frames="0:1")
    picture = spin_usd.Dataset(tmp_path / "set")[0]
    moved = blur_of(picture, picture.targets[0])
    assert moved is not None
    assert moved > 0
    (record,) = (tmp_path / "set" / "records" / "nominal").iterdir()
    row = picture_row(MeasureRow(dataset=str(tmp_path / "set"), record=f"records/nominal/{record.name}"))
    assert row.blur == (moved if shutter else 0.0)


def test_a_picture_without_an_image_has_what_its_record_states(small_stage, tmp_path) -> None:
    spin_usd.render(small_stage, out=tmp_path / "set", frames="0:1", labels="depth", labels_only=True)
    (name,) = (tmp_path / "set" / "records" / "nominal").iterdir()
    row = picture_row(MeasureRow(dataset=str(tmp_path / "set"), record=f"records/nominal/{name.name}"))
    assert row.range is not None
    assert row.size is not None
    assert (row.signal_to_noise, row.background, row.blur) == (None, "space", 0.0)
