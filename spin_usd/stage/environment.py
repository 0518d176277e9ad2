"""What lies behind the target, at a time, in camera axes: SpinPlanetAPI, SpinStarsAPI, SpinBackPlateAPI."""

from pxr import Usd, UsdGeom

from spin_usd.arrays import Float
from spin_usd.errors import StageError
from spin_usd.geometry.frames import T_CAM_USDCAM
from spin_usd.geometry.transform import Transform
from spin_usd.scene.environment import Environment
from spin_usd.stage import schema
from spin_usd.stage.back_plate import read_back_plate
from spin_usd.stage.drawn import PROXIES, ancestors, is_always_invisible
from spin_usd.stage.images import Images
from spin_usd.stage.planet import read_planet, refuse_hidden_target
from spin_usd.stage.ranges import refuse_unapplied
from spin_usd.stage.stars import read_stars
from spin_usd.stage.xforms import between, check_chain, placement

APIS = {
    schema.PLANET_API: "spin:planet:",
    schema.STARS_API: "spin:stars:",
    schema.BACK_PLATE_API: "spin:backPlate:",
}


class EnvironmentReader:
    """Reads what `stage` says lies behind its target. Raises StageError for more than one back plate."""

    def __init__(self, stage: Usd.Stage, images: Images) -> None:
        self._images = images
        self._planets, self._stars, plates = (_find(stage, api) for api in APIS)
        if len(plates) > 1:
            found = f"there is another back plate, {plates[0].GetPath()}"
            raise StageError(found, where=plates[1].GetPath(), do="keep one, with the images of both")
        self._plate = plates[0] if plates else None

    def read(
        self,
        time: Usd.TimeCode,
        target_cam: Float,
        target_radius: float,
        T_world_usdcam: Transform,
        world: UsdGeom.XformCache,
        metres: float,
    ) -> Environment:
        """What is visible at `time`, behind a target in the ball of `target_radius`, metres, around `target_cam` (3,),
        camera frame. `world` is of that time; a stage unit is `metres`.

        Raises StageError, UnsupportedError for a planet that is not behind the target.
        """

        def placed(prim: Usd.Prim) -> tuple[Transform, float]:
            """T_cam_prim, and the metres of the prim's own unit."""
            matrix = world.GetLocalToWorldTransform(prim)
            found = placement(matrix, frame="prim", metres=metres, where=prim.GetPath())
            return T_CAM_USDCAM @ between(T_world_usdcam, found.transform), found.scale * metres

        def visible(prims: list[Usd.Prim]) -> list[Usd.Prim]:
            return [p for p in prims if UsdGeom.Imageable(p).ComputeVisibility(time) != UsdGeom.Tokens.invisible]

        plates = visible([self._plate] if self._plate else [])
        planets = tuple(read_planet(prim, time, *placed(prim), self._images) for prim in visible(self._planets))
        refuse_hidden_target(planets, target_cam, target_radius)
        return Environment(
            planets=planets,
            stars=tuple(read_stars(prim, time, placed(prim)[0]) for prim in visible(self._stars)),
            back_plate=read_back_plate(plates[0], time, self._images) if plates else None,
        )


def _find(stage: Usd.Stage, api: str) -> list[Usd.Prim]:
    """The prims with the API schema that can be visible."""
    found = []
    for prim in Usd.PrimRange.Stage(stage, PROXIES):
        if not prim.HasAPI(api):
            refuse_unapplied(prim, APIS[api], api)
        elif not any(is_always_invisible(p) for p in (*ancestors(prim), prim)):
            if not prim.IsA(UsdGeom.Imageable):
                raise StageError(f"has {api}, but no type", where=prim.GetPath(), do="make it an Xform")
            check_chain(prim)
            found.append(prim)
    return found
