"""Sampling specifications, as files and as text, become stages that are as they say."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import kstest, loguniform, uniform

from spin_usd.basics.resources import bundled
from spin_usd.commands.author.in_child import author_stage
from spin_usd.errors import InputError
from spin_usd.geometry.framing import framed_shares
from spin_usd.geometry.rotation import matrices_from_quaternions
from spin_usd.sampling.sample import stream
from spin_usd.specifications.part_pictures import part_pictures, sample_poses
from spin_usd.specifications.sampling_spec import open_spec
from spin_usd.stage.author.camera_layer import lens_of, open_camera_layer
from spin_usd.stage.author.source_bounds import box_corners, hull_corners
from spin_usd.stage.author.target_asset import describe
from spin_usd.stage.read.stage_reader import StageReader

SURE = 1e-3  # a sample of the right distribution fails a Kolmogorov-Smirnov test as seldom as this
LENS = lens_of(open_camera_layer(bundled("camera", "speedplus")))
TANGO = describe(bundled("target", "tango"), "tango")
TEXT = "range=3..10 attitude=uniform inside=0.9 count=1000"
ROUNDED = 1e-8  # of nine digits


@pytest.fixture(scope="module")
def hull():
    return hull_corners(TANGO)


def sampled(text, hull, count=None, seed=0):
    spec = open_spec(text)
    return sample_poses(part_pictures(spec, count), seed, LENS, [hull] * len(part_pictures(spec, count)), spec.source)


def authored(folder, sample, **choices):
    report = author_stage(sample=sample, out=folder, **{"target": "tango", "camera": "speedplus"} | choices)
    return report, StageReader(report.root)


def sun_of(scene):
    """The direction to the Sun, camera axes."""
    return -np.array(next(light for light in scene.lights if light.path.endswith("/Sun")).direction_cam)


def test_a_line_of_text_samples_as_it_says(hull) -> None:
    poses = sampled(TEXT, hull)
    assert poses.names[:2] == ("img000001", "img000002")
    assert kstest(np.linalg.norm(poses.t_cam_body, axis=1), uniform(3, 7).cdf).pvalue > SURE
    for component in np.abs(poses.q_cam_body).T:
        assert kstest(component, lambda x: 2 / np.pi * (np.arcsin(x) + x * np.sqrt(1 - x * x))).pvalue > SURE
    shares = framed_shares(LENS, hull, matrices_from_quaternions(poses.q_cam_body), poses.t_cam_body)
    assert 0.9 <= min(shares) < 0.999


def test_ranges_can_be_alike_in_ratio(hull) -> None:
    away = np.linalg.norm(sampled("range=log(2..40) count=1000", hull).t_cam_body, axis=1)
    assert kstest(away, loguniform(2, 40).cdf).pvalue > SURE


def test_the_first_ten_of_a_thousand_are_the_ten(hull) -> None:
    ten, all_of_them = sampled(TEXT, hull, 10), sampled(TEXT, hull, 200)
    assert (ten.t_cam_body == all_of_them.t_cam_body[:10]).all()
    assert (ten.q_cam_body == all_of_them.q_cam_body[:10]).all()
    assert (sampled(TEXT, hull, 10, seed=1).t_cam_body != ten.t_cam_body).all()


def test_the_hull_is_within_the_box_and_touches_it(hull) -> None:
    box = box_corners(TANGO)
    np.testing.assert_allclose([hull.min(0), hull.max(0)], [box.min(0), box.max(0)], atol=1e-9)


def test_the_sun_is_where_the_text_has_it_relative_to_the_target(tmp_path) -> None:
    text = "range=5 count=8 inside=1 facing=0,0,1:60 sun.from_target=0,0,1:20 target_lit_deg=80"
    report, reader = authored(tmp_path / "stage", text)
    assert report.frames == 8
    for frame in reader.frames:
        scene = reader.scene(frame)
        towards = sun_of(scene)
        own = scene.bodies[0].T_cam_body.rotation.T @ towards
        assert np.degrees(np.arccos(own[2])) <= 20 + ROUNDED
        camera = -scene.bodies[0].T_cam_body.points(scene.bodies[0].target.mesh.centre)
        assert np.degrees(np.arccos(towards @ camera / np.linalg.norm(camera))) <= 80 + ROUNDED


def test_a_fly_around_has_its_sun_in_each_picture(tmp_path) -> None:
    report, reader = authored(tmp_path / "stage", "fly_around", frames="0:590:59")
    assert report.frames == 10
    law = open_spec("fly_around").parts[0].law
    suns = law.sun_directions(stream(0, "sun", "fly_around/0"), 590)[::59]
    for frame, sun in zip(reader.frames, suns, strict=True):
        scene = reader.scene(frame)
        assert sun_of(scene) == pytest.approx(sun, abs=ROUNDED)
        assert np.abs(scene.bodies[0].T_cam_body.translation[:2]).max() < ROUNDED
        assert 8 - ROUNDED <= scene.bodies[0].T_cam_body.translation[2] <= 16.5


def test_the_text_is_in_the_stages_provenance(tmp_path) -> None:
    report, _ = authored(tmp_path / "stage", "range=5 count=1")
    assert "range=5 count=1" in Path(report.root).read_text()


def test_the_command_samples(tmp_path, spin_usd) -> None:
    options = ("--sample", "range=3..10 inside=1", "--count", 3, "--target", "tango", "--camera", "speedplus")
    done = spin_usd("author", *options, "--out", tmp_path / "stage", "--json")
    assert json.loads(done.stdout)["frames"] == 3


TUMBLE = """
schema = "sample-1"
[[part]]
name = "a"
names = "a{picture}"
pictures = 3
[part.trajectory]
step_s = 10
attitude = { distribution = "attitudes" }
sun = { distribution = "directions" }
[part.trajectory.chaser.approach]
start_m = [0, -20, 0]
end_m = [0, -10, 0]
[part.trajectory.tumble]
rate_deg_s = { distribution = "fixed", value = 1 }
axis = { distribution = "directions" }
inertia_kg_m2 = [12, 20, 26]
"""
ORBIT = "[part.trajectory.orbit]\nforward_m = 3\n"


@pytest.mark.parametrize(
    ("old", "new", "word"),
    [
        ("[12, 20, 26]", "[12, 20, 40]", "inertia_kg_m2 has the principal moments 12, 20, 40"),
        ("[12, 20, 26]", "[[12, 1, 0], [2, 20, 0], [0, 0, 26]]", "is not symmetric"),
        ("[12, 20, 26]", "[12, 20]", "inertia_kg_m2"),
        ("[12, 20, 26]", "[[12, 0, 0], 20, 26]", "inertia_kg_m2 mixes numbers and rows"),
        ("[part.trajectory.tumble]", f"{ORBIT}[part.trajectory.tumble]", "trajectory: has both orbit and chaser"),
        ("[part.trajectory.chaser.approach]", f"{ORBIT}[part.trajectory.chase]", "is chaser meant?"),
        ("[12, 20, 26]", "12", "inertia_kg_m2: 12 is not a list"),
        ("attitude = {", 'attitude = "any" # {', "attitude: 'any' is not a table"),
        ("step_s = 10", "", "step_s"),
        ("start_m = [0, -20, 0]", "", "start_m"),
        ("approach", "approche", "approche"),
        ('sun = { distribution = "directions" }', 'sun = { distribution = "up" }', "sun"),
        ("[part.trajectory]", "[constraints]\ntarget_lit_deg = 9\n[part.trajectory]", "target_lit_deg"),
        ("pictures = 3", 'pictures = 3\nsample."sun.direction" = { distribution = "directions" }', "sun.direction"),
    ],
)
def test_what_is_wrong_with_a_trajectory_names_its_key(tmp_path, old, new, word) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(TUMBLE.replace(old, new))
    with pytest.raises(InputError) as raised:
        authored(tmp_path / "stage", file)
    assert word in str(raised.value)
    assert not (tmp_path / "stage").exists()


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("range=3..10 inside=2 count=1", "inside"),
        ("range=0.3 inside=1 count=1", "'inside'"),
        ("range=10..3 count=1", "'range': no number"),
        ("range=3 inside=0.9..0.2 count=1", "'inside': no number lies between 0.9 and 0.2"),
        ("inside=1 count=1", "range"),
        ("range=3 count=1.5", "'count'"),
        ("range=3 count=1 moon.direction=0,0,1", "moon.direction"),
        ("range=3 count=1 sun_up_deg=3", "sun_up_deg"),
    ],
)
def test_what_is_wrong_with_a_text_names_its_word(tmp_path, text, word) -> None:
    with pytest.raises(InputError) as raised:
        authored(tmp_path / "stage", text)
    assert word in str(raised.value)


@pytest.mark.parametrize(
    ("words", "key"),
    [
        ('distribution = "fixed", value = 0', "range.value"),
        ('distribution = "uniform", low = -5, high = -1', "range.low"),
        ('distribution = "choice", values = [3, -3]', "range.values[1]"),
        ('distribution = "normal", mean = 3, sigma = 2', "'low' is missing"),
        ('distribution = "uniform", low = 1', "range: 'high' is missing"),
        ('distribution = "uniform", low = "near", high = 3', "range.low: 'near' is not a number"),
        ('distribution = "up"', "range.distribution: 'up' is not one of fixed, uniform"),
        ('distribution = "fixed", value = "far"', "range.value: 'far' is not of type"),
    ],
)
def test_a_file_has_ranges_that_are_numbers_above_0(tmp_path, words, key) -> None:
    file = tmp_path / "mine.toml"
    part = '[[part]]\nname = "a"\nnames = "a{picture}"\npictures = 3\n'
    file.write_text(
        f'schema = "sample-1"\n{part}poses.range = {{ {words} }}\nposes.attitude.distribution = "attitudes"'
    )
    with pytest.raises(InputError, match=re.escape(key)):
        open_spec(file)


def test_a_text_needs_a_target_and_a_camera(tmp_path) -> None:
    for name, nothing in (("target", None), ("camera", ())):
        with pytest.raises(InputError, match=f"names no {name}"):
            authored(tmp_path / "stage", "range=3 count=1", **{name: nothing})
