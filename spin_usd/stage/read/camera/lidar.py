"""The stage's LiDAR: a prim with SpinLidarAPI, and how it stands to the camera."""

from functools import partial
from typing import Any

from pxr import Usd, UsdGeom

from spin_usd.errors import GeometryError, StageError
from spin_usd.geometry.frames import T_CAM_USDCAM
from spin_usd.geometry.transform import Transform
from spin_usd.scene.lidar.lidar import Lidar
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.time_variation import CachedIfConstant, moves, varying
from spin_usd.stage.usd.transforms import between, check_chain, nearest_ancestor, placement, placement_below
from spin_usd.stage.usd.values import typed_value


def lidar_in_time(stage: Usd.Stage, camera: Usd.Prim, metres: float) -> CachedIfConstant[Lidar | None]:
    """Return the LiDAR of the stage, of `metres` per unit, in time; None where it has none. Raises StageError for
    several."""
    prims = [prim for prim in stage.Traverse() if prim.HasAPI(schema.LIDAR_API)]
    if not prims:
        return CachedIfConstant(False, lambda time: None)
    if len(prims) > 1:
        names = ", ".join(str(prim.GetPath()) for prim in prims[:5])
        do = "keep one of them active, and render the stage again with another"
        raise StageError(f"the stage has {len(prims)} LiDARs ({names})", where=prims[1].GetPath(), do=do)
    (prim,) = prims
    check_chain(prim)
    varies = bool(varying(prim)) or moves(prim) or moves(camera)
    return CachedIfConstant(varies, partial(read_lidar, prim, camera, metres))


def read_lidar(prim: Usd.Prim, camera: Usd.Prim, metres: float, time: Usd.TimeCode) -> Lidar:
    """Read the LiDAR `prim` at `time`. Raises StageError that names it and the number that is wrong."""
    values = {field: typed_value(prim, name, time) for field, name in schema.LIDAR.items()}
    try:
        return Lidar(T_cam_lidar=_mounting(prim, camera, metres, time), **{k: _plain(v) for k, v in values.items()})
    except GeometryError as error:
        raise StageError(error.found, where=prim.GetPath(), do="correct its spin:lidar:* attributes") from None


def _mounting(prim: Usd.Prim, camera: Usd.Prim, metres: float, time: Usd.TimeCode) -> Transform:
    """Compute T_cam_lidar, metres; units are applied last, as to the target's pose."""
    above, world = nearest_ancestor(camera, prim), UsdGeom.XformCache(time)
    unit = placement(world.GetLocalToWorldTransform(above), frame="above", metres=1.0, where=above.GetPath()).scale
    usdcam, lidar = (
        placement_below(above, each, world, frame=frame).transform
        for each, frame in ((camera, "usdcam"), (prim, "lidar"))
    )
    near = between(usdcam, lidar)
    translation = near.translation * (unit * metres)
    return T_CAM_USDCAM @ Transform.unchecked(to=near.to, of=near.of, rotation=near.rotation, translation=translation)


def _plain(value: Any) -> Any:
    """Return a vector as a tuple; everything else as it is."""
    return value if isinstance(value, str | int | float) else tuple(value)
