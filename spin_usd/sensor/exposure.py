"""Auto-exposure: the exposure time that brings the target, and nothing else, to its wanted level."""

from dataclasses import replace

import numpy as np

from spin_usd.scene.passes import Radiance
from spin_usd.scene.sensor import Sensor


def metered(sensor: Sensor, radiance: Radiance) -> float:
    """The factor on the exposure time that metering on the target chooses; 1 without auto-exposure or target.

    Metered is the target's radiance averaged over what it covers, weighed as a panchromatic detector would.
    """
    rule = sensor.auto_exposure
    covered = float(radiance.rgba[..., 3].sum(dtype=np.float64))
    if rule is None or covered == 0:
        return 1.0
    weights = np.array(sensor.quantum_efficiency) * np.array(sensor.panchromatic)
    light = radiance.rgb.sum((0, 1), dtype=np.float64) @ weights
    mean = sensor.exposure * float(light) / covered
    low, high = (2.0**stops for stops in rule.stops)
    return float(np.clip(rule.level / mean, low, high)) if mean > 0 else high


def exposed(sensor: Sensor, radiance: Radiance) -> Sensor:
    """`sensor` with the exposure time that metering chose."""
    factor = metered(sensor, radiance)
    return replace(sensor, exposure=sensor.exposure * factor, time=sensor.time * factor)
