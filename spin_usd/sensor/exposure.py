"""Auto-exposure: the exposure time that brings the target, and nothing else, to its wanted level."""

from dataclasses import replace

import numpy as np

from spin_usd.scene.passes import Radiance
from spin_usd.scene.sensor import Sensor

STOP = 2.0  # times as much light
SHORTEST, LONGEST = "shortest", "longest"


def metered(sensor: Sensor, radiance: Radiance) -> float:
    """Return the factor on the exposure time that metering on the target chooses; 1 without auto-exposure or target."""
    wanted, (low, high) = _wanted(sensor, radiance), _limits(sensor)
    return 1.0 if wanted is None else float(np.clip(wanted, low, high))


def exposure_end(sensor: Sensor, radiance: Radiance) -> str | None:
    """Return the end of its range, "shortest" or "longest", at which auto-exposure stopped more than a stop short of
    its level; None where it did not stop at one."""
    wanted, (low, high) = _wanted(sensor, radiance), _limits(sensor)
    if wanted is None or low / STOP <= wanted <= high * STOP:
        return None
    return LONGEST if wanted > high else SHORTEST


def exposed(sensor: Sensor, radiance: Radiance) -> Sensor:
    """`sensor` with the exposure time that metering chose."""
    factor = metered(sensor, radiance)
    return replace(sensor, exposure=sensor.exposure * factor, time=sensor.time * factor)


def _limits(sensor: Sensor) -> tuple[float, float]:
    """Return the limits of the factor on the exposure time."""
    if sensor.auto_exposure is None:
        return 1.0, 1.0
    low, high = sensor.auto_exposure.stops
    return 2.0**low, 2.0**high


def _wanted(sensor: Sensor, radiance: Radiance) -> float | None:
    """Return the factor that would bring the target to its level, whatever the limits; None without auto-exposure or
    target.

    The meter averages the target's radiance over the pixels that it covers, weighted as by a panchromatic detector.
    """
    rule = sensor.auto_exposure
    if rule is None or not (covered := float(radiance.rgba[..., 3].sum(dtype=np.float64))):
        return None
    weights = np.array(sensor.quantum_efficiency) * np.array(sensor.panchromatic)
    light = radiance.rgb.sum((0, 1), dtype=np.float64) @ weights
    mean = sensor.exposure * float(light) / covered
    return rule.level / mean if mean > 0 else np.inf
