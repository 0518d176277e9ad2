"""The environment behind the target, at a time, in camera axes: SpinPlanetAPI, SpinStarsAPI, SpinBackPlateAPI."""

from collections.abc import Callable
from functools import lru_cache, partial
from math import radians
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike
from pxr import Usd, UsdGeom, UsdLux

from spin_usd.basics.arrays import Float, frozen
from spin_usd.basics.identity_memo import IdentityMemo
from spin_usd.errors import StageError
from spin_usd.geometry.transform import Transform
from spin_usd.scene.environment import BackPlate, Environment, Planet, Stars
from spin_usd.stage.composition.images import Images
from spin_usd.stage.read.emission import EMISSIONS
from spin_usd.stage.read.planet import read_planet
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.camera_space import CameraSpace
from spin_usd.stage.usd.prim_order import in_order
from spin_usd.stage.usd.time_variation import CachedIfConstant, CameraSpaceCache, varying
from spin_usd.stage.usd.transforms import check_chain
from spin_usd.stage.usd.values import SHARE, Range, array, read, refuse_unapplied, value_in
from spin_usd.stage.usd.visibility import PROXIES, ancestors, is_always_invisible

T = TypeVar("T")
APIS = {
    schema.PLANET_API: "spin:planet:",
    schema.STARS_API: "spin:stars:",
    schema.BACK_PLATE_API: "spin:backPlate:",
}
ROLLS = Range(-360, 360)  # degrees: a whole turn either way
LIMITS = Range(-30, 10)  # half a million stars; fainter ones do not show beside a spacecraft
MAGNITUDES = Range(-30, 40)  # the Sun has -26.8; the faintest that were ever seen have 31
LENGTHS = Range(1e-100, 1e100)  # of direction vectors, whose squares must be finite and not 0
TEMPERATURES = Range(1000, 100_000)  # UsdLux gives one blue for all from 10,000 K up, which is close
# Irradiance of apparent bolometric magnitude 0, W/m2. Source: IAU 2015 resolution B2. The Sun's 1361 W/m2 are -26.83.
ZERO_MAGNITUDE = 2.518021002e-8
# Stars down to magnitude 6.5, and the slope of their number's decimal logarithm. The Yale Bright Star Catalogue (5th
# edition) has 9,096 down to about there; equally bright stars throughout space would give a slope of 0.6, dust and the
# galaxy's edge leave some 0.5 at these magnitudes (Allen's Astrophysical Quantities, star counts).
BRIGHT_STARS = 9000
BRIGHT_LIMIT = 6.5
SLOPE = 0.51


class EnvironmentReader:
    """Reads the environment of `stage`. Raises StageError for more than one back plate."""

    def __init__(self, stage: Usd.Stage, images: Images) -> None:
        self._images = images
        self._planets, self._stars, plates = (_find(stage, api) for api in APIS)
        if len(plates) > 1:
            found = f"there is another back plate, {plates[0].GetPath()}"
            raise StageError(found, where=plates[1].GetPath(), do="keep one, with the images of both")
        self._plate = plates[0] if plates else None
        self._cache = CameraSpaceCache([*self._planets, *self._stars, *plates])
        self._listed = {
            str(prim.GetPath()): CachedIfConstant(bool(varying(prim)), partial(read_stars, prim))
            for prim in self._stars
        }
        self._last = IdentityMemo[Environment]()

    @property
    def still(self) -> bool:
        """Return whether nothing in the environment ever changes or moves in the world."""
        return self._cache.all_still

    def read(self, space: CameraSpace) -> Environment:
        """Read the visible environment. It is the same object as long as the camera's pose is, and nothing in it
        varies. Raises StageError, UnsupportedError."""
        time = space.time

        def read(prims: list[Usd.Prim], one: Callable[[Usd.Prim], T]) -> tuple[T, ...]:
            """Read the visible ones of `prims`; the same tuple again where nothing moved or changed."""
            if not prims:
                return ()
            pose = space.T_world_usdcam
            each = (self._cache.read(prim, pose, partial(_if_visible, prim, time, one)) for prim in prims)
            return self._cache.same_tuple(one.__name__, tuple(value for value in each if value is not None))

        def planet(prim: Usd.Prim) -> Planet:
            return read_planet(prim, time, *space.placed(prim), self._images)

        def stars(prim: Usd.Prim) -> Stars:
            return self._listed[str(prim.GetPath())].at(time).turned(_sky(space.placed(prim)[0]))

        def plate(prim: Usd.Prim) -> BackPlate:
            return read_back_plate(prim, time, self._images)

        planets, skies = read(self._planets, planet), read(self._stars, stars)
        plates = read([self._plate] if self._plate else [], plate)
        return self._last.of(
            (planets, skies, plates),
            lambda: Environment(planets=planets, stars=skies, back_plate=plates[0] if plates else None),
        )


def _if_visible(prim: Usd.Prim, time: Usd.TimeCode, read: Callable[[Usd.Prim], T]) -> T | None:
    """Return the value of `read` for `prim`, or None where it is invisible at `time`."""
    return None if UsdGeom.Imageable(prim).ComputeVisibility(time) == UsdGeom.Tokens.invisible else read(prim)


def _find(stage: Usd.Stage, api: str) -> list[Usd.Prim]:
    """Find the prims with the API schema that can be visible."""
    found = []
    for prim in Usd.PrimRange.Stage(stage, PROXIES):
        if not prim.HasAPI(api):
            refuse_unapplied(prim, APIS[api], api)
        elif not any(is_always_invisible(p) for p in (*ancestors(prim), prim)):
            if not prim.IsA(UsdGeom.Imageable):
                raise StageError(f"has {api}, but no type", where=prim.GetPath(), do="make it an Xform")
            check_chain(prim)
            found.append(prim)
    return in_order(found)


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
        images=tuple(
            images.read(file, colours_of(file.path), prim, one_of_many=True, upright=True).image for file in files
        ),
        radiance=value_in(prim, schema.BACK_PLATE_RADIANCE, EMISSIONS, time),
        probability=value_in(prim, schema.BACK_PLATE_PROBABILITY, SHARE, time),
        roll=(radians(low), radians(high)),
        mirror=value_in(prim, schema.BACK_PLATE_MIRROR, SHARE, time),
    )


def colours_of(name: str) -> str:
    """Return the colour space of the picture in a file of that name: photographs are sRGB, also grey and 16-bit ones,
    which "auto" takes as data."""
    return "sRGB" if name.lower().endswith((".png", ".jpg", ".jpeg")) else "auto"


def _sky(T_cam_prim: Transform) -> Transform:
    """Return the attitude of stars, which are at infinity, from where their prim is."""
    return Transform(to="cam", of="sky", rotation=T_cam_prim.rotation, translation=np.zeros(3))


def read_stars(prim: Usd.Prim, time: Usd.TimeCode) -> Stars:
    """Read the stars at `time`, in their own axes. Raises StageError with their path."""
    directions, magnitudes = _catalogue(prim, time)
    if not len(directions):
        limit = value_in(prim, schema.STARS_LIMITING_MAGNITUDE, LIMITS, time)
        seed = value_in(prim, schema.STARS_SEED, Range(0), time)
        directions, magnitudes = random_stars(seed, limit)
    return Stars(
        path=str(prim.GetPath()),
        T_cam_sky=Transform(to="cam", of="sky", rotation=np.eye(3), translation=np.zeros(3)),
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
    """Return colours (N, 3) of unit luminance: white, or of the listed temperatures."""
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


def irradiance(magnitude: ArrayLike) -> Float:
    """W/m2, over all wavelengths, of stars of apparent bolometric `magnitude`."""
    return ZERO_MAGNITUDE * 10 ** (-0.4 * np.asarray(magnitude, np.float64))


def star_count(limit: float) -> int:
    """Return the number of stars brighter than magnitude `limit`."""
    return round(BRIGHT_STARS * 10 ** (SLOPE * (limit - BRIGHT_LIMIT)))


@lru_cache(maxsize=2)
def random_stars(seed: int, limit: float) -> tuple[Float, Float]:
    """Directions (N, 3), unit, uniform over the sphere, and magnitudes (N,) of `star_count(limit)` stars."""
    rng, count = np.random.default_rng(seed), star_count(limit)
    directions = rng.standard_normal((count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    # The share of the stars brighter than m is 10 ** (SLOPE * (m - limit)).
    magnitudes = limit + np.log10(1 - rng.random(count)) / SLOPE
    return frozen(directions), frozen(magnitudes)
