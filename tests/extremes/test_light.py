"""Light at the extremes: flux of targets too small to see, starlight to ten Suns, thirty stops, faces that coincide."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from spin_usd.geometry.transform import Transform
from spin_usd.scene.derived.light_groups import in_unit_light
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import DistantLight
from spin_usd.scene.material import Material
from spin_usd.scene.passes import Radiance
from spin_usd.scene.sensor import Optics, Sensor
from spin_usd.sensor.develop import develop
from spin_usd.stage.check.check_stage import check_stage
from tests.cases.scenes import scene, target, with_first
from tests.extremes.cases import camera, plate

SUN = 1361.0  # W/m2 at the Earth
IRRADIANCES = (1e-9, 1e-6, 1.0, SUN, 10 * SUN)  # a bright star gives 1e-8
ALBEDO = 0.8
WHITE = Material(path="/white", diffuse_color=(ALBEDO,) * 3, use_specular_workflow=True)
SIGMAS = 3.0
HITS = 12  # that each target gets at least, were there nothing but chance: so none at all would be too few
# Roundings of float32 between light and radiance: the lamp's strength, its colour, the cosine, the albedo, 1 / pi, the
# mean over samples, the gain.
ROUNDINGS = 16 * 2.0**-24


def lit(pixels, *lights, phase=(0.0, 0.0), away=50.0):
    """A matt plate, `pixels` across, square to the camera, its middle `phase` pixels from where the axis is."""
    through = camera(0.02)
    size = pixels * away / through.fx
    t = np.array([*phase, 0]) * away / through.fx + [0, 0, away]
    pose = Transform.from_quaternion(to="cam", of="body", q=(1, 0, 0, 0), t=t)
    return scene(target(*plate(half=size / 2), materials=(WHITE,)), camera=through, T_cam_body=pose, lights=lights)


def sun(irradiance, direction=(0.0, 0.0, 1.0), name="sun"):
    return DistantLight(path=f"/{name}", direction_cam=direction, irradiance=(irradiance,) * 3)


def in_its_light(renderer, s, samples=1):
    """The radiance as a picture gets it: rendered in unit light, then in the scene's own."""
    light = in_unit_light(s)
    return renderer.radiance(light.scene, Effort(samples=samples), seed=1).relit(light.gains)


@pytest.mark.parametrize("pixels", [0.05, 0.2, 0.7, 1.0, 3.0])
def test_flux_of_a_target_smaller_than_a_pixel(renderer, pixels) -> None:
    """What samples find of it, spread at random over their pixels or more evenly, has no more than chance's spread."""
    samples = max(64, int(HITS / pixels**2))
    phases = np.random.default_rng(5).uniform(-0.5, 0.5, (3, 2))
    expected, found = [], []
    for phase in phases:
        s = lit(pixels, sun(SUN), phase=phase)
        expected.append(pixels**2 * s.camera.fy / s.camera.fx)
        found.append(float(in_its_light(renderer, s, samples).rgb[..., 1].sum(dtype=np.float64)))
    flux = np.array(found) / (ALBEDO * SUN / np.pi)
    spread = np.sqrt(np.sum(expected) / samples)
    assert abs(flux.sum() - np.sum(expected)) <= SIGMAS * spread + ROUNDINGS


def test_radiance_is_proportional_to_irradiance_from_starlight_to_ten_suns(renderer) -> None:
    for irradiance in IRRADIANCES:
        rgba = in_its_light(renderer, lit(8.0, sun(irradiance))).rgba
        inside = rgba[..., 3] == 1
        assert inside.sum() > 40
        np.testing.assert_allclose(rgba[inside, :3], ALBEDO * irradiance / np.pi, rtol=ROUNDINGS)


def test_starlight_is_seen_where_the_sun_does_not_shine(renderer) -> None:
    """A million millionth of the light, on the side that the Sun leaves dark."""
    s = lit(8.0, sun(SUN, (0.0, 0.0, -1.0)), sun(1e-9, (0.6, 0.0, 0.8), "star"))
    rgba = in_its_light(renderer, s, samples=16).rgba
    np.testing.assert_allclose(rgba[rgba[..., 3] == 1, :3], ALBEDO * 0.8e-9 / np.pi, rtol=ROUNDINGS)


IDEAL = Sensor(encoding="linear", bit_depth=16)
NOISY = Sensor(encoding="linear", bit_depth=16, gain=2.5, full_well=15_000, read_noise=3, dark_current=10, prnu=0.01, black_level=64)  # fmt: skip  # noqa: E501
STOPS = tuple(range(-15, 16, 3))


def pictured(irradiance, stops, sensor, optics=None):
    """The image of a frame of which the upper half is lit."""
    s = replace(lit(8.0, sun(irradiance)), sensor=replace(sensor, exposure=2.0**stops), optics=optics or Optics())
    rgba = np.zeros((*s.camera.frame.shape, 4), np.float32)
    rgba[: s.camera.height // 2] = [*[ALBEDO * irradiance / np.pi] * 3, 1]
    with np.errstate(over="raise", invalid="raise", divide="raise"):
        return develop(s, Radiance.of(s.camera.frame, rgba), None, seed=3)


@pytest.mark.parametrize("irradiance", IRRADIANCES)
def test_thirty_stops_of_exposure_are_linear_until_they_saturate(irradiance) -> None:
    for stops in STOPS:
        image = pictured(irradiance, stops, IDEAL)
        signal = ALBEDO * irradiance / np.pi * 2.0**stops
        assert np.abs(image[0].astype(float) - min(round(65535 * signal), 65535)).max() <= 1
        assert (image[-1] == 0).all()


@pytest.mark.parametrize("irradiance", IRRADIANCES)
def test_a_detector_saturates_cleanly(irradiance) -> None:
    """No warning of arithmetic, more light is never darker, and what is above every limit is the limit."""
    images = [pictured(irradiance, stops, NOISY) for stops in STOPS]
    means = [float(image[0].mean()) for image in images]
    noise = 65535 / 4095 * (3 / 2.5 + np.sqrt(15_000) / 2.5)
    assert all(later >= sooner - noise for sooner, later in pairwise(means))
    electrons = ALBEDO * irradiance / np.pi * 2.0 ** STOPS[-1] * 4095 * 2.5
    if electrons > 4 * 15_000:
        assert (images[-1][0] == 65535).all()
    scattered = pictured(irradiance, STOPS[-1], NOISY, Optics(psf_sigma=0.8, glare=0.05))
    assert scattered[0].mean() >= scattered[-1].mean()


def test_coincident_faces_lose_their_light_in_blender(blender) -> None:
    """What the finding on coincident faces says of the picture, and why it is one."""
    single = lit(8.0, sun(SUN))
    points, faces = plate(half=float(np.abs(single.target.mesh.points).max()))
    doubled = with_first(single, target=target(points, np.concatenate([faces, faces]), materials=(WHITE,)))
    bright, dark = (in_its_light(blender, s).rgb.sum() for s in (single, doubled))
    assert dark < 0.9 * bright


SPECK = """
    double3 xformOp:translate = (0, 0, {away})
    uniform token[] xformOpOrder = ["xformOp:translate"]
"""


@pytest.mark.parametrize(("away", "count"), [(-150.0, 0), (-200.0, 1), (-1e5, 1), (500.0, 0)])
def test_targets_smaller_than_a_few_pixels_are_reported(away, count, tmp_path) -> None:
    from tests.extremes.stages import STAGE

    lens = (64, 48, 500.0, 500.0, 32.0, 24.0)  # a cube of 1 m is 1.73 m from corner to corner
    path = tmp_path / "stage.usda"
    path.write_text(STAGE.format(unit=1.0, lens=lens, world="", camera="", target=SPECK.format(away=away), size=1))
    found = [finding for finding in check_stage(path) if finding.code == "target-small"]
    assert [(finding.where, finding.severity) for finding in found] == [("/World/Target", "warning")] * count
    assert all("labels, which are of pixel centres, may show nothing of it" in finding.message for finding in found)
