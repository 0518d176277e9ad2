"""An image behind everything: SpinBackPlateAPI."""

from math import radians

from pxr import Usd

from spin_usd.errors import StageError
from spin_usd.scene.environment import BackPlate
from spin_usd.stage.composition.images import Images
from spin_usd.stage.read.lights.emission import EMISSIONS
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import SHARE, Range, read, value_in

ROLLS = Range(-360, 360)  # degrees: a whole turn either way


def read_back_plate(prim: Usd.Prim, time: Usd.TimeCode, images: Images) -> BackPlate:
    """Read the back plate at `time`. Raises StageError with its path."""
    files = [file for file in read(prim.GetAttribute(schema.BACK_PLATE_FILES), time) or () if file.path]
    if not files:
        where = f"{prim.GetPath()}.{schema.BACK_PLATE_FILES}"
        raise StageError("names no image", where=where, do="name one or more")
    low, high = value_in(prim, schema.BACK_PLATE_ROLL, ROLLS, time)
    if low > high:
        where = f"{prim.GetPath()}.{schema.BACK_PLATE_ROLL}"
        raise StageError(f"goes from {low:g} down to {high:g}", where=where, do="give the smaller angle first")
    return BackPlate(
        path=str(prim.GetPath()),
        images=tuple(images.read(file, "auto", prim).image for file in files),
        radiance=value_in(prim, schema.BACK_PLATE_RADIANCE, EMISSIONS, time),
        probability=value_in(prim, schema.BACK_PLATE_PROBABILITY, SHARE, time),
        roll=(radians(low), radians(high)),
        mirror=value_in(prim, schema.BACK_PLATE_MIRROR, SHARE, time),
    )
