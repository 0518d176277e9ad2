"""What stands in the axes of a camera: the stage's other cameras, and its LiDAR."""

from collections.abc import Mapping

from pxr import Usd, UsdGeom

from spin_usd.geometry.camera import Camera
from spin_usd.geometry.frames import T_CAM_USDCAM, T_USDCAM_CAM
from spin_usd.geometry.transform import Transform
from spin_usd.scene.model import Rig
from spin_usd.stage.read.body_reader import common_frame
from spin_usd.stage.read.camera import read_camera
from spin_usd.stage.usd.time_variation import CachedIfConstant, moves, varying
from spin_usd.stage.usd.transforms import between, placement, placement_below


def rig_in_time(
    cameras: Mapping[str, Usd.Prim], camera: Usd.Prim, metres: float
) -> tuple[CachedIfConstant[Rig | None], CachedIfConstant[tuple[Camera, Transform]]]:
    """Return in time which of `cameras` the `camera` is, None where there is one alone; and the intrinsics of the one
    that is paired with it, with T_pair_cam. `metres`: the length of a stage unit."""
    (name,) = (each for each, prim in cameras.items() if prim == camera)
    first, *others = cameras.values()
    pair = first if camera != first else others[0] if others else camera
    varies = any(moves(prim) for prim in (first, camera, pair))

    def rig(time: Usd.TimeCode) -> Rig | None:
        return Rig(camera=name, T_first_cam=_placed(camera, first, metres, time)) if others else None

    def paired(time: Usd.TimeCode) -> tuple[Camera, Transform]:
        other = pair if camera == first else camera
        T_first_other = _placed(other, first, metres, time)
        return read_camera(pair, time), T_first_other.inverse() if camera == first else T_first_other

    return CachedIfConstant(varies, rig), CachedIfConstant(varies or bool(varying(pair)), paired)


def _placed(camera: Usd.Prim, first: Usd.Prim, metres: float, time: Usd.TimeCode) -> Transform:
    """Compute T_first_cam, metres."""
    return mounted(camera, first, metres, time, frame="usdcam") @ T_USDCAM_CAM


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
