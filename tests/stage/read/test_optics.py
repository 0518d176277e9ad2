"""The optics as USD says it."""

from functools import partial

import pytest
from pxr import Usd

from spin_usd.errors import StageError
from spin_usd.scene.sensor import Optics
from spin_usd.stage.read.camera import read_camera
from spin_usd.stage.read.optics import read_optics
from spin_usd.stage.usd import schema

TEXTS = {
    "psf_sigma": ("double", "0.8", 0.8),
    "glare": ("double", "0.03", 0.03),
    "glare_core": ("double", "6", 6),
    "glare_falloff": ("double", "2.5", 2.5),
    "bloom_intensity": ("double", "0.5", 0.5),
    "bloom_scatter": ("double", "0.9", 0.9),
    "bloom_threshold": ("double", "1.5", 1.5),
    "cos_fourth": ("bool", "1", True),
    "vignetting": ("double3", "(-0.1, -0.2, 0.05)", (-0.1, -0.2, 0.05)),
}


@pytest.fixture
def camera(open_camera):
    return partial(open_camera, api="SpinOpticsAPI")


def optics_of(prim):
    return read_optics(prim, read_camera(prim, Usd.TimeCode(0)), Usd.TimeCode(0))


def authored(**texts):
    return "\n".join(f"{TEXTS[field][0]} {schema.OPTICS[field]} = {text}" for field, text in texts.items())


def test_every_attribute_reaches_its_field(camera) -> None:
    found = optics_of(camera(authored(**{field: text for field, (_, text, _) in TEXTS.items()})))
    assert found == Optics(**{field: value for field, (*_, value) in TEXTS.items()})


def test_the_schemas_fallbacks_are_the_words_defaults(camera) -> None:
    assert optics_of(camera("")) == Optics() == optics_of(camera("", applied=False))


@pytest.mark.parametrize(
    ("field", "text", "saying"),
    [
        ("psf_sigma", "-0.1", "psfSigma: is -0.1; choose numbers from 0 to 100"),
        ("glare", "1.2", "glare: is 1.2; choose numbers from 0 to 1"),
        ("glare_core", "0", "glareCore: is 0.0; choose numbers from 0.01 to 10000"),
        ("glare_falloff", "2", "glareFalloff: is 2.0; choose numbers above 2, to 100"),
        ("bloom_intensity", "-1", "bloomIntensity: is -1.0; choose"),
        ("bloom_scatter", "3", "bloomScatter: is 3.0; choose"),
        ("glare_core", "1e9", "glareCore: is 1000000000.0; choose"),
        ("glare_falloff", "1e9", "glareFalloff: is 1000000000.0; choose"),
        ("vignetting", "(1e300, 0, 0)", "vignetting: is (1e300, 0, 0); choose"),
        ("bloom_threshold", "1e30", "bloomThreshold: is 1e+30; choose"),
        ("bloom_threshold", "nan", "bloomThreshold: is nan; choose"),
        ("vignetting", "(-1.5, 0, 0)", "vignetting: makes light negative: its least gain is -0.5"),
        ("vignetting", "(nan, 0, 0)", "vignetting: is (nan, 0, 0); choose numbers from -100 to 100"),
    ],
)
def test_optics_that_are_none_are_refused_by_name(camera, field, text, saying) -> None:
    prim = camera(authored(**{field: text}))
    with pytest.raises(StageError) as refusal:
        optics_of(prim)
    assert f"/World/Camera.spin:optics:{saying}" in str(refusal.value)


def test_attributes_without_their_api_are_not_ignored(camera) -> None:
    with pytest.raises(StageError, match="SpinOpticsAPI is not applied"):
        optics_of(camera(authored(glare="0.1"), applied=False))
