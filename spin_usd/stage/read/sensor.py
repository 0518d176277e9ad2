"""The camera's sensor: USD's own exposure attributes, and SpinSensorAPI."""

from typing import Any

from pxr import Usd, UsdGeom

from spin_usd.errors import StageError
from spin_usd.scene.sensor import AutoExposure, Sensor
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import AT_LEAST_0, SHARE, Range, read, refuse_unapplied, typed_value, value_in

ONE_OF = {"channels": ("mono", "rgb"), "encoding": ("srgb", "linear", "gamma"), "bit_depth": (8, 16)}
RANGES = {
    "quantum_efficiency": SHARE,
    "panchromatic": Range(0, 1e6),
    "gain": Range(1e-6, 1e6, or_0=True),  # from electron multipliers to infrared arrays: 1e-3 to 1e5
    "full_well": Range(1, 1e9, or_0=True),  # from photon counters to infrared arrays
    "read_noise": Range(0, 1e6),
    "dark_current": Range(0, 1e12),  # of a warm infrared detector 1e10
    "prnu": SHARE,
    "pattern_seed": AT_LEAST_0,
    "adc_bits": Range(1, 16),
    "black_level": AT_LEAST_0,
    "contrast": Range(0.01, 100),  # beyond, all signals are one grey, or black and white
    "saturation": Range(0, 100),
    "filter": Range(0, 1e6),
    "gamma": Range(0.1, 10),
    "jpeg_quality": Range(1, 100, or_0=True),
}
EXPOSURES = Range(1e-20, 1e20)  # for any light from a star's to a laser's; their product is finite in float32
LEVELS = Range(1e-6, 10)  # of a unit range of 16 bits, and far over-exposed
STOPS = Range(-100, 100)
MIN_WEIGHT = 1e-6  # of all colours together
ELECTRON_FIELDS = ("full_well", "read_noise", "dark_current", "prnu", "adc_bits", "black_level")
"""Fields that have no meaning without a gain."""


def read_sensor(prim: Usd.Prim, time: Usd.TimeCode) -> Sensor:
    """Read the sensor of the camera `prim`. Raises StageError that names the attribute that is wrong."""
    camera = UsdGeom.Camera(prim)
    exposure = float(camera.ComputeLinearExposureScale(time))
    if exposure not in EXPOSURES:
        do = f"choose exposure attributes whose product is of {EXPOSURES}"
        raise StageError(f"its exposure scale is {exposure:g}", where=prim.GetPath(), do=do)
    exposing: dict[str, Any] = {
        "exposure": exposure,
        "time": float(read(camera.GetExposureTimeAttr(), time)),
        "iso": float(read(camera.GetExposureIsoAttr(), time)),
    }
    if not prim.HasAPI(schema.SENSOR_API):
        refuse_unapplied(prim, "spin:sensor:", schema.SENSOR_API)
        return Sensor(**exposing)
    chosen = {field: _one_of(prim, schema.SENSOR[field], allowed, time) for field, allowed in ONE_OF.items()}
    numbers = {field: value_in(prim, schema.SENSOR[field], allowed, time) for field, allowed in RANGES.items()}
    sensor = Sensor(auto_exposure=_auto_exposure(prim, time), **exposing, **chosen, **numbers)
    _check_combination(prim, sensor)
    return sensor


def _one_of(prim: Usd.Prim, name: str, allowed: tuple[Any, ...], time: Usd.TimeCode) -> Any:
    value = typed_value(prim, name, time)
    if value not in allowed:
        raise StageError(f"is {value!r}", where=f"{prim.GetPath()}.{name}", do=f"choose one of {allowed}")
    return value


def _auto_exposure(prim: Usd.Prim, time: Usd.TimeCode) -> AutoExposure | None:
    level = value_in(prim, schema.AUTO_EXPOSURE_LEVEL, LEVELS, time)
    low, high = value_in(prim, schema.AUTO_EXPOSURE_STOPS, STOPS, time)
    if low > high:
        where = f"{prim.GetPath()}.{schema.AUTO_EXPOSURE_STOPS}"
        raise StageError(f"is ({low:g}, {high:g})", where=where, do="give the lesser first")
    return AutoExposure(level=level, stops=(low, high)) if typed_value(prim, schema.AUTO_EXPOSURE, time) else None


def _check_combination(prim: Usd.Prim, sensor: Sensor) -> None:
    """Raise StageError for values that are allowed alone, but not together."""
    if sensor.gain == 0:
        for field in ELECTRON_FIELDS:
            if getattr(sensor, field) != getattr(Sensor(), field):
                found = f"is {getattr(sensor, field):g}, but the sensor has no gain"
                raise StageError(
                    found, where=_where(prim, field), do=f"author {schema.SENSOR['gain']}, or leave it out"
                )
    if sensor.black_level >= 2**sensor.adc_bits - 1:
        do = f"choose less than the {sensor.adc_bits} bits of the ADC hold"
        raise StageError(f"is {sensor.black_level:g}", where=_where(prim, "black_level"), do=do)
    if sensor.jpeg_quality and sensor.bit_depth != 8:
        found = f"is {sensor.jpeg_quality}, but the image has {sensor.bit_depth} bits"
        raise StageError(
            found, where=_where(prim, "jpeg_quality"), do=f"make {schema.SENSOR['bit_depth']} 8, or leave it out"
        )
    if sum(w * q for w, q in zip(sensor.panchromatic, sensor.quantum_efficiency, strict=True)) < MIN_WEIGHT:
        raise StageError("leaves no light", where=_where(prim, "panchromatic"), do="give some colour a weight")
    if sensor.channels == "mono" and len(set(sensor.filter)) > 1:
        do = "make its three numbers equal, or the channels rgb"
        raise StageError("tints a mono sensor", where=_where(prim, "filter"), do=do)


def _where(prim: Usd.Prim, field: str) -> str:
    return f"{prim.GetPath()}.{schema.SENSOR[field]}"
