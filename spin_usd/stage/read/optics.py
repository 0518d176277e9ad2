"""The camera's optics: SpinOpticsAPI, and depth of field by the aperture and focus that USD gives it."""

from pxr import Usd, UsdGeom

from spin_usd.errors import StageError
from spin_usd.geometry.camera import Camera
from spin_usd.scene.derived.vignetting import least_gain
from spin_usd.scene.scene import ThinLens
from spin_usd.scene.sensor import Optics
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import ABOVE_0, SHARE, Range, read, refuse_unapplied, typed_value, value_in

RANGES = {
    "psf_sigma": Range(0, 100),
    "glare": SHARE,
    "glare_core": Range(0.01, 10_000),  # a halo wider than a picture would hardly show in it
    "glare_falloff": Range(2, 100, open=True),
    "bloom_intensity": SHARE,
    "bloom_scatter": SHARE,
    "bloom_threshold": Range(0, 1e6),
    "vignetting": Range(-100, 100),  # fits of real lenses alternate within 10
}
FOCAL_UNITS = 0.1  # scene units in which USD gives a focal length
F_STOPS = Range(0.1, 1e6, or_0=True)  # from below the fastest lenses (0.5) to pinholes


def read_optics(prim: Usd.Prim, camera: Camera, time: Usd.TimeCode) -> Optics:
    """Read the optics of the camera `prim`, whose lens is `camera`. Raises StageError that names the attribute."""
    if not prim.HasAPI(schema.OPTICS_API):
        refuse_unapplied(prim, "spin:optics:", schema.OPTICS_API)
        return Optics()
    numbers = {field: value_in(prim, schema.OPTICS[field], allowed, time) for field, allowed in RANGES.items()}
    optics = Optics(cos_fourth=typed_value(prim, schema.OPTICS["cos_fourth"], time), **numbers)
    minimum = least_gain(camera, optics.vignetting)
    if minimum < 0:
        where = f"{prim.GetPath()}.{schema.OPTICS['vignetting']}"
        raise StageError(
            f"makes light negative: its least gain is {minimum:.3g}", where=where, do="make it fall slower"
        )
    return optics


def read_thin_lens(prim: Usd.Prim, time: Usd.TimeCode, metres: float) -> ThinLens | None:
    """Read the thin lens of a camera in a stage of `metres` per unit; None, a pinhole, where its fStop is 0, USD's
    fallback.

    The aperture's diameter is focalLength / fStop; exposure:fStop only scales the exposure. Raises StageError for an
    fStop without an authored focal length, or without a focus distance.
    """
    camera = UsdGeom.Camera(prim)
    f_stop = float(value_in(prim, "fStop", F_STOPS, time))
    if f_stop == 0:
        return None
    if not camera.GetFocalLengthAttr().HasAuthoredValue():
        do = "author its focalLength in tenths of a scene unit, or set fStop to 0"
        raise StageError("has an fStop but no focalLength, so its aperture is unknown", where=prim.GetPath(), do=do)
    focal, focus = (float(read(a, time)) for a in (camera.GetFocalLengthAttr(), camera.GetFocusDistanceAttr()))
    if focus not in ABOVE_0 or focal not in ABOVE_0:
        found = f"has fStop {f_stop:g}, but focusDistance {focus:g} and focalLength {focal:g}"
        raise StageError(found, where=prim.GetPath(), do="make both positive, or set fStop to 0")
    return ThinLens(radius=focal * FOCAL_UNITS * metres / (2 * f_stop), focus=focus * metres)
