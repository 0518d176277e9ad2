"""Adjustments and transfer curves by their definitions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spin_usd.errors import UnsupportedError
from spin_usd.scene.sensor import LUMINANCE, Sensor
from spin_usd.sensor.detector import detect
from spin_usd.sensor.tone import MID_GREY, adjusted, encode

COLOURS = np.random.default_rng(0).random((9, 7, 3))


def srgb_decoded(signal):
    """The inverse curve, as IEC 61966-2-1 gives it."""
    return signal / 12.92 if signal <= 0.04045 else ((signal + 0.055) / 1.055) ** 2.4


@given(st.floats(0, 1))
def test_srgb_is_undone_by_the_standards_inverse(linear) -> None:
    assert srgb_decoded(float(encode(np.array(linear), "srgb"))) == pytest.approx(linear, abs=2e-5)


@given(st.floats(0, 1), st.floats(0.5, 4))
def test_gamma_is_undone_by_its_power(linear, gamma) -> None:
    assert float(encode(np.array(linear), "gamma", gamma)) ** gamma == pytest.approx(linear, abs=1e-12)


def test_other_curves_are_refused() -> None:
    with pytest.raises(UnsupportedError, match="'log'"):
        encode(COLOURS, "log")


def test_no_adjustment_changes_no_bit() -> None:
    assert adjusted(COLOURS, Sensor(channels="rgb")).tobytes() == COLOURS.tobytes()


def test_contrast_stretches_stops_about_mid_grey() -> None:
    signal = MID_GREY * 2.0 ** np.arange(-4, 1)[:, None]
    found = adjusted(signal, Sensor(contrast=1.5))
    np.testing.assert_allclose(np.log2(found / MID_GREY), 1.5 * np.log2(signal / MID_GREY), atol=1e-12)
    assert adjusted(np.zeros((1, 1)), Sensor(contrast=0.5)) == 0


def test_saturation_is_the_distance_from_luminance() -> None:
    grey = adjusted(COLOURS, Sensor(channels="rgb", saturation=0.0))
    np.testing.assert_allclose(grey, np.repeat((COLOURS @ np.array(LUMINANCE))[..., None], 3, -1), atol=1e-12)
    half = adjusted(COLOURS, Sensor(channels="rgb", saturation=0.5))
    np.testing.assert_allclose(half, (grey + COLOURS) / 2, atol=1e-12)


def test_a_filter_multiplies() -> None:
    tinted = adjusted(COLOURS, Sensor(channels="rgb", filter=(0.5, 1.0, 0.25)))
    np.testing.assert_allclose(tinted, COLOURS * [0.5, 1, 0.25])
    grey = adjusted(COLOURS[..., :1], Sensor(filter=(0.5, 0.5, 0.5)))
    np.testing.assert_allclose(grey, COLOURS[..., :1] / 2)


@pytest.mark.parametrize("encoding", ["linear", "srgb", "gamma"])
@pytest.mark.parametrize("saturation", [1.0, 0.7])
def test_an_adc_without_noise_to_speak_of_gives_the_ideal_picture(encoding, saturation) -> None:
    """A million electrons a step and 16 bits: what remains is the ADC's rounding."""
    taste = {"contrast": 1.2, "filter": (1.0, 0.9, 0.8), "channels": "rgb", "saturation": saturation}
    light = (0.02 + 0.9 * COLOURS).astype(np.float32)
    ideal, real = (
        detect(light, Sensor(gain=gain, adc_bits=16, encoding=encoding, **taste), seed=0).astype(int)
        for gain in (0.0, 1e6)
    )
    assert np.abs(ideal - real).max() <= 1
    assert (ideal == real).mean() > 0.95
