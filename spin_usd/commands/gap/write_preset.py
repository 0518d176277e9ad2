"""Writes the fits of many pictures as distributions: a preset with one light and camera, and an augmentation that
draws others for each picture.

The light that gives most of a picture becomes a wide Sun with a direction and an irradiance. The picture's walls become
a second light, as wide as the sky behind the camera, which fills shadows. A picture's direction, irradiance and wall
light are drawn together, since a light that grazes the target is fitted stronger; black levels are drawn apart. A light
that only grazes the target has a poorly determined irradiance, so irradiances are clipped to the CENTRAL quantiles. The
Sun's angle, the mean of the lights', and the camera's noise and sharpness are the same in all pictures.
"""

import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from spin_usd.commands.gap.calls import Fitted
from spin_usd.commands.gap.report import GapLight, GapReport
from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.realism.camera_fit import fitted_optics, fitted_sensor
from spin_usd.realism.panels import is_wall, light_width
from spin_usd.scene.sensor import Optics, Sensor
from spin_usd.store.atomic import write_text
from spin_usd.store.hidden_folder import hidden_folder

CENTRAL = (0.1, 0.9)  # quantiles of irradiances
DIGITS = 4
BRIGHTER = 2.0  # than the room, at least: specifications take the strongest distant light for the Sun
SKY = 170  # degrees: the width of the light that fills shadows
ROOM = math.pi / 24
"""Irradiance of half the sky over the summed strengths of six walls, as realism.panels has them: a quarter of the mean
wall's strength is its radiance."""
PRESET = """#usda 1.0
(
    defaultPrim = "World"
    doc = "{doc}"
    metersPerUnit = 1
    upAxis = "Z"
)

def Xform "World"
{{
    over "Camera" (
        prepend apiSchemas = ["SpinSensorAPI", "SpinOpticsAPI"]
    )
    {{
        bool spin:sensor:autoExposure = 0
{camera}
    }}

    def Xform "Lights" (
        kind = "group"
    )
    {{
{lights}
    }}

    def Xform "Environment" (
        kind = "group"
    )
    {{
    }}
}}
"""
LIGHT = """        def DistantLight "{name}" (
            customData = {{ dictionary spin = {{ string intensityUnit = "W/m2" }} }}
        )
        {{
            float inputs:angle = {angle}
            color3f inputs:color = (1, 1, 1)
            bool inputs:enableColorTemperature = 0
            float inputs:exposure = 0
            float inputs:intensity = {irradiance}
            bool inputs:normalize = 1
            float3 xformOp:rotateXYZ = {turn}
            uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
        }}"""
AUGMENTATION = """{comment}
schema = "augment-1"
seed = 0

[[augmentation]]
name = "{name}"

[augmentation.sample]
{samples}
"""


def refuse_old_preset(path: Path) -> None:
    """Raise InputError if the preset `path`, or the augmentation beside it, exists, or has no folder."""
    if not path.parent.is_dir():
        raise InputError("is not a folder", where=path.parent, do="make it first")
    if taken := next((file for file in (path, path.with_suffix(".toml")) if file.exists()), None):
        raise InputError("exists already", where=taken, do="give --write another name")


def write_preset(path: Path, report: GapReport, sensor: Sensor, fitted: Sequence[Fitted]) -> None:
    """Write the preset `path` and the augmentation beside it, which ends in .toml. Raises OutputError, and InputError
    if no picture has light.

    sensor: the stage's · fitted: the fits of the report's pictures.
    """
    shining = [sorted(each.lights, key=lambda light: is_wall(light.name)) for each in report.pictures if each.lights]
    lights = [each[0] for each in shining]  # the one that gives most, a wall only without any other
    rooms = [sum(light.strength for light in each[1:] if is_wall(light.name)) * ROOM for each in shining]
    if not lights:
        raise InputError(
            "no picture has light of which a preset could be made", where=report.real, do="leave --write out"
        )
    camera = next((each.camera for each in fitted if each.camera), None)
    levels = [fitted_sensor(sensor, camera, each.level).black_level for each in fitted] if camera else []
    numbers = {"spin:sensor:encoding": f'"{sensor.encoding}"', "spin:sensor:channels": f'"{sensor.channels}"'}
    if camera:
        made = fitted_sensor(sensor, camera, 0.0)
        numbers |= {
            "spin:sensor:adcBits": str(made.adc_bits),
            "spin:sensor:blackLevel": _number(float(np.median(levels))),
            "spin:sensor:fullWell": _number(made.full_well),
            "spin:sensor:gain": _number(made.gain),
            "spin:sensor:readNoise": _number(made.read_noise),
            "spin:sensor:jpegQuality": str(made.jpeg_quality),
        }
    if camera and camera.psf_sigma is not None:
        numbers["spin:optics:psfSigma"] = _number(fitted_optics(Optics(), camera).psf_sigma)
    text = PRESET.format(
        doc=f"Light and camera of {len(report.pictures)} pictures, by spin-usd gap. Each picture has its own light and "
        "black level: the augmentation beside it draws them.",
        camera="\n".join(f"        {_typed(name)} {name} = {value}" for name, value in numbers.items()),
        lights="\n\n".join(_lights(lights, rooms)),
    )
    drawn = AUGMENTATION.format(
        comment=f"# Light and black level of {len(report.pictures)} pictures, by spin-usd gap, over {path.name}.",
        name=re.sub("[^a-z0-9_]+", "_", path.stem.lower()),
        samples="\n".join(_samples(lights, rooms, levels)),
    )
    with hidden_folder(path.parent, path.name) as hidden:
        for name, content in ((path.name, text), (f"{path.stem}.toml", drawn)):
            write_text(Folder(path.parent), name, content, work=hidden.folder)


def _lights(lights: Sequence[GapLight], rooms: Sequence[float]) -> Iterator[str]:
    """Yield the preset's lights, along the camera's axis and, the Sun, from above it."""
    angle = float(np.mean([_angle(light) for light in lights]))  # the median of two kinds is one of them
    irradiance = max(float(np.median([light.strength for light in lights])), BRIGHTER * float(np.mean(rooms)))
    yield LIGHT.format(name="Sun", angle=_number(angle), irradiance=_number(irradiance), turn=(60, 0, 30))
    if any(rooms):
        yield LIGHT.format(name="Room", angle=SKY, irradiance=_number(float(np.mean(rooms))), turn=(90, 0, 0))


def _angle(light: GapLight) -> float:
    """Return the apparent diameter of a light, degrees; 0 for a Sun."""
    return math.degrees(2 * math.atan(light_width(light.name) / 2)) if light.distance else 0.0


def _samples(lights: Sequence[GapLight], rooms: Sequence[float], levels: Sequence[float]) -> Iterator[str]:
    """Yield the lines of an augmentation."""
    found = [light.strength for light in lights]
    yield _choice("sun.direction", [tuple(light.direction) for light in lights])
    irradiances = np.clip(found, *np.quantile(found, CENTRAL)).tolist()
    yield _choice("sun.irradiance", irradiances, "W/m2", together="sun.direction")
    if any(rooms):
        yield _choice("fill.factor", (np.array(rooms) / np.mean(rooms)).tolist(), together="sun.direction")
    if levels:
        yield _choice("sensor.black_level", levels, "steps")


def _choice(name: str, values: Sequence[object], unit: str = "", together: str = "") -> str:
    listed = ", ".join(f"[{', '.join(map(_number, v))}]" if isinstance(v, tuple) else _number(v) for v in values)
    of = (f', unit = "{unit}"' if unit else "") + (f', together = "{together}"' if together else "")
    return f'"{name}" = {{ distribution = "choice", values = [{listed}]{of}, per = "frame" }}'


def _number(value: object) -> str:
    return f"{float(f'{value:.{DIGITS}g}'):g}"


def _typed(name: str) -> str:
    kinds = {"encoding": "token", "channels": "token", "adcBits": "int", "jpegQuality": "int"}
    return kinds.get(name.rpartition(":")[2], "double")
