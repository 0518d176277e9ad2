"""The frames, and the one constant that joins USD's cameras to computer vision's.

`cam`     OpenCV camera: x right, y down, z forward, metres.
`usdcam`  USD and Blender camera: x right, y up, looking along -z, metres.
`body`    the target's own axes, metres.
`world`   the stage, metres, double precision.
`mesh`    a mesh's own axes before its transforms.

`T_cam_body` maps body to camera, `p_cam = T_cam_body @ p_body`: equal letters touch and cancel.
"""

import numpy as np

from spin_usd.geometry.transform import Transform

T_CAM_USDCAM = Transform(to="cam", of="usdcam", rotation=np.diag([1.0, -1.0, -1.0]), translation=np.zeros(3))
T_USDCAM_CAM = T_CAM_USDCAM.inverse()
