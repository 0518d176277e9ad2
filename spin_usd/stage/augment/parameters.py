"""The parameters that can be drawn: their names, units, limits, and what of the stage each of them decides."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import NoReturn, TypeAlias

from spin_usd.errors import InputError
from spin_usd.scene.material import LIMITS, Limits
from spin_usd.stage.augment import camera, lights, materials, planet
from spin_usd.stage.augment.attribute_change import Base, Setting
from spin_usd.stage.read.camera import optics as optics_limits
from spin_usd.stage.read.camera import sensor as sensor_limits
from spin_usd.stage.read.camera.depth_of_field import F_STOPS
from spin_usd.stage.read.lights.distant import ANGLES
from spin_usd.stage.read.lights.emission import EMISSIONS, TEMPERATURES
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import ABOVE_0, AT_LEAST_0, FINITE, Range

NUMBER, DIRECTION, ATTITUDE, TRUTH, NAME, ANY = "number", "direction", "attitude", "truth", "name", "any"

UNITS: Mapping[str, Mapping[str, float]] = {
    "deg": {"deg": 1.0, "rad": 57.29577951308232},
    "W/m2": {"W/m2": 1.0, "kW/m2": 1e3},
    "K": {"K": 1.0},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6},
    "m": {"m": 1.0, "km": 1e3, "mm": 1e-3},
    "px": {"px": 1.0},
    "stops": {"stops": 1.0},
    "electrons": {"electrons": 1.0},
    "electrons/s": {"electrons/s": 1.0},
    "electrons/step": {"electrons/step": 1.0},
    "steps": {"steps": 1.0},
    "bits": {"bits": 1.0},
}
"""By a parameter's own unit: those that it can be given in, and what one of them is of its own."""

Maker: TypeAlias = Callable[[Base, tuple[str, ...]], Setting]


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """`unit`: its own, "" for plain numbers · `limits`: of numbers, in that unit · `kind`: what is drawn for it ·
    `together`: those that act with it on the same attributes · `changes`: whether it can differ between pictures."""

    name: str
    description: str
    make: Maker
    unit: str = ""
    limits: Range = FINITE
    kind: str = NUMBER
    together: str = ""
    changes: bool = True

    def factor(self, unit: str | None) -> float:
        """What one `unit` is of its own. Raises InputError, where it is the name, for a unit that is missing or none of
        this parameter's."""
        known = UNITS.get(self.unit, {})
        if unit is None and known:
            raise InputError("has no unit", where=self.name, do=f"give it unit = one of {', '.join(known)}")
        if unit is not None and unit not in known:
            do = f"use one of {', '.join(known)}" if known else "leave the unit out: it is a plain number"
            raise InputError(f"is given in {unit!r}", where=self.name, do=do)
        return known[unit] if unit is not None else 1.0

    def check(self, value: object) -> None:
        """Raise InputError, where it is the name, for a value drawn that it cannot have."""
        numbers = value if isinstance(value, tuple) else (value,)
        wanted = {DIRECTION: 3, ATTITUDE: 4}.get(self.kind)
        if wanted:
            fits = isinstance(value, tuple) and len(value) == wanted and all(_is_number(n) for n in value)
            fits = fits and any(float(n) != 0 for n in numbers)
        elif self.kind == NUMBER:
            fits = all(_is_number(n) for n in numbers)
        else:
            fits = self.kind == ANY or isinstance(value, {TRUTH: bool, NAME: str}[self.kind])
        if not fits:
            raise InputError(f"takes no {value!r}: it is a {self.kind}", where=self.name, do="draw what it takes")
        if self.kind in (NUMBER, ANY):
            for number in filter(_is_number, numbers):
                if number not in self.limits:
                    self._refuse(f"{number:g}", self.limits)

    def check_span(self, low: float, high: float) -> None:
        """Raise InputError, where it is the name, where not every number from `low` to `high` can be its value."""
        limits = self.limits if low == high else replace(self.limits, or_0=False)
        if self.kind in (NUMBER, ANY) and not (low in limits and high in limits):
            self._refuse(f"{low:g} to {high:g}", limits)

    def _refuse(self, numbers: str, limits: Range) -> NoReturn:
        found = f"may be drawn as {numbers}{' ' * bool(self.unit)}{self.unit}"
        raise InputError(found, where=self.name, do=f"choose {limits}")


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _from_limits(limits: Limits) -> Range:
    return Range(limits.low, limits.high)


def _optics(name: str, description: str, unit: str = "") -> Parameter:
    own = optics_limits.RANGES[name]
    return Parameter(name=f"optics.{name}", description=description, make=camera.optics, unit=unit, limits=own)


def _sensor(name: str, description: str, unit: str = "") -> Parameter:
    own = sensor_limits.RANGES[name]
    return Parameter(name=f"sensor.{name}", description=description, make=camera.sensor, unit=unit, limits=own)


def _lens(name: str, description: str, unit: str = "") -> Parameter:
    full = f"lens.{name}"
    return Parameter(name=full, description=description, make=camera.lens, unit=unit, together="lens", changes=False)


def _strength(name: str, description: str, unit: str = "") -> Parameter:
    own = EMISSIONS if unit else Range(0, 1e6)
    return Parameter(
        name=name, description=description, make=lights.strengths, unit=unit, limits=own, together="strengths"
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
    _strength("sun.irradiance", "The Sun's irradiance on a plane that faces it.", "W/m2"),
    _strength("sun.factor", "Factor on the Sun's irradiance."),
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
    _sensor("gamma", "What the encoding gamma takes the root of."),
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
        description="Distance of what is sharp, along the camera's axis.",
        make=camera.focus,
        unit="m",
        limits=ABOVE_0,
    ),
    Parameter(
        name="focus.fstop", description="f-number of the aperture; 0 is a pinhole.", make=camera.focus, limits=F_STOPS
    ),
    Parameter(
        name="earth.direction",
        description="Direction from the camera to the planet's centre, in camera axes.",
        make=planet.place,
        kind=DIRECTION,
        together="planet",
    ),
    Parameter(
        name="earth.altitude",
        description="The camera's distance from the planet's centre, less its longest semi-axis.",
        make=planet.place,
        unit="m",
        limits=AT_LEAST_0,
        together="planet",
    ),
    Parameter(
        name="earth.attitude",
        description="How the planet's axes lie in the camera's: a unit quaternion, scalar first.",
        make=planet.place,
        kind=ATTITUDE,
        together="planet",
    ),
    Parameter(name="earth.visible", description="Whether the planet is there.", make=planet.visible, kind=TRUTH),
)
PARAMETERS: Mapping[str, Parameter] = {parameter.name: parameter for parameter in _ALL}
"""By name; `material.NAME.INPUT`, `material.NAME.INPUT.factor` and attributes by their paths come beside them."""

BACKGROUND = "background"
"""A parameter that brings in a layer instead of setting an attribute: `stage.backgrounds`."""
MATERIAL = re.compile(r"material\.([A-Za-z_]\w*|\*)\.([A-Za-z]+)(\.factor)?")
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
"""Inputs of a UsdPreviewSurface that can be drawn, and the fields of scene.material that say their limits."""
OF_ATTRIBUTES: Mapping[str, Range] = {
    **{schema.OPTICS[field]: limits for field, limits in optics_limits.RANGES.items()},
    **{schema.SENSOR[field]: limits for field, limits in sensor_limits.RANGES.items()},
    schema.AUTO_EXPOSURE_LEVEL: sensor_limits.LEVELS,
    schema.AUTO_EXPOSURE_STOPS: sensor_limits.STOPS,
    **{attribute: PARAMETERS[name].limits for name, attribute in camera.EXPOSURE.items()},
    "fStop": F_STOPS,
    "inputs:angle": ANGLES,
    "inputs:colorTemperature": TEMPERATURES,
    **{f"inputs:{name}": _from_limits(LIMITS[field]) for name, field in FIELDS.items()},
}
"""Limits of attributes that are drawn by their paths, by the attribute's name; others take any finite number."""


def parameter_named(name: str) -> Parameter:
    """The parameter `name`. Raises InputError that says which name was perhaps meant."""
    if name in PARAMETERS:
        return PARAMETERS[name]
    if name.startswith("/"):
        limits = OF_ATTRIBUTES.get(name.rpartition(".")[2], FINITE)
        make = materials.attribute_by_path
        return Parameter(name=name, description="An attribute.", make=make, kind=ANY, limits=limits)
    if (found := MATERIAL.fullmatch(name)) and found[2] in FIELDS:
        own = Range(0, 1e6) if found[3] else _from_limits(LIMITS[FIELDS[found[2]]])
        return Parameter(name=name, description="Of a material.", make=materials.material_input, limits=own)
    meant = get_close_matches(name, [*PARAMETERS, BACKGROUND], n=1)
    do = f"did you mean {meant[0]}?" if meant else "see schemas/augment-1.schema.json for those there are"
    raise InputError("is no parameter", where=name, do=do)


def settings(base: Base, names: tuple[str, ...]) -> tuple[Setting, ...]:
    """What the parameters `names` decide in the stage. Raises InputError for two that set one attribute, and for one
    that the stage has nothing for."""
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(parameter_named(name).together or name, []).append(name)
    made = tuple(parameter_named(group[0]).make(base, tuple(group)) for group in groups.values())
    owners: dict[str, str] = {}
    for setting in made:
        for place in setting.places:
            if str(place) in owners:
                found = f"sets {place}, and so does {owners[str(place)]}"
                raise InputError(found, where=setting.parameters[0], do="keep one of them")
            owners[str(place)] = setting.parameters[0]
    return made
