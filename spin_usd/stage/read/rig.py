"""Objects in the axes of a camera: the stage's other cameras, its LiDAR and its laser range finder."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, TypeVar

from pxr import Usd, UsdGeom

from spin_usd.errors import GeometryError, StageError
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.frames import T_CAM_USDCAM, T_USDCAM_CAM
from spin_usd.geometry.transform import Transform
from spin_usd.scene.lidar import Lidar, RangeFinder
from spin_usd.scene.scene import Rig
from spin_usd.stage.read.body_reader import common_frame
from spin_usd.stage.read.camera import read_camera
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.time_variation import CachedIfConstant, moves, varying
from spin_usd.stage.usd.transforms import between, check_chain, placement, placement_below
from spin_usd.stage.usd.values import read, typed_value

T = TypeVar("T")


def rig_in_time(
    cameras: Mapping[str, Usd.Prim], camera: Usd.Prim, metres: float
) -> tuple[CachedIfConstant[Rig | None], CachedIfConstant[tuple[Camera, Transform]]]:
    """Return in time the place of `camera` among `cameras`, None for a single one; and the intrinsics of the camera
    paired with it, with T_pair_cam. `metres`: the length of a stage unit."""
    (name,) = (each for each, prim in cameras.items() if prim == camera)
    first, *others = cameras.values()
    pair = first if camera != first else others[0] if others else camera
    varies = any(moves(prim) for prim in (first, camera, pair))

    def rig(time: Usd.TimeCode) -> Rig | None:
        return Rig(camera=name, T_first_cam=placed(camera, first, metres, time)) if others else None

    def paired(time: Usd.TimeCode) -> tuple[Camera, Transform]:
        other = pair if camera == first else camera
        T_first_other = placed(other, first, metres, time)
        return read_camera(pair, time), T_first_other.inverse() if camera == first else T_first_other

    return CachedIfConstant(varies, rig), CachedIfConstant(varies or bool(varying(pair)), paired)


def lidar_in_time(stage: Usd.Stage, camera: Usd.Prim, metres: float) -> CachedIfConstant[Lidar | None]:
    """Return the LiDAR of the stage, of `metres` per unit, in time; None where it has none. Raises StageError for
    several."""
    return _in_time(stage, camera, schema.LIDAR_API, "LiDAR", partial(read_lidar, camera, metres))


def range_finder_in_time(stage: Usd.Stage, camera: Usd.Prim, metres: float) -> CachedIfConstant[RangeFinder | None]:
    """Return the laser range finder of the stage likewise."""
    of_prim = partial(read_range_finder, camera, metres)
    return _in_time(stage, camera, schema.RANGE_FINDER_API, "laser range finder", of_prim)


def placed(prim: Usd.Prim, camera: Usd.Prim, metres: float, time: Usd.TimeCode) -> Transform:
    """Compute T_cam_prim, metres, of a prim that looks along -z as cameras do, its axes being as OpenCV has a
    camera's."""
    return mounted(prim, camera, metres, time, frame="usdcam") @ T_USDCAM_CAM


def mounted(prim: Usd.Prim, camera: Usd.Prim, metres: float, time: Usd.TimeCode, *, frame: str) -> Transform:
    """Compute how `prim`, whose axes are called `frame`, stands in the axes of the `camera`, metres; units are applied
    last, as to the target's pose."""
    above, world = common_frame(camera, prim), UsdGeom.XformCache(time)
    unit = placement(world.GetLocalToWorldTransform(above), frame="above", metres=1.0, where=above.GetPath()).scale
    usdcam, other = (
        placement_below(above, each, world, frame=name).transform for each, name in ((camera, "usdcam"), (prim, frame))
    )
    near = between(usdcam, other)
    translation = near.translation * (unit * metres)
    return T_CAM_USDCAM @ Transform.unchecked(to=near.to, of=near.of, rotation=near.rotation, translation=translation)


def _in_time(
    stage: Usd.Stage, camera: Usd.Prim, api: str, name: str, of_prim: Callable[[Usd.Prim, Usd.TimeCode], T]
) -> CachedIfConstant[T | None]:
    """Return in time the result of `of_prim` for the stage's only prim with the API schema `api`, called `name` in
    messages, which is placed by the `camera`; None if there is none. Raises StageError for several."""
    prims = [prim for prim in stage.Traverse() if prim.HasAPI(api)]
    if not prims:
        return CachedIfConstant(False, lambda time: None)
    if len(prims) > 1:
        names = ", ".join(str(prim.GetPath()) for prim in prims[:5])
        do = "keep one of them active, and render the stage again with another"
        raise StageError(f"the stage has {len(prims)} {name}s ({names})", where=prims[1].GetPath(), do=do)
    (prim,) = prims
    check_chain(prim)
    return CachedIfConstant(bool(varying(prim)) or moves(prim) or moves(camera), partial(of_prim, prim))


def read_range_finder(camera: Usd.Prim, metres: float, prim: Usd.Prim, time: Usd.TimeCode) -> RangeFinder:
    """Read the laser range finder `prim` at `time`. Raises StageError that names it."""
    divergence = float(read(prim.GetAttribute(schema.RANGE_FINDER_DIVERGENCE), time))
    try:
        return RangeFinder(T_cam_finder=placed(prim, camera, metres, time), divergence_deg=divergence)
    except GeometryError as error:
        raise StageError(error.found, where=prim.GetPath(), do="correct its spin:rangeFinder:divergence") from None


def read_lidar(camera: Usd.Prim, metres: float, prim: Usd.Prim, time: Usd.TimeCode) -> Lidar:
    """Read the LiDAR `prim` at `time`. Raises StageError that names it and the number that is wrong."""
    values = {field: typed_value(prim, name, time) for field, name in schema.LIDAR.items()}
    try:
        return Lidar(
            T_cam_lidar=mounted(prim, camera, metres, time, frame="lidar"), **{k: _plain(v) for k, v in values.items()}
        )
    except GeometryError as error:
        raise StageError(error.found, where=prim.GetPath(), do="correct its spin:lidar:* attributes") from None


def _plain(value: Any) -> Any:
    """Return a vector as a tuple; everything else unchanged."""
    return value if isinstance(value, str | int | float) else tuple(value)
