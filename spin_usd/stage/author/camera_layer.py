"""Camera layers: one Camera prim with its lens, sensor and exposure; cameras of published data sets by name."""

import math
import re
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from pxr import Sdf, Usd, UsdGeom

from spin_usd.errors import InputError, SpinError
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.transform import Transform
from spin_usd.scene.event_sensor import EventSensor
from spin_usd.stage.composition.open_layer import open_layer, stage_on
from spin_usd.stage.read.camera import find_camera, foreign_lens, read_camera
from spin_usd.stage.read.lens import author_lens, read_lens, usd_focal_length
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.layer_file import author_metadata, writing
from spin_usd.stage.usd.values import read

SOLAR_IRRADIANCE = 1361.0  # W/m2 at 1 au. Source: Kopp and Lean, "A new, lower value of total solar irradiance" (2011)
WHITE_LEVEL = 0.9  # of full scale, for a white Lambertian that faces the Sun
IN_PIXELS = ("psf_sigma", "glare_core")  # fields of scene.sensor.Optics
EXPOSURE_TIME, EXPOSURE_ISO, EXPOSURE_FSTOP = 0.01, 100.0, 4.0
PSF_SIGMA = 0.5  # pixels
DETECTOR = {"full_well": 32_400.0, "gain": 7.9, "read_noise": 7.0}  # electrons; gain: in a step of 12 bits
REAL = """As noisy as a detector that was measured: 12 bits, a maximum signal to noise of 45.1 dB, which is that of
32,400 electrons, and a dynamic range of 73 dB, which leaves 7 electrons in the dark (EMVA 1288; technical manual of
Matrix Vision's mvBlueFOX3-2024a, whose Sony IMX249 has the pixel of the IMX174 behind SPEED, SPEED+ and SHIRT).
psfSigma: spots of a star sensor's lens measured 1.2 to 2.2 pixels across at 1/e2, which is four sigmas (Optical testing
of star sensor (I), Optical Review, 2008). The preset ideal has neither."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FurtherCamera:
    """A camera beside the stage's first: its name, its layer as those here make it, and how it stands in the axes of
    the first."""

    name: str
    layer: Sdf.Layer
    T_first_cam: Transform


def layer_name(camera: str) -> str:
    """Return the file of the layer of a further camera, or of the first, which is called ""."""
    return f"camera_{camera}.usda" if camera else "camera.usda"


def responsivity() -> float:
    """Return the exposure:responsivity that brings a white Lambertian facing the Sun, radiance E/pi, to WHITE_LEVEL.

    USD scales radiance by time x iso/100 x 2^exposure x responsivity / fStop^2.
    """
    scale = WHITE_LEVEL * math.pi / SOLAR_IRRADIANCE
    return scale * EXPOSURE_FSTOP**2 / (EXPOSURE_TIME * EXPOSURE_ISO / 100)


def new_camera_layer(
    camera: Camera, *, focal_length: float, documentation: str, channels: str = "mono", ideal: bool = False
) -> Sdf.Layer:
    """Make an anonymous layer whose /Camera has the lens of `camera`; `focal_length` in tenths of a metre, as USD has
    it. It spreads light and has noise as a real one, unless it is to be `ideal`."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_metadata(layer, default_prim="Camera", documentation=documentation)
    stage = stage_on(layer)
    prim = UsdGeom.Camera.Define(stage, "/Camera").GetPrim()
    author_lens(prim, camera, focal_length)
    _author_sensor(prim, channels)
    if not ideal:
        _author_noise(prim)
    _author_exposure(UsdGeom.Camera(prim))
    return layer


def camera_layer_of(camera: Camera, *, pixel_pitch: float, documentation: str) -> Sdf.Layer:
    """Make a `new_camera_layer` for pixels `pixel_pitch` metres wide."""
    return new_camera_layer(camera, focal_length=usd_focal_length(camera, pixel_pitch), documentation=documentation)


def open_camera_layer(path: str | Path) -> Sdf.Layer:
    """Open the layer that `read_camera_layer` returns."""
    return read_camera_layer(path)[0]


def read_camera_layer(path: str | Path) -> tuple[Sdf.Layer, str]:
    """Open an anonymous copy of the camera layer at `path`, whose default prim is a Camera with an invertible lens, and
    return it with ""; of another stage that has a lens by NVIDIA's names, make one for its camera, and return it with
    the lens's name there.

    Raises InputError that names the file.
    """
    source = open_layer(path)
    stage = stage_on(source)
    prim = stage.GetDefaultPrim()
    foreign = _foreign_camera(stage)
    if foreign:
        return _layer_of_foreign(foreign, path), foreign_lens(foreign)
    if not (prim and prim.IsA(UsdGeom.Camera)):
        raise InputError("has no default prim that is a Camera", where=path, do="give a layer like stages/cameras/*")
    if UsdGeom.GetStageMetersPerUnit(stage) != 1:
        raise InputError("is a camera layer whose metersPerUnit is not 1", where=path, do="author it in metres")
    try:
        read_lens(prim).check_invertible()
    except SpinError as error:
        raise InputError(str(error), where=path) from None
    copy = Sdf.Layer.CreateAnonymous(".usda")
    copy.TransferContent(source)
    return copy, ""


def _foreign_camera(stage: Usd.Stage) -> Usd.Prim | None:
    """Return the stage's camera where it has a lens by others' names for it, and none of ours."""
    with suppress(SpinError):
        prim = find_camera(stage)
        return prim if foreign_lens(prim) and not prim.HasAPI(schema.LENS_API) else None
    return None


def _layer_of_foreign(prim: Usd.Prim, path: str | Path) -> Sdf.Layer:
    """Make the layer of a stage's camera with a lens by NVIDIA's names. Raises InputError that names the file."""
    try:
        camera = read_camera(prim, Usd.TimeCode.EarliestTime())
    except SpinError as error:
        raise InputError(str(error), where=path) from None
    tenths = float(read(UsdGeom.Camera(prim).GetFocalLengthAttr())) * UsdGeom.GetStageMetersPerUnit(prim.GetStage())
    documentation = f"The lens {foreign_lens(prim)} of {Path(path).name}."
    return new_camera_layer(camera, focal_length=tenths, documentation=documentation)


def set_channels(path: Path, channels: str) -> None:
    """Write the sensor's channels, "mono" or "rgb", into the camera layer at `path`. Raises OutputError."""
    layer = open_layer(path)
    stage = stage_on(layer)
    prim = stage.GetDefaultPrim()
    prim.ApplyAPI(schema.SENSOR_API)
    prim.GetAttribute(schema.SENSOR["channels"]).Set(channels)
    with writing(path):
        layer.Save()


def set_event_sensor(path: Path, sensor: EventSensor) -> None:
    """Write an event camera's pixels into the camera layer at `path`. Raises OutputError."""
    layer = open_layer(path)
    stage = stage_on(layer)
    prim = stage.GetDefaultPrim()
    prim.ApplyAPI(schema.EVENT_SENSOR_API)
    for field, attribute in schema.EVENT_SENSOR.items():
        prim.GetAttribute(attribute).Set(getattr(sensor, field))
    with writing(path):
        layer.Save()


def set_resolution(layer: Sdf.Layer, resolution: str) -> tuple[str, ...]:
    """Give the camera of the layer "W" or "WxH" pixels, and return notes on it. The field of view stays: focal lengths,
    principal point and the optics' lengths in pixels are scaled. Raises InputError."""
    found = re.fullmatch(r"([1-9]\d{0,4})(?:[x,]([1-9]\d{0,4}))?", resolution)
    if found is None:
        raise InputError(f"resolution {resolution!r} is not a number of pixels", do="write for example 256, or 512x384")
    stage = stage_on(layer)
    prim = stage.GetDefaultPrim()
    lens = read_lens(prim)
    width = int(found[1])
    height = int(found[2]) if found[2] else max(round(lens.height * width / lens.width), 1)
    x, y = width / lens.width, height / lens.height
    scaled = replace(lens, width=width, height=height, fx=lens.fx * x, fy=lens.fy * y, cx=lens.cx * x, cy=lens.cy * y)
    author_lens(prim, scaled, read(UsdGeom.Camera(prim).GetFocalLengthAttr()))
    for field in IN_PIXELS:
        if (attribute := prim.GetAttribute(schema.OPTICS[field])) and attribute.HasAuthoredValue():
            attribute.Set(read(attribute) * math.sqrt(x * y))
    if abs(x / y - 1) * max(width, height) > 1:
        return (f"{width} x {height} is of another form than the camera's {lens.width} x {lens.height}: it squeezes",)
    return ()


def lens_of(layer: Sdf.Layer) -> Camera:
    """Read the lens of a camera layer."""
    stage = stage_on(layer)
    return read_lens(stage.GetDefaultPrim())


def _author_sensor(prim: Usd.Prim, channels: str) -> None:
    prim.ApplyAPI(schema.SENSOR_API)
    for field, value in {"channels": channels, "bit_depth": 8, "encoding": "srgb"}.items():
        prim.GetAttribute(schema.SENSOR[field]).Set(value)


def _author_noise(prim: Usd.Prim) -> None:
    prim.SetDocumentation(REAL)
    prim.ApplyAPI(schema.OPTICS_API)
    prim.GetAttribute(schema.OPTICS["psf_sigma"]).Set(PSF_SIGMA)
    for field, value in DETECTOR.items():
        prim.GetAttribute(schema.SENSOR[field]).Set(value)


def _author_exposure(camera: UsdGeom.Camera) -> None:
    camera.CreateExposureTimeAttr(EXPOSURE_TIME)
    camera.CreateExposureIsoAttr(EXPOSURE_ISO)
    camera.CreateExposureFStopAttr(EXPOSURE_FSTOP)
    camera.CreateExposureResponsivityAttr(responsivity())
    camera.CreateExposureAttr(0.0)
    camera.CreateFStopAttr(0.0)  # no depth of field
