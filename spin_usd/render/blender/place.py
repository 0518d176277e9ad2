"""Where something stands in Blender's world, to float32's last digit."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from mathutils import Matrix  # type: ignore[import-not-found]

from spin_usd.arrays import Float
from spin_usd.errors import RenderError
from spin_usd.geometry.frames import T_USDCAM_CAM
from spin_usd.geometry.transform import Transform
from spin_usd.render.camera_shader import View

FLOAT32 = 2.0**-23  # relative rounding of what Blender stores


@dataclass(frozen=True, kw_only=True, eq=False)
class Place:
    """rotation (3, 3) and location (3,) of some axes in Blender's world, metres; the parent of all that has one."""

    rotation: Float
    location: Float
    parent: Any

    @classmethod
    def of(cls, T_cam: Transform, view: View, parent: Any) -> "Place":
        """Relative to the target's centre first, in doubles: far away Blender's world has its origin there."""
        location = T_USDCAM_CAM.points(T_cam.translation - view.centre) + view.target_location
        return cls(rotation=T_USDCAM_CAM.rotation @ T_cam.rotation, location=location, parent=parent)

    @property
    def axis(self) -> Float:
        """(3,) unit, along which a light here shines: its -z."""
        return -self.rotation[:, 2]

    def move(self, shown: Any, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> None:
        """Put an object here.

        The matrix goes through the parent's inverse, which keeps each entry to float32's rounding; through a quaternion
        it was up to 17 times less exact.
        """
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = self.rotation * scale, self.location
        shown.parent = self.parent
        shown.matrix_parent_inverse = Matrix(matrix)
        if not np.allclose(np.array(shown.matrix_parent_inverse), matrix, rtol=FLOAT32, atol=FLOAT32):
            raise RenderError("Blender changed the place of an object")
