"""An event camera's pixels as USD says them: each attribute reaches its field, each bad number is refused by name."""

from functools import partial

import pytest
from pxr import Usd

from spin_usd.errors import StageError
from spin_usd.scene.event_sensor import PRESETS, EventSensor
from spin_usd.stage.read.event_sensor import RANGES, read_event_sensor
from spin_usd.stage.usd import schema


@pytest.fixture
def camera(open_camera):
    return partial(open_camera, api="SpinEventSensorAPI")


def sensor_of(prim):
    return read_event_sensor(prim, Usd.TimeCode(0))


def authored(**values):
    return "\n".join(f"double {schema.EVENT_SENSOR[field]} = {value!r}" for field, value in values.items())


def test_every_attribute_reaches_its_field(camera) -> None:
    values = {field: 0.01 * (1 + place) for place, field in enumerate(RANGES)}
    assert sensor_of(camera(authored(**values))) == EventSensor(**values)


def test_the_schemas_fallbacks_are_the_ideal_sensor(camera) -> None:
    assert sensor_of(camera("")) == PRESETS["ideal"]


def test_a_camera_without_the_api_is_no_event_camera(camera) -> None:
    assert sensor_of(camera("", applied=False)) is None


@pytest.mark.parametrize("preset", PRESETS)
def test_presets_are_within_the_ranges(preset) -> None:
    assert all(own.low <= getattr(PRESETS[preset], field) <= own.high for field, own in RANGES.items())


@pytest.mark.parametrize(
    ("values", "saying"),
    [
        ({"threshold_on": 0.0}, "thresholdOn: is 0.0; choose numbers from 0.005 to 10"),
        ({"threshold_off": 11.0}, "thresholdOff: is 11.0; choose"),
        ({"threshold_spread": -0.1}, "thresholdSpread: is -0.1; choose numbers from 0 to 10"),
        ({"dark": 0.0}, "dark: is 0.0; choose numbers from 1e-09 to 1"),
        ({"cutoff": 1e7}, "cutoff: is 10000000.0; choose numbers from 0 to 1e+06"),
        ({"leak": -1.0}, "leak: is -1.0; choose"),
        ({"shot_noise": 1e30}, "shotNoise: is 1e+30; choose"),
        ({"shot_noise_in_white": 1.5}, "shotNoiseInWhite: is 1.5; choose numbers from 0 to 1"),
        ({"refractory": 2.0}, "refractory: is 2.0; choose"),
        ({"latency": -1e-6}, "latency: is -1e-06; choose"),
        ({"jitter": 1.1}, "jitter: is 1.1; choose"),
    ],
)
def test_a_sensor_that_is_none_is_refused_by_name(camera, values, saying) -> None:
    prim = camera(authored(**values))
    with pytest.raises(StageError) as refusal:
        sensor_of(prim)
    assert str(refusal.value).startswith("/World/Camera.spin:event:")
    assert saying in str(refusal.value)


def test_a_number_without_the_api_is_not_ignored(camera) -> None:
    prim = camera(authored(leak=0.1), applied=False)
    with pytest.raises(StageError, match="leak: is authored, but SpinEventSensorAPI is not applied"):
        sensor_of(prim)
