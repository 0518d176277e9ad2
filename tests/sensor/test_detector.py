"""Exposure: linear light to numbers, by the standards' own formulas."""

from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from spin_usd.errors import UnsupportedError
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.region import Region
from spin_usd.scene.passes import Radiance
from spin_usd.scene.sensor import Sensor
from spin_usd.sensor.develop import develop
from tests.cases import scenes

SHAPE = (4, 6)
REGION = Region(x0=1, y0=2, x1=4, y1=4)


def shot(rgb, **sensor):
    pixels = np.broadcast_to(np.asarray([*rgb, 1], np.float32), (*REGION.shape, 4)).copy()
    return develop(taken_by(Sensor(**sensor)), Radiance.of(REGION, pixels), None, seed=0)


def taken_by(sensor):
    camera = Camera(width=SHAPE[1], height=SHAPE[0], fx=9, fy=9, cx=3, cy=2)
    return scenes.scene(scenes.target(*scenes.box()), camera=camera, sensor=sensor)


def test_srgb_of_middle_grey() -> None:
    """18 % is 118 and 50 % is 188 in every table of sRGB."""
    assert [shot([v] * 3)[2, 1] for v in (0, 0.18, 0.5, 1)] == [0, 118, 188, 255]


@given(st.floats(0, 2), st.sampled_from([8, 16]))
def test_linear_numbers_are_rounded_and_clipped(value, bits) -> None:
    top = 2**bits - 1
    found = int(shot([value] * 3, encoding="linear", bit_depth=bits)[2, 1])
    assert abs(found - min(value, 1) * top) <= 0.5 + 1e-2  # float32 of the radiance is worth 4e-3 of 16 bits


@given(st.floats(0.01, 100), st.floats(0.01, 1))
def test_exposure_scales_radiance(exposure, value) -> None:
    scaled = shot([value / exposure] * 3, exposure=exposure, encoding="linear", bit_depth=16)
    plain = shot([value] * 3, encoding="linear", bit_depth=16)
    assert np.abs(scaled.astype(int) - plain).max() <= 1


@pytest.mark.parametrize(("colour", "weight"), [((1, 0, 0), 0.2126), ((0, 1, 0), 0.7152), ((0, 0, 1), 0.0722)])
def test_mono_weighs_colours_by_luminance(colour, weight) -> None:
    assert shot(colour, encoding="linear")[2, 1] == round(weight * 255)


@pytest.mark.parametrize("encoding", ["linear", "srgb"])
def test_grey_is_the_same_in_mono_and_rgb(encoding) -> None:
    mono, rgb = (shot([0.3] * 3, channels=channels, encoding=encoding) for channels in ("mono", "rgb"))
    np.testing.assert_array_equal(np.repeat(mono[..., None], 3, -1), rgb)


@pytest.mark.parametrize(("channels", "shape"), [("mono", SHAPE), ("rgb", (*SHAPE, 3))])
@pytest.mark.parametrize(("bits", "kind"), [(8, np.uint8), (16, np.uint16)])
def test_the_frame_is_black_around_the_region(channels, shape, bits, kind) -> None:
    image = shot([1, 1, 1], channels=channels, bit_depth=bits)
    assert image.shape == shape
    assert image.dtype == kind
    inside = np.zeros(SHAPE, bool)
    inside[2:4, 1:4] = True
    assert (image[inside] == 2**bits - 1).all()
    assert not image[~inside].any()


def test_an_empty_region_is_a_black_frame() -> None:
    nothing = Region(x0=0, y0=0, x1=0, y1=0)
    image = develop(taken_by(Sensor()), Radiance.of(nothing, np.zeros((0, 0, 4), np.float32)), None, seed=0)
    assert image.shape == SHAPE
    assert not image.any()


@pytest.mark.parametrize("sensor", [{"bit_depth": 12}, {"channels": "bayer"}, {"encoding": "log"}])
def test_other_sensors_are_refused(sensor) -> None:
    with pytest.raises(UnsupportedError, match="the sensor has"):
        shot([1, 1, 1], **sensor)


@pytest.mark.parametrize("channels", ["mono", "rgb"])
@pytest.mark.parametrize("quality", [50, 75, 95])
def test_a_compressed_image_is_pillows_jpeg(channels, quality) -> None:
    """Two encoders of one standard: what they lose is alike, and far more than their rounding differs."""
    light = np.random.default_rng(0).random((40, 56, 3)).astype(np.float32)
    radiance = Radiance.of(Region(x0=0, y0=0, x1=56, y1=40), np.concatenate([light, light[..., :1] * 0 + 1], -1))
    camera = Camera(width=56, height=40, fx=9, fy=9, cx=28, cy=20)
    scene = scenes.scene(scenes.target(*scenes.box()), camera=camera, sensor=Sensor(channels=channels))
    plain = develop(scene, radiance, None, seed=0)
    file = BytesIO()
    Image.fromarray(plain).save(file, "jpeg", quality=quality, subsampling=0)
    expected = np.asarray(Image.open(file)).astype(int)
    found = develop(replace(scene, sensor=replace(scene.sensor, jpeg_quality=quality)), radiance, None, seed=0)
    assert np.abs(found - expected).max() <= 2 < np.abs(found.astype(int) - plain).max()
