"""The camera's axes at one time, in which lights and environment are read."""

from dataclasses import dataclass

from pxr import Usd, UsdGeom

from spin_usd.geometry.frames import T_CAM_USDCAM
from spin_usd.geometry.transform import Transform
from spin_usd.stage.usd.transforms import between, placement


@dataclass(frozen=True, kw_only=True, eq=False)
class CameraSpace:
    """The camera's axes at `time`."""

    time: Usd.TimeCode
    world: UsdGeom.XformCache
    """The transforms of that time."""
    T_world_usdcam: Transform
    """The camera's pose, metres."""
    metres: float
    """The length of a stage unit."""

    @property
    def T_cam_world(self) -> Transform:
        """The world's axes in the camera's."""
        return T_CAM_USDCAM @ self.T_world_usdcam.inverse()

    def from_world(self, T_world_prim: Transform) -> Transform:
        """Compute T_cam_prim, metres."""
        return T_CAM_USDCAM @ between(self.T_world_usdcam, T_world_prim)

    def placed(self, prim: Usd.Prim) -> tuple[Transform, float]:
        """Compute T_cam_prim, metres, and the length of the prim's own unit, metres."""
        matrix = self.world.GetLocalToWorldTransform(prim)
        found = placement(matrix, frame="prim", metres=self.metres, where=prim.GetPath())
        return self.from_world(found.transform), found.scale * self.metres
