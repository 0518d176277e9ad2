"""The table of all parameters that can be sampled."""

import re
from collections.abc import Mapping
from dataclasses import replace

from spin_usd.basics.suggestion import suggestion
from spin_usd.errors import InputError
from spin_usd.scene.environment import BACKGROUND
from spin_usd.scene.material import LIMITS, Limits
from spin_usd.stage.augment import camera, lights, materials, planet
from spin_usd.stage.augment.attribute_change import AttributeChange, BaseStage
from spin_usd.stage.augment.material_variation import VARIATION, variation
from spin_usd.stage.augment.parameter import ANY, ATTITUDE, DIRECTION, TRUTH, Parameter
from spin_usd.stage.augment.part_shape import PART_PARAMETERS
from spin_usd.stage.read import event_sensor as event_limits
from spin_usd.stage.read import optics as optics_limits
from spin_usd.stage.read import sensor as sensor_limits
from spin_usd.stage.read.distant_light import ANGLES
from spin_usd.stage.read.emission import EMISSIONS, TEMPERATURES
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import ABOVE_0, AT_LEAST_0, FINITE, Range


def _from_limits(limits: Limits) -> Range:
    return Range(limits.low, limits.high)


def _optics(name: str, description: str, unit: str = "") -> Parameter:
    own = optics_limits.RANGES[name]
    return Parameter(name=f"optics.{name}", description=description, make=camera.optics, unit=unit, limits=own)


def _sensor(name: str, description: str, unit: str = "") -> Parameter:
    own = sensor_limits.RANGES[name]
    return Parameter(name=f"sensor.{name}", description=description, make=camera.sensor, unit=unit, limits=own)


def _event(name: str, description: str, unit: str = "") -> Parameter:
    own = event_limits.RANGES[name]
    return Parameter(name=f"event.{name}", description=description, make=camera.event_sensor, unit=unit, limits=own)


def _lens(name: str, description: str, unit: str = "") -> Parameter:
    full = f"lens.{name}"
    return Parameter(name=full, description=description, make=camera.lens, unit=unit, group="lens", changes=False)


def _strength(name: str, description: str, unit: str = "") -> Parameter:
    own = EMISSIONS if unit else Range(0, 1e6)
    return Parameter(
        name=name, description=description, make=lights.strengths, unit=unit, limits=own, group="strengths"
    )


def _temperature(name: str, description: str) -> Parameter:
    return Parameter(name=name, description=description, make=lights.temperature, unit="K", limits=TEMPERATURES)


_ALL = (
    Parameter(
        name="sun.direction",
        description="Direction to the Sun in camera axes: x right, y down, z forward; behind the camera z is negative.",
        make=lights.sun_direction,
        kind=DIRECTION,
    ),
    Parameter(
        name="sun.from_target",
        description="Direction to the Sun in the target's body axes, instead of sun.direction.",
        make=lights.sun_from_target,
        kind=DIRECTION,
    ),
    _strength(
        "sun.irradiance",
        "The Sun's irradiance on a plane that faces it; of each of several Suns.",
        "W/m2",
    ),
    _strength("sun.factor", "Factor on the Sun's irradiance; with several Suns on each."),
    Parameter(
        name=lights.SHINING,
        description="Which of several Suns shines, from 1; the others are dark.",
        make=lights.strengths,
        limits=Range(1, lights.MAX_SUNS),
        group="strengths",
    ),
    _strength("fill.factor", "Factor on the intensity of every light but the Sun."),
    _strength("lights.factor", "Factor on the intensity of every light."),
    _temperature("sun.temperature", "The Sun's colour temperature."),
    _temperature("fill.temperature", "The colour temperature of every light but the Sun."),
    _temperature("lights.temperature", "The colour temperature of every light."),
    Parameter(
        name="sun.angle",
        description="The Sun's apparent diameter; its irradiance stays where it is normalised.",
        make=lights.sun_angle,
        unit="deg",
        limits=ANGLES,
    ),
    Parameter(
        name="exposure.stops",
        description="Stops added to the camera's exposure; one doubles the signal.",
        make=camera.exposure_stops,
        unit="stops",
        limits=Range(-60, 60),
    ),
    Parameter(
        name="exposure.time",
        description="The exposure time.",
        make=camera.exposure,
        unit="s",
        limits=Range(1e-9, 1e6),
    ),
    Parameter(
        name="exposure.iso", description="The camera's ISO number.", make=camera.exposure, limits=Range(1e-3, 1e9)
    ),
    Parameter(
        name="exposure.responsivity",
        description="The signal of a unit of exposure: the gain of camera and lens together.",
        make=camera.exposure,
        limits=Range(1e-12, 1e12),
    ),
    Parameter(
        name="exposure.level",
        description="The target's mean signal that auto-exposure brings about, in the unit range.",
        make=camera.metering,
        limits=sensor_limits.LEVELS,
    ),
    _optics("psf_sigma", "Standard deviation of the Gaussian core of the point spread function.", "px"),
    _optics("glare", "Share of all light that is scattered into a wide halo."),
    _optics("glare_core", "The halo's core.", "px"),
    _optics("glare_falloff", "The power of the distance by which the halo falls off far outside."),
    _optics("bloom_intensity", "Strength of the game engines' bloom."),
    _optics("bloom_scatter", "How wide bloom spreads."),
    _optics("bloom_threshold", "Linear signal above which bloom takes light."),
    Parameter(
        name="optics.vignetting",
        description="The first coefficient of vignetting: gain 1 + a r^2, r in half diagonals; negative is darker.",
        make=camera.vignetting,
        limits=optics_limits.RANGES["vignetting"],
    ),
    _sensor("gain", "Electrons of a step of the ADC at ISO 100.", "electrons/step"),
    _sensor("full_well", "Electrons that a pixel holds at most; 0 for any number.", "electrons"),
    _sensor("read_noise", "Standard deviation of the read noise.", "electrons"),
    _sensor("dark_current", "Electrons that a pixel gathers without light.", "electrons/s"),
    _sensor("prnu", "Standard deviation of the pixels' relative gain."),
    _sensor("pattern_seed", "Which pattern of pixel gains the sensor has."),
    _sensor("adc_bits", "Bits of the ADC.", "bits"),
    _sensor("black_level", "Steps of the ADC added to the signal.", "steps"),
    _sensor("contrast", "Exponent of the linear signal about mid-grey."),
    _sensor("saturation", "Factor on each colour's distance from its luminance."),
    _sensor("gamma", "Degree of the root that the encoding gamma takes."),
    _sensor("jpeg_quality", "Quality of the JPEG that the image passes through; 0 for none."),
    _event("threshold_on", "Rise of the natural logarithm of the light that makes an event."),
    _event("threshold_off", "Fall of the natural logarithm of the light that makes an event."),
    _event("threshold_spread", "Standard deviation of both thresholds from pixel to pixel."),
    _event("dark", "Dark current of the event camera's pixels; 1 is the current of white light."),
    _event("cutoff", "Corner frequency of the pixels in white light, Hz; 0 for none."),
    _event("leak", "Events of a rise that a pixel in constant light makes, a second."),
    _event("shot_noise", "Events that noise makes in a dark pixel, a second."),
    _event("shot_noise_in_white", "The share of these that is left in white light."),
    _event("refractory", "Time after an event for which the pixel notices nothing.", "s"),
    _event("latency", "Time from the change to its time stamp.", "s"),
    _event("jitter", "Standard deviation of the time stamps.", "s"),
    _lens("fx", "Error of the horizontal focal length: added to it.", "px"),
    _lens("fy", "Error of the vertical focal length: added to it.", "px"),
    _lens("cx", "Error of the principal point, to the right.", "px"),
    _lens("cy", "Error of the principal point, down.", "px"),
    _lens("k1", "Error of the radial distortion, r^2."),
    _lens("k2", "Error of the radial distortion, r^4."),
    _lens("p1", "Error of the tangential distortion along y."),
    _lens("p2", "Error of the tangential distortion along x."),
    _lens("k3", "Error of the radial distortion, r^6."),
    Parameter(
        name="focus.distance",
        description="Distance of the plane in focus, along the camera's axis.",
        make=camera.focus,
        unit="m",
        limits=ABOVE_0,
    ),
    Parameter(
        name="focus.fstop",
        description="f-number of the aperture; 0 is a pinhole.",
        make=camera.focus,
        limits=optics_limits.F_STOPS,
    ),
    Parameter(
        name="earth.direction",
        description="Direction from the camera to the planet's centre, in camera axes.",
        make=planet.pose,
        kind=DIRECTION,
        group="planet",
    ),
    Parameter(
        name="earth.altitude",
        description="The camera's distance from the planet's centre, less its longest semi-axis.",
        make=planet.pose,
        unit="m",
        limits=AT_LEAST_0,
        group="planet",
    ),
    Parameter(
        name="earth.attitude",
        description="How the planet's axes lie in the camera's: a unit quaternion, scalar first.",
        make=planet.pose,
        kind=ATTITUDE,
        group="planet",
    ),
    Parameter(name="earth.visible", description="Whether the planet is shown.", make=planet.visible, kind=TRUTH),
)
PARAMETERS: Mapping[str, Parameter] = {parameter.name: parameter for parameter in _ALL}
"""All parameters by name; parameters of NUMBERED, `material.NAME.INPUT`, `material.NAME.INPUT.factor`,
`material.NAME.variation` and attributes by their paths are accepted too."""
NUMBERED: Mapping[str, Parameter] = {
    rf"sun\.[2-{lights.MAX_SUNS}]\.direction": Parameter(
        name="sun.N.direction",
        description="Direction to Sun N, in camera axes; it is added, and like the first in all else.",
        make=lights.another_sun,
        kind=DIRECTION,
    ),
    rf"sun\.[1-{lights.MAX_SUNS}]\.factor": _strength("sun.N.factor", "Factor on the irradiance of Sun N alone."),
    **PART_PARAMETERS,
}
"""Parameters with a number N or the NAME of a part in their names, by patterns of those."""

MATERIAL = re.compile(r"material\.([A-Za-z_]\w*|\*)\.([A-Za-z]+)(\.factor)?")
VARIES = "Appearance of a material among those of its kind: each number from 0 to 1 selects another."
FIELDS: Mapping[str, str] = {
    "roughness": "roughness",
    "metallic": "metallic",
    "clearcoat": "clearcoat",
    "clearcoatRoughness": "clearcoat_roughness",
    "opacity": "opacity",
    "ior": "ior",
    "diffuseColor": "diffuse_color",
    "specularColor": "specular_color",
    "emissiveColor": "emissive_color",
}
"""Inputs of a UsdPreviewSurface that can be sampled, and the fields of scene.material that hold their limits."""
ATTRIBUTE_LIMITS: Mapping[str, Range] = {
    **{schema.OPTICS[field]: limits for field, limits in optics_limits.RANGES.items()},
    **{schema.SENSOR[field]: limits for field, limits in sensor_limits.RANGES.items()},
    schema.AUTO_EXPOSURE_LEVEL: sensor_limits.LEVELS,
    schema.AUTO_EXPOSURE_STOPS: sensor_limits.STOPS,
    **{attribute: PARAMETERS[name].limits for name, attribute in camera.EXPOSURE.items()},
    "fStop": optics_limits.F_STOPS,
    "inputs:angle": ANGLES,
    "inputs:colorTemperature": TEMPERATURES,
    **{f"inputs:{name}": _from_limits(LIMITS[field]) for name, field in FIELDS.items()},
}
"""Limits of attributes that are sampled by their paths, by the attribute's name; others take any finite number."""


def parameter_named(name: str) -> Parameter:
    """Look up the parameter `name`. Raises InputError that suggests a similar name."""
    if name in PARAMETERS:
        return PARAMETERS[name]
    for pattern, numbered in NUMBERED.items():
        if re.fullmatch(pattern, name):
            return replace(numbered, name=name)
    if name.startswith("/"):
        limits = ATTRIBUTE_LIMITS.get(name.rpartition(".")[2], FINITE)
        make = materials.attribute_by_path
        return Parameter(name=name, description="An attribute.", make=make, kind=ANY, limits=limits)
    found = MATERIAL.fullmatch(name)
    if found and found[2] in FIELDS:
        own = Range(0, 1e6) if found[3] else _from_limits(LIMITS[FIELDS[found[2]]])
        return Parameter(name=name, description="An input of a material.", make=materials.material_input, limits=own)
    if found and found[2] == VARIATION and not found[3]:
        return Parameter(name=name, description=VARIES, make=variation, limits=Range(0, 1))
    do = suggestion(name, [*PARAMETERS, BACKGROUND], "see schemas/augment-1.schema.json for the list of them")
    raise InputError("is not a parameter", where=name, do=do)


def attribute_changes(base: BaseStage, names: tuple[str, ...]) -> tuple[AttributeChange, ...]:
    """Return the changes that the parameters `names` make to the stage. Raises InputError for two that set one
    attribute, and for one that has nothing to change in the stage."""
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(parameter_named(name).group or name, []).append(name)
    made = tuple(parameter_named(group[0]).make(base, tuple(group)) for group in groups.values())
    owners: dict[str, str] = {}
    for change in made:
        for attribute in change.attributes:
            if str(attribute) in owners:
                found = f"sets {attribute}, and so does {owners[str(attribute)]}"
                raise InputError(found, where=change.parameters[0], do="keep one of them")
            owners[str(attribute)] = change.parameters[0]
    return made
