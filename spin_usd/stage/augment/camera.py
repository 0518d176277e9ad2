"""Parameters of the camera: exposure, optics, detector, focus, lens.

Of several cameras all take the same values.
"""

from dataclasses import replace
from typing import Any

from pxr import Usd

from spin_usd.errors import GeometryError, InputError
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.fisheye import Fisheye
from spin_usd.stage.augment.attribute_change import (
    AttributeChange,
    BaseStage,
    ChangedAttribute,
    ParameterValues,
    attribute_of,
    fallback_of,
    in_schema,
)
from spin_usd.stage.augment.parameter import Maker
from spin_usd.stage.read.camera import find_cameras
from spin_usd.stage.read.lens import derived_values, lens_model, lens_numbers, read_lens
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import read

EXPOSURE = {
    "exposure.time": "exposure:time",
    "exposure.iso": "exposure:iso",
    "exposure.responsivity": "exposure:responsivity",
}
"""The attributes of USD's camera that take the sampled value, by parameter."""
LENS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")


def of_each_camera(make: Maker) -> Maker:
    """Return a function that changes all cameras of a stage, from one that changes `base.camera`."""

    def of_all(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
        cameras = find_cameras(base.stage).values()
        made = [make(replace(base, chosen_camera=prim), names) for prim in cameras]
        return AttributeChange(
            parameters=names,
            attributes=tuple(each for change in made for each in change.attributes),
            values=lambda sampled, time: tuple(each for change in made for each in change.values(sampled, time)),
            varies=any(change.varies for change in made),
            apis=tuple(each for change in made for each in change.apis),
        )

    return of_all


@of_each_camera
def exposure(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    (name,) = names
    at = attribute_of(base.camera.GetAttribute(EXPOSURE[name]))
    return AttributeChange(parameters=names, attributes=(at,), values=lambda sampled, _: (float(sampled[name]),))


@of_each_camera
def exposure_stops(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    """Add stops to the camera's own `exposure`."""
    attribute = base.camera.GetAttribute("exposure")
    varies, own = attribute.ValueMightBeTimeVarying(), float(read(attribute, base.first))

    def values(sampled: ParameterValues, time: float) -> tuple[float]:
        stops = float(read(attribute, Usd.TimeCode(time))) if varies else own
        return (stops + float(sampled["exposure.stops"]),)

    return AttributeChange(parameters=names, attributes=(attribute_of(attribute),), values=values, varies=varies)


def of_schema(base: BaseStage, names: tuple[str, ...], api: str, attribute: str) -> AttributeChange:
    """Set an attribute of one of our schemas, and apply the schema where it is not applied yet."""
    (name,) = names
    path, kind = str(base.camera.GetPath()), in_schema(api, attribute)
    whole = kind in ("int", "int64")
    return AttributeChange(
        parameters=names,
        attributes=(ChangedAttribute(prim=path, name=attribute, type=kind),),
        values=lambda sampled, _: (_number(sampled[name], whole, name),),
        apis=_missing(base, api),
    )


@of_each_camera
def optics(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    return of_schema(base, names, schema.OPTICS_API, schema.OPTICS[names[0].removeprefix("optics.")])


@of_each_camera
def vignetting(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    """Set the first of the three coefficients; the others stay."""
    camera, name = base.camera, schema.OPTICS["vignetting"]
    attribute = camera.GetAttribute(name)
    own = read(attribute, base.first) if attribute else fallback_of(schema.OPTICS_API, name)
    return AttributeChange(
        parameters=names,
        attributes=(ChangedAttribute(prim=str(camera.GetPath()), name=name, type=in_schema(schema.OPTICS_API, name)),),
        values=lambda sampled, _: (type(own)(float(sampled["optics.vignetting"]), own[1], own[2]),),
        apis=_missing(base, schema.OPTICS_API),
    )


@of_each_camera
def sensor(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    return of_schema(base, names, schema.SENSOR_API, schema.SENSOR[names[0].removeprefix("sensor.")])


@of_each_camera
def event_sensor(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    return of_schema(base, names, schema.EVENT_SENSOR_API, schema.EVENT_SENSOR[names[0].removeprefix("event.")])


@of_each_camera
def metering(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    return of_schema(base, names, schema.SENSOR_API, schema.AUTO_EXPOSURE_LEVEL)


def _missing(base: BaseStage, api: str) -> tuple[tuple[str, str], ...]:
    camera = base.camera
    return () if camera.HasAPI(api) else ((str(camera.GetPath()), api),)


def _number(value: Any, whole: bool, name: str) -> float | int:
    if not whole:
        return float(value)
    if value != int(value):
        raise InputError(f"is {value:g}, not a whole number", where=name, do="sample it with choice")
    return int(value)


@of_each_camera
def focus(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    """Set the distance in metres, or the aperture's f-number."""
    (name,) = names
    attribute = {"focus.distance": "focusDistance", "focus.fstop": "fStop"}[name]
    unit = base.metres if name == "focus.distance" else 1.0
    at = attribute_of(base.camera.GetAttribute(attribute))
    return AttributeChange(parameters=names, attributes=(at,), values=lambda sampled, _: (float(sampled[name]) / unit,))


@of_each_camera
def lens(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    """Add errors of the calibration to the lens's numbers; derived attributes follow."""
    prim = base.camera
    if not prim.HasAPI(schema.LENS_API):
        found = f"has no {schema.LENS_API}, so {names[0]} has nothing to be added to"
        raise InputError(found, where=prim.GetPath(), do="give its lens in spin:lens:*, or remove the parameter")
    own = read_lens(prim)
    model, asked = lens_model(own), {name.removeprefix("lens.") for name in names}
    if foreign := asked - {*schema.PROJECTION, *schema.LENS_MODELS[model]}:
        found = f"has a lens of the model {model}, without {', '.join(sorted(foreign))}"
        raise InputError(found, where=prim.GetPath(), do="remove the parameter")
    focal = float(read(prim.GetAttribute("focalLength"), base.first))
    before = _lens_values(own, focal)
    changed = {name for each in names for name in _changed(before, _lens_values(_offset(own, {each: 1e-3}), focal))}
    attributes = tuple(
        attribute_of(prim.GetAttribute(name)) for name in before if name in changed and prim.HasAttribute(name)
    )

    def values(sampled: ParameterValues, _: float) -> tuple[Any, ...]:
        after = _lens_values(_offset(own, sampled), focal)
        return tuple(after[each.name] for each in attributes)

    return AttributeChange(parameters=names, attributes=attributes, values=values)


def _lens_values(camera: Camera, focal_length: float) -> dict[str, Any]:
    """Return every attribute that describes the lens, by name."""
    names = schema.LENS_NUMBERS[lens_model(camera)]
    return {**dict(zip(names, lens_numbers(camera), strict=True)), **derived_values(camera, focal_length)}


def _changed(before: dict[str, Any], after: dict[str, Any]) -> list[str]:
    return [name for name in before if before[name] != after[name]]


def _offset(camera: Camera, sampled: ParameterValues) -> Camera:
    """Return `camera` with the offsets lens.* of `sampled` added."""
    off = {name: float(sampled.get(f"lens.{name}", 0.0)) for name in LENS}
    names = schema.LENS_MODELS[lens_model(camera)]
    moved_by = [k + off.get(name, 0.0) for k, name in zip(camera.distortion, names, strict=True)]
    try:
        moved = replace(
            camera,
            fx=camera.fx + off["fx"],
            fy=camera.fy + off["fy"],
            cx=camera.cx + off["cx"],
            cy=camera.cy + off["cy"],
            distortion=Fisheye(*moved_by) if camera.fisheye else tuple(moved_by),
        )
        moved.check_invertible()
    except GeometryError as error:
        do = "sample smaller errors"
        raise InputError(error.found, where=", ".join(n for n in sampled if n.startswith("lens.")), do=do) from None
    return moved
