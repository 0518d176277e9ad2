"""The placement of a light in Blender's world, to float32's last digit."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from spin_usd.arrays import Float
from spin_usd.geometry.frames import T_USDCAM_CAM
from spin_usd.geometry.transform import Transform
from spin_usd.renderers.blender.cycles.assign import assign_matrix
from spin_usd.renderers.camera_shader import View


@dataclass(frozen=True, kw_only=True, eq=False)
class LightPlacement:
    """rotation (3, 3) and location (3,) of some axes in Blender's world, metres; the parent of all that has one."""

    rotation: Float
    location: Float
    parent: Any

    @classmethod
    def of(cls, T_cam: Transform, view: View, parent: Any) -> "LightPlacement":
        """Return the placement of the axes T_cam in `view`, by doubles relative to the target's centre: far away
        Blender's world has its origin there."""
        location = T_USDCAM_CAM.points(T_cam.translation - view.centre) + view.location(view.centre)
        return cls(rotation=T_USDCAM_CAM.rotation @ T_cam.rotation, location=location, parent=parent)

    @property
    def axis(self) -> Float:
        """(3,) unit, along which a light here shines: its -z."""
        return -self.rotation[:, 2]

    def move(self, shown: Any, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> None:
        """Place an object here, `scale` times as large along its own axes."""
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = self.rotation * scale, self.location
        shown.parent = self.parent
        assign_matrix(shown, matrix)
