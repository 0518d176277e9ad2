"""The environment behind the target, at a time, in camera axes: SpinPlanetAPI, SpinStarsAPI, SpinBackPlateAPI."""

from collections.abc import Callable
from functools import partial
from typing import TypeVar

from pxr import Usd, UsdGeom

from spin_usd.errors import StageError
from spin_usd.last_value import LastValue
from spin_usd.scene.environment import BackPlate, Environment, Planet, Stars
from spin_usd.stage.composition.images import Images
from spin_usd.stage.read.environment.back_plate import read_back_plate
from spin_usd.stage.read.environment.planet import read_planet
from spin_usd.stage.read.environment.stars import read_stars
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.camera_space import CameraSpace
from spin_usd.stage.usd.prim_order import in_order
from spin_usd.stage.usd.time_variation import CameraSpaceCache
from spin_usd.stage.usd.transforms import check_chain
from spin_usd.stage.usd.values import refuse_unapplied
from spin_usd.stage.usd.visibility import PROXIES, ancestors, is_always_invisible

T = TypeVar("T")
APIS = {
    schema.PLANET_API: "spin:planet:",
    schema.STARS_API: "spin:stars:",
    schema.BACK_PLATE_API: "spin:backPlate:",
}


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
        self._last = LastValue[Environment]()

    @property
    def still(self) -> bool:
        """Return whether nothing in the environment ever changes or moves in the world."""
        return self._cache.all_still

    def read(self, space: CameraSpace) -> Environment:
        """Read what is visible. It is the same object as long as the camera's pose is and nothing in the environment
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
            return read_stars(prim, time, space.placed(prim)[0])

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
