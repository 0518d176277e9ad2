"""The lens on a camera prim: spin:lens:* holds the numbers; USD's own attributes and omni:lensdistortion:* are derived.

USD gives focal length, apertures and their offsets in tenths of a scene unit; scene units are metres here.
Source of the apertures: UsdGeomCamera's schema; checked against OpenCV in the tests.
"""

from collections.abc import Sequence

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom

from spin_usd.errors import GeometryError, StageError
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.fisheye import Fisheye
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import read

OMNI_ZEROS = ("k4", "k5", "k6", "s1", "s2", "s3", "s4")
CLIPPING_RANGE = (0.01, 1e6)  # metres; for other viewers, our renderers do not clip


def usd_focal_length(camera: Camera, pixel_pitch: float) -> float:
    """Compute the `focalLength` of a camera whose pixels are `pixel_pitch` metres wide, rounded to float32 as USD keeps
    it."""
    return float(np.float32(10 * camera.fx * pixel_pitch))


def lens_model(camera: Camera) -> str:
    """Return the camera's lens as named by spin:lens:model."""
    return "fisheye" if camera.fisheye else "brownConrady"


def lens_numbers(camera: Camera) -> tuple[float, ...]:
    """Return the numbers of the lens in the order of schema.LENS_NUMBERS."""
    return (camera.fx, camera.fy, camera.cx, camera.cy, *camera.distortion)


def camera_of(size: Sequence[int], numbers: Sequence[float], model: str) -> Camera:
    """Return the camera with these numbers, in the order of schema.LENS_NUMBERS. Raises GeometryError."""
    fx, fy, cx, cy, *distortion = numbers
    lens = Fisheye(*distortion) if model == "fisheye" else tuple(distortion)
    return Camera(width=size[0], height=size[1], fx=fx, fy=fy, cx=cx, cy=cy, distortion=lens)


def derived_values(camera: Camera, focal_length: float) -> dict[str, object]:
    """Compute every attribute derived from the lens and the prim's `focalLength` (tenths of a metre), by name.

    The numbers are doubles; USD rounds them to float32.
    """
    h = focal_length * camera.width / camera.fx
    v = focal_length * camera.height / camera.fy
    model = lens_model(camera)
    numbers = dict(zip((*schema.PROJECTION, *schema.LENS_MODELS[model]), lens_numbers(camera), strict=True))
    if not camera.fisheye:
        numbers |= dict.fromkeys(OMNI_ZEROS, 0.0)
    omni = schema.OMNI_LENS[model]
    return {
        "horizontalAperture": h,
        "verticalAperture": v,
        "horizontalApertureOffset": (camera.width / 2 - camera.cx) * h / camera.width,
        "verticalApertureOffset": (camera.cy - camera.height / 2) * v / camera.height,
        schema.OMNI_LENS_MODEL: omni,
        f"omni:lensdistortion:{omni}:imageSize": Gf.Vec2i(camera.width, camera.height),
        **{f"omni:lensdistortion:{omni}:{name}": value for name, value in numbers.items()},
    }


def author_lens(prim: Usd.Prim, camera: Camera, focal_length: float) -> None:
    """Author the lens and all attributes derived from it on a Camera prim."""
    prim.ApplyAPI(schema.LENS_API)
    model = lens_model(camera)
    prim.AddAppliedSchema(schema.OMNI_LENS_API[model])
    prim.GetAttribute(schema.LENS_MODEL).Set(model)
    prim.GetAttribute(schema.LENS_IMAGE_SIZE).Set(Gf.Vec2i(camera.width, camera.height))
    for name, number in zip(schema.LENS_NUMBERS[model], lens_numbers(camera), strict=True):
        prim.GetAttribute(name).Set(number)
    UsdGeom.Camera(prim).CreateFocalLengthAttr(focal_length)
    UsdGeom.Camera(prim).CreateClippingRangeAttr(Gf.Vec2f(*CLIPPING_RANGE))
    for name, value in derived_values(camera, focal_length).items():
        prim.CreateAttribute(name, _type_of(value), custom=False).Set(value)


def read_lens(prim: Usd.Prim) -> Camera:
    """Read the intrinsics of a prim with SpinLensAPI. Raises StageError that names the prim."""
    if not prim.HasAPI(schema.LENS_API):
        raise StageError(f"has no {schema.LENS_API}", where=prim.GetPath(), do="give its lens in spin:lens:*")
    size = read(prim.GetAttribute(schema.LENS_IMAGE_SIZE))
    model = str(read(prim.GetAttribute(schema.LENS_MODEL)))
    numbers = [read(prim.GetAttribute(name)) for name in schema.LENS_NUMBERS[model]]
    if size is None or None in numbers:
        raise StageError("its lens lacks imageSize, fx, fy, cx or cy", where=prim.GetPath())
    try:
        return camera_of(size, numbers, model)
    except GeometryError as error:
        raise StageError(error.found, where=prim.GetPath()) from None


def _type_of(value: object) -> Sdf.ValueTypeName:
    if isinstance(value, str):
        return Sdf.ValueTypeNames.Token
    return Sdf.ValueTypeNames.Float if isinstance(value, float) else Sdf.ValueTypeNames.Int2
