"""Auto-exposure meters the target and nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.geometry.region import Region
from spin_usd.scene.passes import Radiance
from spin_usd.scene.sensor import AutoExposure, Sensor
from spin_usd.sensor.exposure import exposed, exposure_end, metered

RULE = AutoExposure(level=0.4, stops=(-10, 10))


def radiance(values, alpha):
    """Premultiplied radiance of one row of pixels: grey `values` where covered, by the shares `alpha`."""
    rgba = np.repeat((np.array(values) * alpha)[None, :, None], 4, -1).astype(np.float32)
    rgba[..., 3] = alpha
    return Radiance.of(Region(x0=3, y0=5, x1=3 + len(values), y1=6), rgba)


def test_the_targets_mean_comes_to_the_level() -> None:
    light = radiance([10, 30, 50, 0], np.array([1, 1, 0.5, 0]))
    mean = (10 + 30 + 0.5 * 50) / 2.5
    sensor = Sensor(exposure=0.02, auto_exposure=RULE)
    assert metered(sensor, light) * 0.02 * mean == pytest.approx(0.4, rel=1e-6)


def test_what_is_not_covered_does_not_count() -> None:
    few, many = (radiance([8] * 3 + [0] * n, np.array([1.0] * 3 + [0.0] * n)) for n in (1, 500))
    sensor = Sensor(auto_exposure=RULE)
    assert metered(sensor, few) == metered(sensor, many)


def test_the_factor_is_held_to_its_stops() -> None:
    sensor = Sensor(auto_exposure=replace(RULE, stops=(-2, 3)))
    assert metered(sensor, radiance([1e-6], np.array([1]))) == 8
    assert metered(sensor, radiance([1e6], np.array([1]))) == 0.25
    assert metered(sensor, radiance([0], np.array([1]))) == 8


def test_no_target_or_no_rule_is_no_change() -> None:
    assert metered(Sensor(auto_exposure=RULE), radiance([0], np.array([0]))) == 1
    sensor = Sensor(exposure=3.0)
    assert exposed(sensor, radiance([5], np.array([1]))) == sensor


def test_the_factor_is_one_of_time() -> None:
    """So that dark current grows with it."""
    sensor = Sensor(exposure=1.0, time=0.01, auto_exposure=RULE)
    found = exposed(sensor, radiance([0.1], np.array([1])))
    assert (found.exposure, found.time) == pytest.approx((4, 0.04))


def test_it_weighs_colours_as_the_detector_does() -> None:
    red = radiance([10], np.array([1]))
    red.rgba[..., 1:3] = 0
    sensor = Sensor(auto_exposure=RULE, quantum_efficiency=(0.5, 1, 1), panchromatic=(0.6, 0.3, 0.1))
    assert metered(sensor, red) * 10 * 0.5 * 0.6 == pytest.approx(0.4)


def test_the_end_that_it_stops_at_more_than_a_stop_short_is_told() -> None:
    sensor = Sensor(auto_exposure=replace(RULE, stops=(-2, 3)))
    ends = {
        value: exposure_end(sensor, radiance([value], np.array([1])))
        for value in (1e6, 3.3, 3.1, 0.4, 0.026, 0.024, 1e-6, 0)
    }
    assert list(ends.values()) == ["shortest"] * 2 + [None] * 3 + ["longest"] * 3
    assert exposure_end(Sensor(), radiance([0], np.array([1]))) is None
    assert exposure_end(sensor, radiance([0], np.array([0]))) is None
