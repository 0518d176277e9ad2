"""Fits as layers: pictures of the written stage are the fitted ones, and the stage that was fitted stays as it was."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from spin_usd.commands.author.augment import augment_stage
from spin_usd.errors import OutputError, UnsupportedError
from spin_usd.geometry.transform import Transform
from spin_usd.renderers.raycast.renderer import RaycastRenderer
from spin_usd.scene.derived.light_groups import LightGroups, emission_of
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import DistantLight, DomeLight, RectLight, SphereLight
from spin_usd.sensor.develop import developed_without_noise
from spin_usd.stage.augment.fitted_stage import FITS, ROOT, FittedPicture, write_fits
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.stage.read.lights import find_lights
from spin_usd.stage.read.stage_reader import StageReader

EXACT = 1e-9  # metres, and of directions: doubles all the way
ROUNDED = 1e-6  # relative: intensities, colours and sizes are float32
STILL = np.array([0.5, -0.25, -0.7])  # metres from the target's centre
SPEC = """
schema = "augment-1"
seed = 5
[[augmentation]]
name = "a"
[augmentation.sample]
"exposure.stops" = { distribution = "fixed", value = 1, unit = "stops" }
"sun.direction" = { distribution = "fixed", value = [0, 0, -1] }
"optics.psf_sigma" = { distribution = "fixed", value = 2, unit = "px" }
"material.*.roughness" = { distribution = "fixed", value = 0.3 }
"""
MOVING = """
double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 2: (30, -20, 100) }
quatd xformOp:orient.timeSamples = { 0: (1, 0, 0, 0), 2: (0.9998000066665778, 0, 0.01999866669333308, 0) }
uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:orient"]
bool spin:sensor:autoExposure = 1
"""
SUN = 'def DistantLight "Sun" {\n float inputs:intensity = 1000\n bool inputs:normalize = 1\n}'


def panels(scene, seed):
    """Different lights around the target of each scene, in its camera's axes: a Sun, two panels and a lamp, of which
    some are dark."""
    rng, centre = np.random.default_rng(seed), scene.bodies[0].T_cam_body.points(scene.bodies[0].target.mesh.centre)
    away = rng.normal(size=3)
    x, y, z = (away / np.linalg.norm(away)).tolist()
    yield DistantLight(path="/Fit/Sun", direction_cam=(x, y, z), irradiance=(seed * 100.0,) * 3, angle=0.01 * seed)

    def at(place):
        q = rng.normal(size=4)
        return Transform.from_quaternion(to="cam", of="light", q=q / np.linalg.norm(q), t=centre + place)

    colour = 10 * seed + rng.random(3)
    yield RectLight(
        path="/Fit/Moving", T_cam_light=at(rng.normal(size=3)), emission=tuple(colour), width=0.3, height=0.2
    )
    still = Transform(to="cam", of="light", rotation=np.eye(3), translation=centre + STILL)
    yield RectLight(path="/Fit/Still", T_cam_light=still, emission=(7.5 * (seed == 1),) * 3, width=1, height=0.5)
    yield RectLight(path="/Fit/Dark", T_cam_light=still, emission=(0.0,) * 3, width=1, height=0.5)
    if seed == 2:
        yield SphereLight(path="/Fit/Lamp", T_cam_light=at(rng.normal(size=3)), emission=(3.0, 2.0, 1.0), radius=0.1)


def fitted(reader, numbers=(0, 1, 2)):
    """Those frames with other lights, black level and noise in each, and the same gain and optics in all."""
    for seed, frame in enumerate(reader.frames[number] for number in numbers):
        scene = reader.scene(frame)
        sensor = replace(
            scene.sensor,
            auto_exposure=None,
            gain=8.0,
            full_well=9e3,
            adc_bits=10,
            black_level=29.5 + seed,
            read_noise=6.0 / (1 + seed),
        )
        optics = replace(scene.optics, psf_sigma=0.7)
        yield FittedPicture(
            frame=frame, scene=replace(scene, lights=tuple(panels(scene, seed)), sensor=sensor, optics=optics)
        )


def shining(scene):
    return {light.path.rsplit("/", 1)[1]: light for light in scene.lights if any(emission_of(light))}


def assert_same_lights(found, asked):
    found, asked = shining(found), shining(asked)
    assert found.keys() == asked.keys()
    for name, light in asked.items():
        other = found[name]
        assert type(other) is type(light)
        np.testing.assert_allclose(emission_of(other), emission_of(light), rtol=ROUNDED)
        if isinstance(light, DistantLight):
            np.testing.assert_allclose(other.direction_cam, light.direction_cam, atol=EXACT)
            assert other.angle == pytest.approx(light.angle, rel=ROUNDED)
            continue
        np.testing.assert_allclose(other.T_cam_light.rotation, light.T_cam_light.rotation, atol=EXACT)
        np.testing.assert_allclose(other.T_cam_light.translation, light.T_cam_light.translation, atol=EXACT)
        np.testing.assert_allclose(other.size, light.size, rtol=ROUNDED)


def selected(root, variant):
    """The scenes of the written stage where its lights are selected."""
    stage = open_stage(root)
    stage.SetEditTarget(stage.GetSessionLayer())
    stage.GetPrimAtPath("/World/FittedLights").GetVariantSet("fitted_light").SetVariantSelection(variant)
    reader = StageReader(root, stage=stage)
    return [reader.scene(frame) for frame in reader.frames]


@pytest.fixture(scope="module")
def augmented(small_stage, tmp_path_factory):
    """A stage with looks, and an augmentation that sets what is fitted."""
    folder = tmp_path_factory.mktemp("augmented")
    shutil.copytree(small_stage.parent, folder / "stage")
    (folder / "spec.toml").write_text(SPEC)
    augment_stage(stage=folder / "stage" / small_stage.name, spec=folder / "spec.toml")
    return folder / "stage" / small_stage.name


@pytest.fixture(scope="module")
def written(augmented, tmp_path_factory):
    """The stage's reader, the pictures, the stage's hash before, and the root layer of the stage with their fits."""
    reader = StageReader(augmented)
    pictures = tuple(fitted(reader, (0, 2, 5)))
    values = {"material.*.roughness.factor": 0.5}
    before = StageReader(augmented).stage_hash
    root = write_fits(augmented, tmp_path_factory.mktemp("fits"), pictures, fits=FITS, values=values)
    return reader, pictures, before, root


def test_each_picture_has_its_own_light_and_camera(written, augmented) -> None:
    reader, pictures, before, root = written
    again = StageReader(root)
    assert [frame.name for frame in again.frames] == [frame.name for frame in reader.frames]
    for picture in pictures:
        scene = again.scene(again.frames[picture.frame.index])
        assert_same_lights(scene, picture.scene)
        assert (scene.sensor, scene.optics) == (picture.scene.sensor, picture.scene.optics)
        assert len(LightGroups.of(scene).placed) == len(shining(picture.scene))
    assert StageReader(augmented).stage_hash == before != again.stage_hash


def test_surfaces_are_those_of_the_stage_times_the_factor(written) -> None:
    reader, _, _, root = written
    (own,), (found,) = ([s.bodies[0].target for s in [r.scene(r.frames[0])]] for r in (reader, StageReader(root)))
    for before, after in zip(own.materials, found.materials, strict=True):
        assert after == replace(before, roughness=pytest.approx(before.roughness / 2, rel=ROUNDED))


def test_a_variant_of_the_lights_has_one_pictures_strengths_in_all(written) -> None:
    _, pictures, _, root = written
    for picture in pictures:
        scenes = selected(root, picture.frame.name)
        assert_same_lights(scenes[picture.frame.index], picture.scene)
        asked = {name: emission_of(light) for name, light in shining(picture.scene).items()}
        for scene in scenes:
            assert {name: emission_of(light) for name, light in shining(scene).items()} == {
                name: pytest.approx(emission, rel=ROUNDED) for name, emission in asked.items()
            }


def test_lights_stay_around_the_target_in_frames_without_a_fit(written) -> None:
    _, pictures, _, root = written
    for scene in selected(root, pictures[1].frame.name):
        centre = scene.bodies[0].T_cam_body.points(scene.bodies[0].target.mesh.centre)
        place = shining(scene)["Still"].T_cam_light.translation
        np.testing.assert_allclose(place - centre, STILL, atol=EXACT)


def test_check_finds_nothing(written) -> None:
    assert list(check_stage(written[-1])) == []


def test_the_image_is_that_of_the_fitted_scene(written) -> None:
    _, pictures, _, root = written
    written_scene = StageReader(root).scene(pictures[1].frame)
    same_surfaces = replace(pictures[1].scene, bodies=written_scene.bodies)
    images = []
    for scene in (written_scene, same_surfaces):
        radiance = RaycastRenderer().radiance(scene, Effort(samples=1), seed=0)
        images.append(developed_without_noise(scene, radiance, None))
    assert images[0].max() > images[0].min() + 5  # digital numbers
    np.testing.assert_allclose(images[0], images[1], rtol=1e-5)


def test_a_moving_metered_camera_in_centimetres_with_one_kind_of_fit(make_stage, tmp_path) -> None:
    metadata = "metersPerUnit = 0.01\n startTimeCode = 0\n endTimeCode = 2"
    pose = 'double3 xformOp:translate = (0, 0, -1000)\nuniform token[] xformOpOrder = ["xformOp:translate"]'
    apis = ("SpinLensAPI", "SpinSensorAPI")
    path = make_stage('def Cube "Box" {}', metadata=metadata, pose=pose, world=SUN, camera=MOVING, apis=apis)
    reader = StageReader(path)
    pictures = tuple(fitted(reader))
    own = [reader.scene(picture.frame) for picture in pictures]
    codes = {finding.code for finding in check_stage(path)}
    for fit in FITS:
        again = StageReader(write_fits(path, tmp_path / fit, pictures, fits={fit}, values={}))
        for frame, picture, before in zip(again.frames, pictures, own, strict=True):
            scene = again.scene(frame)
            assert_same_lights(scene, picture.scene if fit == "light" else before)
            expected = picture.scene if fit == "camera" else before
            assert (scene.sensor, scene.optics) == (expected.sensor, expected.optics)
        assert {finding.code for finding in check_stage(tmp_path / fit / ROOT)} <= codes


def test_a_stage_with_fits_is_fitted_again(written, tmp_path) -> None:
    _, pictures, _, root = written
    reader = StageReader(root)
    again = StageReader(write_fits(root, tmp_path / "again", pictures[:1], fits={"light"}, values={}))
    assert_same_lights(again.scene(again.frames[0]), pictures[0].scene)
    assert {prim.GetPath().GetParentPath().name for prim in find_lights(again.stage)} == {"FittedLights_2"}
    assert len(reader.frames) == len(again.frames)


def test_what_cannot_be_written_leaves_nothing(written, augmented, tmp_path) -> None:
    _, pictures, _, root = written
    dome = DomeLight(path="/Dome", T_cam_dome=pictures[0].scene.bodies[0].T_cam_body, radiance=(1.0, 1.0, 1.0))
    picture = replace(pictures[0], scene=pictures[0].scene.with_lights((dome,)))
    with pytest.raises(UnsupportedError, match="/Dome: cannot be written as a fitted light; fit plain lights of the"):
        write_fits(augmented, tmp_path / "none", [picture], fits={"light"}, values={})
    assert not (tmp_path / "none").exists()
    with pytest.raises(OutputError, match="exists already; give a new folder"):
        write_fits(augmented, root.parent, pictures, fits={"light"}, values={})
