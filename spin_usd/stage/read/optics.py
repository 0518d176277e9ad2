"""The camera's optics: SpinOpticsAPI."""

from pxr import Usd

from spin_usd.errors import StageError
from spin_usd.geometry.camera import Camera
from spin_usd.scene.derived.vignetting import least_gain
from spin_usd.scene.sensor import Optics
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import SHARE, Range, refuse_unapplied, typed_value, value_in

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
