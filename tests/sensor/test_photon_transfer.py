"""What was authored of a detector comes back from flat fields by photon transfer."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.geometry.camera import Camera
from spin_usd.geometry.region import Region
from spin_usd.scene.passes import Radiance
from spin_usd.scene.sensor import Sensor
from spin_usd.sensor.develop import develop
from tests.authorities import photon_transfer
from tests.cases import scenes

RECOVERED = 0.02  # what the project promises
SIDE = 300
SENSORS = {
    "12 bits": Sensor(gain=4.0, read_noise=12.0, full_well=14_000, prnu=0.02, adc_bits=12, black_level=64),
    "10 bits, ISO 400": Sensor(gain=20.0, iso=400, read_noise=9.0, full_well=4_500, adc_bits=10, black_level=40),
    "16 bits, dark": Sensor(gain=0.8, read_noise=3.0, full_well=45_000, dark_current=500, adc_bits=16, black_level=500),
}


def flat(sensor, level, seed):
    """A picture of even light at `level` of full scale."""
    camera = Camera(width=SIDE, height=SIDE, fx=300, fy=300, cx=150, cy=150)
    scene = scenes.scene(scenes.target(*scenes.box()), camera=camera, sensor=sensor)
    rgba = np.full((SIDE, SIDE, 4), level, np.float32)
    rgba[..., 3] = 1
    return develop(scene, Radiance.of(Region.full(SIDE, SIDE), rgba), None, seed=seed)


def recovered(sensor):
    electrons = (2**sensor.adc_bits - 1) * sensor.gain * 100 / sensor.iso  # of full scale
    levels = np.linspace(0.05, 0.8, 12) * sensor.full_well / electrons
    dark = [flat(replace(sensor, time=0.0), 0.0, seed) for seed in (100, 101)]
    pairs = [[flat(sensor, level, 2 * i + j) for j in (0, 1)] for i, level in enumerate(levels)]
    return photon_transfer.characterise(dark, pairs, flat(sensor, 2 * sensor.full_well / electrons, 102))


@pytest.mark.parametrize("name", SENSORS)
def test_a_detector_is_recovered_from_its_flat_fields(name) -> None:
    sensor = replace(SENSORS[name], encoding="linear", bit_depth=16)
    found = recovered(sensor)
    assert found.gain == pytest.approx(sensor.gain * 100 / sensor.iso, rel=RECOVERED)
    assert found.read_noise == pytest.approx(sensor.read_noise, rel=RECOVERED)
    assert found.full_well == pytest.approx(sensor.full_well, rel=RECOVERED)
    assert found.bits == pytest.approx(sensor.adc_bits, abs=0.01)
    assert found.black_level == pytest.approx(sensor.black_level, rel=RECOVERED)
    assert found.prnu == pytest.approx(sensor.prnu, rel=RECOVERED, abs=1e-3)


def test_dark_current_fills_the_well_with_time() -> None:
    sensor = Sensor(gain=1.0, dark_current=4000, adc_bits=16, encoding="linear", bit_depth=16)
    for time in (0.01, 0.1, 1.0):
        image = flat(replace(sensor, time=time), 0.0, 0).astype(np.float64)
        assert image.mean() == pytest.approx(4000 * time, rel=RECOVERED)
        assert image.var() == pytest.approx(4000 * time + photon_transfer.ADC_ROUNDING, rel=RECOVERED)


def test_quantum_efficiency_makes_fewer_electrons() -> None:
    """Half the light, half the signal, half the variance: the noise of what is detected, not of what arrives."""
    whole, half = (
        flat(Sensor(gain=1.0, adc_bits=16, encoding="linear", bit_depth=16, quantum_efficiency=(q, q, q)), 0.3, 0)
        for q in (1.0, 0.5)
    )
    assert half.mean() == pytest.approx(whole.mean() / 2, rel=RECOVERED)
    assert half.astype(float).var() == pytest.approx(whole.astype(float).var() / 2, rel=RECOVERED)


def test_the_same_seed_is_the_same_picture_and_no_other() -> None:
    sensor = SENSORS["12 bits"]
    assert flat(sensor, 0.2, 5).tobytes() == flat(sensor, 0.2, 5).tobytes()
    assert (flat(sensor, 0.2, 5) != flat(sensor, 0.2, 6)).mean() > 0.5


def test_what_was_made_before_changes_nothing() -> None:
    sensor = SENSORS["12 bits"]
    alone = flat(sensor, 0.2, 5).tobytes()
    flat(replace(sensor, pattern_seed=9), 0.7, 8)
    assert flat(sensor, 0.2, 5).tobytes() == alone


@pytest.mark.parametrize("light", [1e4, 1e20, float("inf")])
def test_a_glint_of_any_strength_saturates(light) -> None:
    for sensor in (Sensor(gain=0.01, read_noise=5, adc_bits=8), SENSORS["16 bits, dark"], SENSORS["12 bits"]):
        image = flat(replace(sensor, full_well=0.0), light, 1)
        assert (image == 255).all()
