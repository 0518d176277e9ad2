"""The stage's camera: which prim it is, and its intrinsics."""

from collections.abc import Callable
from typing import Any

from pxr import Usd, UsdGeom, UsdRender

from spin_usd.errors import GeometryError, StageError, UnsupportedError
from spin_usd.geometry.camera import Camera
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import read


def find_camera(stage: Usd.Stage) -> Usd.Prim:
    """Find the camera that the stage's RenderSettings name, else its only one. Raises StageError otherwise."""
    settings = render_settings(stage)
    named = settings.GetCameraRel().GetTargets() if settings else []
    if settings and named:
        prim = stage.GetPrimAtPath(named[0])
        if not prim or not prim.IsA(UsdGeom.Camera):
            found = f"its camera {named[0]} is not a Camera prim"
            raise StageError(found, where=settings.GetPath(), do="point it at a Camera")
        return prim
    cameras = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Camera)]
    if len(cameras) == 1:
        return cameras[0]
    do = "set the stage's renderSettingsPrimPath to a RenderSettings prim that names the camera"
    if cameras:
        names = ", ".join(str(prim.GetPath()) for prim in cameras[:5])
        raise StageError(f"the stage has {len(cameras)} cameras ({names})", where=_name(stage), do=do)
    raise StageError("the stage has no camera", where=_name(stage), do="add a Camera prim")


def render_settings(stage: Usd.Stage) -> UsdRender.Settings | None:
    """Return the RenderSettings that the stage's metadata name, if any. Raises StageError where they name another
    prim."""
    path = stage.GetMetadata("renderSettingsPrimPath")
    if not path:
        return None
    settings = UsdRender.Settings.GetStageRenderSettings(stage)
    if not settings:
        found = f"renderSettingsPrimPath {path} is not a RenderSettings prim"
        raise StageError(found, where=_name(stage), do="fix the path")
    window = read(settings.GetDataWindowNDCAttr())
    if tuple(window) != (0, 0, 1, 1):
        raise UnsupportedError(f"its dataWindowNDC is {window}", where=path, do="use the whole frame")
    return settings


def read_camera(prim: Usd.Prim, time: Usd.TimeCode) -> Camera:
    """Read the intrinsics: from SpinLensAPI where applied, else from USD's apertures and the RenderSettings'
    resolution."""
    if read(prim.GetAttribute("projection"), time) != UsdGeom.Tokens.perspective:
        raise UnsupportedError("is not a perspective camera", where=prim.GetPath(), do="set projection to perspective")
    try:
        camera = _from_lens(prim, time) if prim.HasAPI(schema.LENS_API) else _from_apertures(prim, time)
        camera.check_invertible()
    except GeometryError as error:
        raise StageError(error.found, where=prim.GetPath(), do=error.do or "fix the camera") from None
    return camera


def _from_lens(prim: Usd.Prim, time: Usd.TimeCode) -> Camera:
    read(prim.GetAttribute(schema.LENS_MODEL), time)  # refuses all but the schema's only one
    size = read(prim.GetAttribute(schema.LENS_IMAGE_SIZE), time)
    numbers = [read(prim.GetAttribute(name), time) for name in schema.LENS_NUMBERS]
    missing = [
        name
        for name, value in zip((schema.LENS_IMAGE_SIZE, *schema.LENS_NUMBERS), (size, *numbers), strict=True)
        if value is None
    ]
    if missing:
        raise StageError(f"lacks {', '.join(missing)}", where=prim.GetPath(), do="author them")
    resolution = _resolution(prim.GetStage())
    if resolution and resolution != tuple(size):
        found = f"has {size[0]}x{size[1]} pixels, but the RenderSettings' resolution is {resolution}"
        raise StageError(found, where=prim.GetPath(), do="make them equal")
    fx, fy, cx, cy, *distortion = (float(n) for n in numbers)
    k1, k2, p1, p2, k3 = distortion
    return Camera(width=size[0], height=size[1], fx=fx, fy=fy, cx=cx, cy=cy, distortion=(k1, k2, p1, p2, k3))


def _from_apertures(prim: Usd.Prim, time: Usd.TimeCode) -> Camera:
    """Derive intrinsics from apertures, offsets and focal length, which share one unit: only their ratios count."""
    stage, camera = prim.GetStage(), UsdGeom.Camera(prim)
    resolution = _resolution(stage)
    if not resolution:
        do = "apply SpinLensAPI to it, or author a resolution in the RenderSettings"
        raise StageError("has no size in pixels", where=prim.GetPath(), do=do)
    width, height = resolution
    focal = float(read(camera.GetFocalLengthAttr(), time))
    across, down = (
        float(read(a, time)) for a in (camera.GetHorizontalApertureAttr(), camera.GetVerticalApertureAttr())
    )
    offset_x, offset_y = (
        float(read(a, time)) for a in (camera.GetHorizontalApertureOffsetAttr(), camera.GetVerticalApertureOffsetAttr())
    )
    if min(across, down, focal) <= 0:
        found = f"its apertures and focal length are {across:g}, {down:g}, {focal:g}"
        raise StageError(found, where=prim.GetPath(), do="make them positive")
    across, down = _conformed(across, down, width, height, render_settings(stage))
    return Camera(
        width=width,
        height=height,
        fx=focal * width / across,
        fy=focal * height / down,
        cx=width / 2 - offset_x * width / across,
        cy=height / 2 + offset_y * height / down,
    )


def _conformed(across: float, down: float, width: int, height: int, settings: Any) -> tuple[float, float]:
    """Return the apertures after UsdRender's aspectRatioConformPolicy made their ratio the image's."""
    ratio = width * float(read(settings.GetPixelAspectRatioAttr())) / height
    policy = str(read(settings.GetAspectRatioConformPolicyAttr()))
    wider, taller = (down * ratio, down), (across, across / ratio)
    choices: dict[str, Callable[[], tuple[float, float]]] = {
        "expandAperture": lambda: taller if across / down > ratio else wider,
        "cropAperture": lambda: wider if across / down > ratio else taller,
        "adjustApertureWidth": lambda: wider,
        "adjustApertureHeight": lambda: taller,
        "adjustPixelAspectRatio": lambda: (across, down),
    }
    if policy not in choices:
        raise StageError(f"its aspectRatioConformPolicy is '{policy}'", where=settings.GetPath(), do="use USD's names")
    return choices[policy]()


def _resolution(stage: Usd.Stage) -> tuple[int, int] | None:
    settings = render_settings(stage)
    if not settings or not settings.GetResolutionAttr().HasAuthoredValue():
        return None
    width, height = read(settings.GetResolutionAttr())
    return int(width), int(height)


def _name(stage: Usd.Stage) -> str:
    return str(stage.GetRootLayer().realPath or stage.GetRootLayer().identifier)
