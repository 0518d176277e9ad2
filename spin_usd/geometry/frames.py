"""The frames, and the one constant that joins USD's cameras to computer vision's.

`cam`     OpenCV camera: x right, y down, z forward, metres.
`usdcam`  USD and Blender camera: x right, y up, looking along -z, metres.
`body`    the target's own axes, metres.
`world`   the stage, metres, double precision.
`mesh`    a mesh's own axes before its transforms.
`T_cam_body` maps body to camera, `p_cam = T_cam_body @ p_body`: equal letters touch and cancel.
"""

from collections.abc import Mapping

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.geometry.transform import Transform

T_CAM_USDCAM = Transform(to="cam", of="usdcam", rotation=np.diag([1.0, -1.0, -1.0]), translation=np.zeros(3))
T_USDCAM_CAM = T_CAM_USDCAM.inverse()
SYMMETRIES: Mapping[str, tuple[int, int, int]] = {
    "mirror x (plane y z)": (-1, 1, 1),
    "mirror y (plane z x)": (1, -1, 1),
    "mirror z (plane x y)": (1, 1, -1),
    "half turn about x": (1, -1, -1),
    "half turn about y": (-1, 1, -1),
    "half turn about z": (-1, -1, 1),
}
"""The sign that each symmetry gives to x, y and z, by its name for people."""


def symmetric(points: Float, symmetry: str) -> Float:
    """Return where the `symmetry`, one of SYMMETRIES, takes the points (..., 3), in body axes."""
    return points * np.array(SYMMETRIES[symmetry], np.float64) + 0.0  # no negative zeros
