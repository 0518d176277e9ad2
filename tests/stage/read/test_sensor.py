"""The sensor as USD says it: each attribute reaches its field, each bad number is refused by name."""

from functools import partial

import pytest
from pxr import Usd

from spin_usd.errors import StageError
from spin_usd.scene.content import content
from spin_usd.scene.sensor import AutoExposure, Sensor
from spin_usd.stage.read.sensor import read_sensor
from spin_usd.stage.usd import schema

EXPOSURE = """
    float exposure = 1
    float exposure:time = 0.5
    float exposure:iso = 200
    float exposure:fStop = 2
    float exposure:responsivity = 3
"""
TEXTS = {
    "channels": ("token", '"rgb"', "rgb"),
    "quantum_efficiency": ("double3", "(0.5, 0.6, 0.7)", (0.5, 0.6, 0.7)),
    "panchromatic": ("double3", "(0.1, 0.2, 0.3)", (0.1, 0.2, 0.3)),
    "gain": ("double", "4.25", 4.25),
    "full_well": ("double", "14000", 14000),
    "read_noise": ("double", "2.5", 2.5),
    "dark_current": ("double", "30", 30),
    "prnu": ("double", "0.01", 0.01),
    "pattern_seed": ("int64", "17", 17),
    "adc_bits": ("int", "10", 10),
    "black_level": ("double", "60", 60),
    "contrast": ("double", "0.9", 0.9),
    "saturation": ("double", "0.4", 0.4),
    "filter": ("color3d", "(1, 0.5, 0.25)", (1, 0.5, 0.25)),
    "encoding": ("token", '"gamma"', "gamma"),
    "gamma": ("double", "1.8", 1.8),
    "bit_depth": ("int", "16", 16),
}


@pytest.fixture
def camera(open_camera):
    return partial(open_camera, api="SpinSensorAPI")


def sensor_of(prim):
    return read_sensor(prim, Usd.TimeCode(0))


def authored(**texts):
    return "\n".join(f"{TEXTS[field][0]} {schema.SENSOR[field]} = {text}" for field, text in texts.items())


def test_every_attribute_reaches_its_field(camera) -> None:
    found = sensor_of(camera(authored(**{field: text for field, (_, text, _) in TEXTS.items()}) + EXPOSURE))
    assert {field: getattr(found, field) for field in TEXTS} == {field: value for field, (*_, value) in TEXTS.items()}
    assert (found.time, found.iso) == (0.5, 200)
    assert found.exposure == pytest.approx(2**1 * 0.5 * (200 / 100) / 2**2 * 3)


def test_the_schemas_fallbacks_are_the_words_defaults(camera) -> None:
    plain = sensor_of(camera("", applied=False))
    assert sensor_of(camera("")) == plain == Sensor(exposure=plain.exposure, time=plain.time, iso=plain.iso)


def test_auto_exposure(camera) -> None:
    text = "double spin:sensor:autoExposure:level = 0.3\ndouble2 spin:sensor:autoExposure:stops = (-2, 1)"
    assert sensor_of(camera(text)).auto_exposure is None
    found = sensor_of(camera(f"{text}\nbool spin:sensor:autoExposure = 1"))
    assert found.auto_exposure == AutoExposure(level=0.3, stops=(-2, 1))


BAD = [
    ({"bit_depth": "12"}, "bitDepth: is 12; choose one of"),
    ({"channels": '"bayer"'}, "channels: is 'bayer'; choose one of"),
    ({"encoding": '"log"'}, "encoding: is 'log'; choose one of"),
    ({"read_noise": "-1", "gain": "1"}, "readNoise: is -1.0; choose numbers from 0 to 1e+06"),
    ({"read_noise": "nan", "gain": "1"}, "readNoise: is nan; choose"),
    ({"full_well": "inf", "gain": "1"}, "fullWell: is inf; choose"),
    ({"gain": "-2"}, "gain: is -2.0; choose"),
    ({"adc_bits": "0", "gain": "1"}, "adcBits: is 0; choose numbers from 1 to 16"),
    ({"adc_bits": "17", "gain": "1"}, "adcBits: is 17; choose"),
    ({"prnu": "1.5", "gain": "1"}, "prnu: is 1.5; choose numbers from 0 to 1"),
    ({"quantum_efficiency": "(1, 1.1, 1)"}, "quantumEfficiency: is (1, 1.1, 1); choose"),
    ({"panchromatic": "(0, 0, 0)"}, "panchromatic: leaves no light"),
    ({"gamma": "0", "encoding": '"gamma"'}, "gamma: is 0.0; choose numbers from 0.1 to 10"),
    ({"contrast": "0"}, "contrast: is 0.0; choose"),
    ({"gain": "1e-300"}, "gain: is 1e-300; choose 0, or numbers from 1e-06 to 1e+06"),
    ({"full_well": "1e-30", "gain": "1"}, "fullWell: is 1e-30; choose 0, or numbers from 1 to 1e+09"),
    ({"read_noise": "1e30", "gain": "1"}, "readNoise: is 1e+30; choose"),
    ({"dark_current": "1e30", "gain": "1"}, "darkCurrent: is 1e+30; choose"),
    ({"panchromatic": "(1e-300, 0, 0)"}, "panchromatic: leaves no light"),
    ({"panchromatic": "(1e30, 0, 0)"}, "panchromatic: is (1e30, 0, 0); choose"),
    ({"contrast": "1e9"}, "contrast: is 1000000000.0; choose numbers from 0.01 to 100"),
    ({"saturation": "1e30"}, "saturation: is 1e+30; choose"),
    ({"filter": "(1e30, 1e30, 1e30)"}, "filter: is (1e30, 1e30, 1e30); choose"),
    ({"gamma": "1e9", "encoding": '"gamma"'}, "gamma: is 1000000000.0; choose"),
    ({"pattern_seed": "-1"}, "patternSeed: is -1; choose"),
    ({"gain": "1", "black_level": "5000"}, "blackLevel: is 5000; choose less than the 12 bits"),
    ({"filter": "(1, 1, 0.5)"}, "filter: tints a mono sensor"),
    *[({field: TEXTS[field][1]}, f"{schema.SENSOR[field][12:]}: is {TEXTS[field][1]}, but the sensor has no gain")
      for field in ("read_noise", "full_well", "dark_current", "prnu", "black_level", "adc_bits")],
]  # fmt: skip


@pytest.mark.parametrize(("texts", "saying"), BAD, ids=[saying.split(";")[0] for _, saying in BAD])
def test_a_sensor_that_is_none_is_refused_by_name(camera, texts, saying) -> None:
    prim = camera(authored(**texts))
    with pytest.raises(StageError) as refusal:
        sensor_of(prim)
    assert str(refusal.value).startswith("/World/Camera.spin:sensor:")
    assert saying in str(refusal.value)


@pytest.mark.parametrize(
    ("text", "saying"),
    [
        ("double2 spin:sensor:autoExposure:stops = (2, -2)", "stops: is (2, -2); give the lesser first"),
        ("double spin:sensor:autoExposure:level = 0", "level: is 0.0; choose numbers from 1e-06 to 10"),
        ("double2 spin:sensor:autoExposure:stops = (-1e9, 1)", "choose numbers from -100 to 100"),
        ("float exposure = 120", "its exposure scale is 1.3"),
        ("float exposure:responsivity = 0", "its exposure scale is 0"),
        ('string spin:sensor:gain = "many"', "gain: is 'many'; make it a double"),
        ("double[] spin:sensor:filter = [1]", "filter: is Vt.DoubleArray(1, (1,)); make it a color3d"),
    ],
)
def test_what_is_no_number_or_no_exposure_is_refused(camera, text, saying) -> None:
    with pytest.raises(StageError) as refusal:
        sensor_of(camera(text))
    assert saying in str(refusal.value)


def test_attributes_without_their_api_are_not_ignored(camera) -> None:
    with pytest.raises(StageError, match="SpinSensorAPI is not applied"):
        sensor_of(camera(authored(gain="2"), applied=False))


def test_a_jpeg_has_8_bits(camera) -> None:
    quality = f"int {schema.SENSOR['jpeg_quality']} = 75\n"
    assert sensor_of(camera(quality)).jpeg_quality == 75
    with pytest.raises(StageError, match=r"jpegQuality: is 75, but the image has 16 bits"):
        sensor_of(camera(quality + authored(bit_depth="16")))


def test_a_field_that_came_later_counts_in_keys_once_it_is_used() -> None:
    assert "jpeg_quality" not in content(Sensor())
    assert content(Sensor(jpeg_quality=75))["jpeg_quality"] == 75
