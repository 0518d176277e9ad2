"""The lenses that calibrations of others name, and their coefficients as ours."""

from collections.abc import Sequence
from pathlib import Path

from spin_usd.errors import InputError
from spin_usd.geometry.fisheye import Fisheye

BROWN = ("plumb_bob", "radtan", "radial-tangential", "brown", "brown_conrady", "opencv", "pinhole", "none", "")
ORB_AND_BASALT = ("kannalabrandt8", "kb4")
FISHEYES = ("equidistant", "equi", "fisheye", "opencv_fisheye", "kannala_brandt", "kannala_brandt4", *ORB_AND_BASALT)
RATIONAL = ("rational_polynomial", "rational", "full_opencv", "pinhole_radtan8")
_PINHOLES = {each.replace("-", "_") for each in (*BROWN, *RATIONAL, "rectified")}


def is_fisheye(model: str) -> bool | None:
    """Return whether the lens of that name is a fisheye, None for an unknown name."""
    name = model.lower().replace("-", "_")
    return name in FISHEYES if name in (*FISHEYES, *_PINHOLES) else None


def distortion_of(values: Sequence[float], model: str, path: Path, *, ambiguous: bool = False) -> tuple[float, ...]:
    """Return the coefficients of a lens that a file calls `model`. Raises InputError for a model that we do not have,
    and for four coefficients without a model, which may be of either lens."""
    name, k = model.lower().replace("-", "_"), [float(each) for each in values]
    if name in FISHEYES:
        if any(k[4:]):
            raise InputError(f"has {len(k)} coefficients of a fisheye, expected four", where=path, do="give k1 to k4")
        return Fisheye(*k[:4], *[0.0] * (4 - len(k)))
    if name not in _PINHOLES:
        do = "calibrate it as OpenCV's pinhole (k1, k2, p1, p2, k3) or fisheye (k1, k2, k3, k4)"
        raise InputError(f"has a lens of the model {model!r}, which cannot be rendered", where=path, do=do)
    if ambiguous and not name and len(k) == 4 and any(k):
        do = "add distortion_model: plumb_bob, or equidistant"
        found = "has four coefficients without a model: k1, k2, p1, p2 or a fisheye's"
        raise InputError(found, where=path, do=do)
    if any(k[5:]):
        do = "calibrate without CALIB_RATIONAL_MODEL, CALIB_THIN_PRISM_MODEL and CALIB_TILTED_MODEL"
        found = "has more than k1, k2, p1, p2, k3 of OpenCV's lens, which cannot be rendered"
        raise InputError(found, where=path, do=do)
    return tuple(k[:5]) + (0.0,) * (5 - len(k))
