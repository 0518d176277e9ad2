"""What the fits of many pictures say as distributions: a preset for one picture's light and camera, and an augmentation
that draws another for each picture.

A light is drawn as a wide Sun: a direction, an angle, an irradiance. Directions, irradiances and black levels are those
that were found, each as likely as any other, and drawn on their own; the camera's noise and sharpness are the same in
all pictures. A light that only grazes the target has an irradiance that says little: so those beyond the CENTRAL ones
are brought to their ends, and a second light is to the first as what both give to the picture.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from spin_usd.commands.gap.calls import Fitted
from spin_usd.commands.gap.report import GapLight, GapPicture, GapReport
from spin_usd.files.folder import Folder
from spin_usd.realism.camera_fit import fitted_optics, fitted_sensor
from spin_usd.realism.panels import light_width
from spin_usd.scene.sensor import Optics, Sensor
from spin_usd.store.atomic import write_text
from spin_usd.store.hidden_folder import hidden_folder

SUNS = 3  # of a picture at most
LEAST_SHARE = 0.08  # of a picture's light: a light that gives less is left out
CENTRAL = (0.1, 0.9)  # quantiles of irradiances
DIGITS = 4
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
        def DistantLight "Sun"
        {{
            float inputs:angle = {angle}
            color3f inputs:color = (1, 1, 1)
            bool inputs:enableColorTemperature = 0
            float inputs:exposure = 0
            float inputs:intensity = {irradiance}
            bool inputs:normalize = 1
            float3 xformOp:rotateXYZ = (0, 0, 0)
            uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
        }}
    }}

    def Xform "Environment" (
        kind = "group"
    )
    {{
    }}
}}
"""
AUGMENTATION = """{comment}
schema = "augment-1"
seed = 0

[[augmentation]]
name = "{name}"

[augmentation.sample]
{samples}
"""


@dataclass(frozen=True, kw_only=True)
class DrawnSun:
    """A light of a picture as a Sun: direction to it (3,), camera axes; irradiance; apparent diameter, degrees."""

    direction: tuple[float, ...]
    irradiance: float
    angle: float
    share: float


def write_preset(path: Path, report: GapReport, sensor: Sensor, fitted: Sequence[Fitted]) -> None:
    """Write the preset `path` and the augmentation beside it, which ends in .toml. Raises OutputError.

    sensor: the stage's · fitted: the fits of the report's pictures.
    """
    suns = [_suns(picture) for picture in report.pictures]
    first = [each[0] for each in suns if each]
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
            "spin:optics:psfSigma": _number(fitted_optics(Optics(), camera).psf_sigma),
        }
    text = PRESET.format(
        doc=f"Light and camera of {len(report.pictures)} pictures, by spin-usd gap. Each picture has its own light and "
        f"black level: {path.stem}.toml draws them.",
        camera="\n".join(f"        {_typed(name)} {name} = {value}" for name, value in numbers.items()),
        angle=_number(float(np.median([sun.angle for sun in first]))),
        irradiance=_number(float(np.median([sun.irradiance for sun in first]))),
    )
    drawn = AUGMENTATION.format(
        comment=f"# Light and black level of {len(report.pictures)} pictures, by spin-usd gap, over {path.name}.",
        name=path.stem.lower().replace("-", "_"),
        samples="\n".join(_samples(suns, levels)),
    )
    with hidden_folder(path.parent, path.name) as hidden:
        for name, content in ((path.name, text), (f"{path.stem}.toml", drawn)):
            write_text(Folder(path.parent), name, content, work=hidden.folder)


def _suns(picture: GapPicture) -> list[DrawnSun]:
    """Return the Suns of a picture, the one that gives most light first."""
    return [_sun(light) for light in picture.lights[:SUNS] if light.share >= LEAST_SHARE]


def _sun(light: GapLight) -> DrawnSun:
    width = light_width(light.name) if light.distance else 0.0
    return DrawnSun(
        direction=tuple(light.direction),
        irradiance=light.strength,
        angle=math.degrees(2 * math.atan(width / 2)),
        share=light.share,
    )


def _samples(suns: Sequence[Sequence[DrawnSun]], levels: Sequence[float]) -> Iterable[str]:
    """Yield the lines of an augmentation."""
    lit = [each for each in suns if each]
    yield _choice("sun.direction", [each[0].direction for each in lit])
    found = [each[0].irradiance for each in lit]
    yield _choice("sun.irradiance", np.clip(found, *np.quantile(found, CENTRAL)).tolist(), "W/m2")
    for number in range(2, SUNS + 1):
        ratios = [each[number - 1].share / each[0].share if len(each) >= number else 0.0 for each in lit]
        if any(ratios):
            yield _choice(
                f"sun.{number}.direction", [each[number - 1].direction for each in lit if len(each) >= number]
            )
            yield _choice(f"sun.{number}.factor", ratios)
    if levels:
        yield _choice("sensor.black_level", levels, "steps")


def _choice(name: str, values: Sequence[object], unit: str = "") -> str:
    listed = ", ".join(f"[{', '.join(map(_number, v))}]" if isinstance(v, tuple) else _number(v) for v in values)
    of = f', unit = "{unit}"' if unit else ""
    return f'"{name}" = {{ distribution = "choice", values = [{listed}]{of}, per = "frame" }}'


def _number(value: object) -> str:
    return f"{float(f'{value:.{DIGITS}g}'):g}"


def _typed(name: str) -> str:
    kinds = {"encoding": "token", "channels": "token", "adcBits": "int"}
    return kinds.get(name.rpartition(":")[2], "double")
