"""How bright the target is in an image, by its own pixels."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.geometry.region import Region
from spin_usd.picture.make_picture import Tones, target_tones
from spin_usd.scene.passes import Radiance
from spin_usd.scene.sensor import Sensor
from spin_usd.sensor.detector import detect

AT = Region(x0=2, y0=1, x1=6, y1=2)
LINEAR = Sensor(encoding="linear", bit_depth=16)


def seen(coverage=(1, 1, 1, 1)):
    """A target over the four pixels of AT, covered so far."""
    return Radiance.of(AT, np.array([[[0, 0, 0, share] for share in coverage]], np.float32))


def image(numbers, sensor=LINEAR):
    whole = np.full((3, 9, *np.shape(numbers)[1:]), 2**sensor.bit_depth - 1, f"uint{sensor.bit_depth}")
    whole[AT.slices] = numbers
    return whole


def test_only_what_the_target_covers_counts() -> None:
    found = target_tones(image([0, 6553, 65535, 65535]), seen((1, 0.5, 0.49, 1)), LINEAR)
    assert found == Tones(pixels=3, mean=pytest.approx(1.1 / 3, rel=1e-4), dark=1 / 3, saturated=1 / 3)


def test_no_target_has_no_tones() -> None:
    assert target_tones(image([0, 0, 0, 0]), seen((0, 0, 0, 0)), LINEAR) is None


def test_of_colours_the_brightest_shows_and_the_darkest_saturates() -> None:
    colours = [[0, 0, 60], [255, 255, 255], [255, 255, 254], [0, 0, 0]]
    sensor = Sensor(channels="rgb")
    found = target_tones(image(colours, sensor), seen(), sensor)
    assert (found.dark, found.saturated) == (0.25, 0.25)


@pytest.mark.parametrize("curve", [{"encoding": "linear"}, {"encoding": "srgb"}, {"encoding": "gamma", "gamma": 1.8}])
@pytest.mark.parametrize("noise", [{}, {"gain": 100.0, "black_level": 200.0}])
def test_dark_is_six_stops_below_full_scale_whatever_the_curve(curve, noise) -> None:
    sensor = replace(LINEAR, **curve, **noise)
    share = 1 - sensor.black_level / 4095 if sensor.gain else 1
    light = np.zeros((3, 9, 1), np.float32)
    light[AT.slices] = np.array([0, 2.0**-6.3, 2.0**-5.7, 2])[:, None] * share
    assert target_tones(detect(light, sensor, seed=0), seen(), sensor).dark == 0.5


def test_noise_does_not_pass_for_light() -> None:
    """Exposed for so long that its dark current alone is far above six stops below full scale, and its noise too."""
    sensor = replace(LINEAR, time=100.0, dark_current=90.0, gain=10.0, read_noise=1500.0)
    region = Region(x0=0, y0=0, x1=100, y1=50)
    target = Radiance.of(region, np.ones((50, 100, 4), np.float32))
    dark = detect(np.zeros((50, 100, 1), np.float32), sensor, seed=1)
    assert dark.mean() > 65535 / 2**6
    assert target_tones(dark, target, sensor).dark > 0.99


WELLS = {"gain": 10.0, "read_noise": 60.0, "full_well": 30_000.0}  # full at 73 % of the ADC's range


@pytest.mark.parametrize("detector", [{}, {"gain": 10.0}, WELLS])
@pytest.mark.parametrize("taste", [{}, {"contrast": 0.91}, {"contrast": 0.8, "filter": (0.5, 0.4, 0.0)}])
@pytest.mark.parametrize("channels", ["mono", "rgb"])
def test_what_fills_the_detector_is_saturated_and_what_its_noise_hides_dark(detector, taste, channels) -> None:
    """Whatever contrast and filter make of it."""
    sensor = Sensor(channels=channels, **detector, **taste)
    region = Region(x0=0, y0=0, x1=100, y1=50)
    light = np.full((50, 100, 3), 0.5, np.float32)
    light[:, :20], light[:, 20:50] = 5.0, 0.01
    found = target_tones(
        detect(light[..., :1] if channels == "mono" else light, sensor, seed=1),
        Radiance.of(region, np.ones((50, 100, 4), np.float32)),
        sensor,
    )
    assert (found.saturated, found.dark) == (pytest.approx(0.2, abs=0.001), pytest.approx(0.3, abs=0.001))
