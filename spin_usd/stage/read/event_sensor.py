"""The pixels of an event camera: SpinEventSensorAPI on the camera."""

from pxr import Usd

from spin_usd.scene.event_sensor import EventSensor
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import SHARE, Range, refuse_unapplied, value_in

THRESHOLDS, SECONDS = Range(0.005, 10), Range(0, 1)
CUTOFFS, NOISES = Range(0, 1e6), Range(0, 1e4)  # Hz
RANGES = {
    "threshold_on": THRESHOLDS,
    "threshold_off": THRESHOLDS,
    "threshold_spread": Range(0, 10),
    "dark": Range(1e-9, 1),  # below, the logarithm of a render's dark pixels would be rounding noise
    "cutoff": CUTOFFS,
    "leak": NOISES,
    "shot_noise": NOISES,
    "shot_noise_in_white": SHARE,
    "refractory": SECONDS,
    "latency": SECONDS,
    "jitter": SECONDS,
}


def read_event_sensor(prim: Usd.Prim, time: Usd.TimeCode) -> EventSensor | None:
    """Read the pixels of the camera `prim`; None if it is not an event camera. Raises StageError that names the wrong
    attribute."""
    if not prim.HasAPI(schema.EVENT_SENSOR_API):
        refuse_unapplied(prim, "spin:event:", schema.EVENT_SENSOR_API)
        return None
    return EventSensor(**{field: value_in(prim, schema.EVENT_SENSOR[field], RANGES[field], time) for field in RANGES})
