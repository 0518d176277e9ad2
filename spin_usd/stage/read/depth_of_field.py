"""The camera's aperture and focus, as USD gives them: depth of field."""

from pxr import Usd, UsdGeom

from spin_usd.errors import StageError
from spin_usd.scene.model import ThinLens
from spin_usd.stage.usd.values import ABOVE_0, Range, read, value_in

FOCAL_UNITS = 0.1  # scene units in which USD gives a focal length
F_STOPS = Range(0.1, 1e6, or_0=True)  # from below the fastest lenses (0.5) to pinholes


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
