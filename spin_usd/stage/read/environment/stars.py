"""Stars: SpinStarsAPI."""

import numpy as np
from pxr import Usd, UsdLux

from spin_usd.arrays import Float
from spin_usd.errors import StageError
from spin_usd.geometry.transform import Transform
from spin_usd.scene.environment import Stars
from spin_usd.scene.photometry.star_field import irradiance, random_stars
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import Range, array, value_in

LIMITS = Range(-30, 10)  # half a million stars; fainter ones do not show beside a spacecraft
MAGNITUDES = Range(-30, 40)  # the Sun has -26.8; the faintest that were ever seen have 31
LENGTHS = Range(1e-100, 1e100)  # of direction vectors, whose squares must be finite and not 0
TEMPERATURES = Range(1000, 100_000)  # UsdLux gives one blue for all from 10,000 K up, which is close


def read_stars(prim: Usd.Prim, time: Usd.TimeCode, T_cam_prim: Transform) -> Stars:
    """Read the stars at `time`. Raises StageError with their path."""
    directions, magnitudes = _catalogue(prim, time)
    if not len(directions):
        limit = value_in(prim, schema.STARS_LIMITING_MAGNITUDE, LIMITS, time)
        seed = value_in(prim, schema.STARS_SEED, Range(0), time)
        directions, magnitudes = random_stars(seed, limit)
    return Stars(
        path=str(prim.GetPath()),
        T_cam_sky=Transform(to="cam", of="sky", rotation=T_cam_prim.rotation, translation=np.zeros(3)),
        directions=directions,
        irradiance=irradiance(magnitudes)[:, None] * _colors(prim, time, len(magnitudes)),
    )


def _catalogue(prim: Usd.Prim, time: Usd.TimeCode) -> tuple[Float, Float]:
    """Read the unit directions (N, 3) and magnitudes (N,) of the listed stars; N is 0 where none are listed."""
    directions = array(prim.GetAttribute(schema.STARS_DIRECTIONS), time, np.float64).reshape(-1, 3)
    magnitudes = array(prim.GetAttribute(schema.STARS_MAGNITUDES), time, np.float64)
    if len(directions) != len(magnitudes):
        found = f"lists {len(directions)} directions and {len(magnitudes)} magnitudes"
        raise StageError(found, where=prim.GetPath(), do="give each star both")
    _refuse_outside(prim, schema.STARS_MAGNITUDES, magnitudes, MAGNITUDES)
    length = np.linalg.norm(directions, axis=1, keepdims=True)
    _refuse_outside(prim, schema.STARS_DIRECTIONS, length[:, 0], LENGTHS, quantity="its length ")
    return directions / length, magnitudes


def _colors(prim: Usd.Prim, time: Usd.TimeCode, count: int) -> Float:
    """Return colours (N, 3) of unit luminance: white, or those of the listed temperatures."""
    temperatures = array(prim.GetAttribute(schema.STARS_TEMPERATURES), time, np.float64)
    if not len(temperatures):
        return np.ones((count, 3))
    if len(temperatures) != count:
        found = f"lists {len(temperatures)} temperatures for {count} stars"
        raise StageError(found, where=prim.GetPath(), do="list one for each star of a catalogue, or none")
    _refuse_outside(prim, schema.STARS_TEMPERATURES, temperatures, TEMPERATURES)
    return np.array([UsdLux.BlackbodyTemperatureAsRgb(float(kelvin)) for kelvin in temperatures])


def _refuse_outside(prim: Usd.Prim, name: str, values: Float, allowed: Range, quantity: str = "") -> None:
    """Raise StageError for the first of `values` (N,), one for each star, outside `allowed`."""
    for star in np.flatnonzero(~((values >= allowed.low) & (values <= allowed.high))):
        found = f"{quantity}is {values[star]:g}"
        raise StageError(found, where=f"{prim.GetPath()}.{name}[{star}]", do=f"choose {allowed}, or remove the star")
