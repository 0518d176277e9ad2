"""The stage's cameras: which prims they are, and their intrinsics."""

from collections.abc import Callable, Iterator
from itertools import islice
from typing import Any

from pxr import Sdf, Usd, UsdGeom, UsdRender

from spin_usd.errors import GeometryError, StageError, UnsupportedError
from spin_usd.geometry.camera import Camera
from spin_usd.scene.scene import variant_of
from spin_usd.stage.composition.open_stage import VARIANT_NAME, variants
from spin_usd.stage.read.lens import OMNI_ZEROS, camera_of
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import read

PINHOLE = ("", "pinhole", "none")


def find_cameras(stage: Usd.Stage) -> dict[str, Usd.Prim]:
    """Find the cameras that take the stage's pictures, by their names: first the result of `find_camera`, then cameras
    that products of the RenderSettings name instead, in the products' order. A camera's name is its display name, or
    its prim's, in lower case. Raises StageError for a name that cannot name a folder, or is not unique."""
    first, settings = find_camera(stage), render_settings(stage)
    prims = {first.GetPath(): first}
    for product in _products(settings) if settings else ():
        for path in product.GetCameraRel().GetTargets():
            prims[path] = _as_camera(stage, path, product)
    found: dict[str, Usd.Prim] = {}
    for prim in prims.values():
        name = (prim.GetDisplayName() or prim.GetName()).lower()
        if len(prims) > 1 and not VARIANT_NAME.fullmatch(name):
            found_there = f"is called {name!r}, which cannot name a folder"
            raise StageError(found_there, where=prim.GetPath(), do="use letters, digits and '_'")
        if name in found:
            found_there = f"is called {name!r}, as {found[name].GetPath()} is"
            raise StageError(found_there, where=prim.GetPath(), do="give each camera its own displayName")
        found[name] = prim
    return found


def picture_variants(stage: Usd.Stage) -> tuple[str, ...]:
    """List the variants of the stage's pictures: each augmentation as the first camera sees it, then as the others
    do."""
    _, *others = find_cameras(stage)
    return tuple(variant_of(each, camera) for each in variants(stage) for camera in ("", *others))


def find_camera(stage: Usd.Stage) -> Usd.Prim:
    """Find the camera that the stage's RenderSettings name, else its only one. Raises StageError otherwise."""
    settings = render_settings(stage)
    named = settings.GetCameraRel().GetTargets() if settings else []
    if settings and named:
        return _as_camera(stage, named[0], settings)
    cameras = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Camera)]
    if len(cameras) == 1:
        return cameras[0]
    do = "set the stage's renderSettingsPrimPath to a RenderSettings prim that names the camera"
    if cameras:
        names = ", ".join(str(prim.GetPath()) for prim in cameras[:5])
        raise StageError(f"the stage has {len(cameras)} cameras ({names})", where=_name(stage), do=do)
    raise StageError("the stage has no camera", where=_name(stage), do="add a Camera prim")


def _as_camera(stage: Usd.Stage, path: Sdf.Path, named_by: UsdRender.SettingsBase) -> Usd.Prim:
    prim = stage.GetPrimAtPath(path)
    if not prim or not prim.IsA(UsdGeom.Camera):
        raise StageError(f"its camera {path} is not a Camera prim", where=named_by.GetPath(), do="point it at a Camera")
    return prim


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
    _refuse_window(settings)
    return settings


def _products(settings: UsdRender.Settings) -> Iterator[UsdRender.Product]:
    """Yield the products of the RenderSettings that there are."""
    for path in settings.GetProductsRel().GetTargets():
        if product := UsdRender.Product(settings.GetPrim().GetStage().GetPrimAtPath(path)):
            yield product


def _settings_of(camera: Usd.Prim) -> tuple[UsdRender.SettingsBase, ...]:
    """Return the prims with the layout of the camera's pictures, the strongest first: the first product that names it,
    and the RenderSettings."""
    settings = render_settings(camera.GetStage())
    if not settings:
        return ()
    named = (each for each in _products(settings) if camera.GetPath() in each.GetCameraRel().GetTargets())
    own = tuple(islice(named, 1))
    for product in own:
        _refuse_window(product)
    return (*own, settings)


def _setting(camera: Usd.Prim, name: str) -> Usd.Attribute:
    """Return the attribute of that name of the first of `_settings_of` the camera that authors it, else of the
    RenderSettings; one that is not valid without any."""
    found = [each.GetPrim().GetAttribute(name) for each in _settings_of(camera)]
    return next((each for each in found if each.HasAuthoredValue()), found[-1] if found else Usd.Attribute())


def _refuse_window(settings: UsdRender.SettingsBase) -> None:
    window = read(settings.GetDataWindowNDCAttr())
    if tuple(window) != (0, 0, 1, 1):
        raise UnsupportedError(f"its dataWindowNDC is {window}", where=settings.GetPath(), do="use the whole frame")


def read_camera(prim: Usd.Prim, time: Usd.TimeCode) -> Camera:
    """Read the intrinsics: from SpinLensAPI where applied, else from USD's apertures and the RenderSettings'
    resolution."""
    if read(prim.GetAttribute("projection"), time) != UsdGeom.Tokens.perspective:
        raise UnsupportedError("is not a perspective camera", where=prim.GetPath(), do="set projection to perspective")
    if prim.HasAPI(UsdGeom.BackPlateAPI):
        do = "take it off, and lay the image behind with SpinBackPlateAPI (author --background)"
        raise UnsupportedError("has a back plate (BackPlateAPI), which would not be seen", where=prim.GetPath(), do=do)
    try:
        if prim.HasAPI(schema.LENS_API):
            camera = _from_lens(prim, time)
        else:
            camera = _from_omni(prim, time) if foreign_lens(prim) else _from_apertures(prim, time)
        camera.check_invertible()
    except GeometryError as error:
        raise StageError(error.found, where=prim.GetPath(), do=error.do or "fix the camera") from None
    return camera


def _from_lens(prim: Usd.Prim, time: Usd.TimeCode) -> Camera:
    model = str(read(prim.GetAttribute(schema.LENS_MODEL), time))
    names = schema.LENS_NUMBERS[model]
    size = read(prim.GetAttribute(schema.LENS_IMAGE_SIZE), time)
    numbers = [read(prim.GetAttribute(name), time) for name in names]
    missing = [
        name for name, value in zip((schema.LENS_IMAGE_SIZE, *names), (size, *numbers), strict=True) if value is None
    ]
    if missing:
        raise StageError(f"lacks {', '.join(missing)}", where=prim.GetPath(), do="author them")
    resolution = _resolution(prim)
    if resolution and resolution != tuple(size):
        found = f"has {size[0]}x{size[1]} pixels, but the resolution of its pictures is {resolution}"
        raise StageError(found, where=prim.GetPath(), do="make them equal")
    return camera_of(size, [float(n) for n in numbers], model)


def foreign_lens(prim: Usd.Prim) -> str:
    """Return the camera's lens from other tools' attributes, "" for a pinhole, also without any."""
    applied = [each for each in prim.GetAppliedSchemas() if each.startswith("OmniLensDistortion")]
    for name in (schema.OMNI_LENS_MODEL, schema.OMNI_PROJECTION):
        attribute = prim.GetAttribute(name)
        if attribute and attribute.HasAuthoredValue() and (said := str(read(attribute))) not in PINHOLE:
            return said
    return applied[0] if applied else ""


def _from_omni(prim: Usd.Prim, time: Usd.TimeCode) -> Camera:
    """Read the lens that NVIDIA's schema of OpenCV's lenses has. Raises UnsupportedError for any other."""
    said = foreign_lens(prim)
    names = {name: model for each in (schema.OMNI_LENS, schema.OMNI_LENS_API) for model, name in each.items()}
    model = names.get(said)
    do = "give it one of OpenCV's, opencvPinhole or opencvFisheye, or SpinLensAPI"
    if not model:
        raise UnsupportedError(f"has the projection {said!r}, which cannot be rendered", where=prim.GetPath(), do=do)

    def number(name: str, otherwise: Any = None) -> Any:
        attribute = prim.GetAttribute(f"omni:lensdistortion:{schema.OMNI_LENS[model]}:{name}")
        value = read(attribute, time) if attribute else None
        if value is None and otherwise is None:
            raise StageError(f"its lens {said} has no {name}", where=prim.GetPath(), do="author it")
        return otherwise if value is None else value

    if beyond := next((name for name in OMNI_ZEROS if model == "brownConrady" and number(name, 0.0)), None):
        found = f"its lens has {beyond}, of OpenCV's rational, thin prism or tilted model"
        raise UnsupportedError(found, where=prim.GetPath(), do="calibrate with k1, k2, p1, p2, k3 alone")
    size = number("imageSize", _resolution(prim))
    projection = [float(number(name)) for name in schema.PROJECTION]
    return camera_of(size, projection + [float(number(name, 0.0)) for name in schema.LENS_MODELS[model]], model)


def _from_apertures(prim: Usd.Prim, time: Usd.TimeCode) -> Camera:
    """Derive intrinsics from apertures, offsets and focal length, which share one unit: only their ratios count."""
    camera, resolution = UsdGeom.Camera(prim), _resolution(prim)
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
    across, down = _conformed(across, down, width, height, prim)
    return Camera(
        width=width,
        height=height,
        fx=focal * width / across,
        fy=focal * height / down,
        cx=width / 2 - offset_x * width / across,
        cy=height / 2 + offset_y * height / down,
    )


def _conformed(across: float, down: float, width: int, height: int, camera: Usd.Prim) -> tuple[float, float]:
    """Return the apertures after UsdRender's aspectRatioConformPolicy made their ratio the image's."""
    ratio = width * float(read(_setting(camera, "pixelAspectRatio"))) / height
    policy = str(read(_setting(camera, "aspectRatioConformPolicy")))
    wider, taller = (down * ratio, down), (across, across / ratio)
    choices: dict[str, Callable[[], tuple[float, float]]] = {
        "expandAperture": lambda: taller if across / down > ratio else wider,
        "cropAperture": lambda: wider if across / down > ratio else taller,
        "adjustApertureWidth": lambda: wider,
        "adjustApertureHeight": lambda: taller,
        "adjustPixelAspectRatio": lambda: (across, down),
    }
    if policy not in choices:
        raise StageError(
            f"its aspectRatioConformPolicy is '{policy}'", where=_settings_of(camera)[0].GetPath(), do="use USD's names"
        )
    return choices[policy]()


def _resolution(camera: Usd.Prim) -> tuple[int, int] | None:
    attribute = _setting(camera, "resolution")
    if not attribute or not attribute.HasAuthoredValue():
        return None
    width, height = read(attribute)
    return int(width), int(height)


def _name(stage: Usd.Stage) -> str:
    return str(stage.GetRootLayer().realPath or stage.GetRootLayer().identifier)
