"""SpaceSense-Bench as it lies: sequences of images, depth, parts in colours and poses in the axes of AirSim.

A row has the target's position and quaternion in the camera's axes, x forward, y right, z down; depth is an array of
whole millimetres, 10 km for nothing. The camera sees 50 degrees. Sources: the set's page (wuaodi/SpaceSense-Bench), its
`project_lidar2img.py` for camera and axes, and its example data for depth.
"""

from math import radians, tan

import numpy as np

from spin_usd.audit.annotated_set import AnnotatedPicture, AnnotatedSet, AnnotatedTarget, DepthSource, MaskSource
from spin_usd.basics.arrays import Float
from spin_usd.exchange.sets.set_folder import SetFolder, cells_or_nan, number
from spin_usd.exchange.sets.set_format import PoseFields, SetFormat
from spin_usd.geometry.camera import Camera

SIDE, VIEW_DEG = 1024, 50.0
FOCAL = SIDE / 2 / tan(radians(VIEW_DEG / 2))
CAMERA = Camera(width=SIDE, height=SIDE, fx=FOCAL, fy=FOCAL, cx=SIDE / 2, cy=SIDE / 2)
NOTHING_M = 1e4
SPLITS = ("train", "val", "test")
"""Folders between that of a craft and those of its sequences."""
T_CV_AIRSIM = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])
Q_CV_AIRSIM = np.array([0.5, -0.5, -0.5, -0.5])  # the same rotation
LIST = r"(?P<at>.*/)?pose_ground_truth\.csv"
AXIS = "target_spacecraft_in_camera_"
POSITION = tuple(f"{AXIS}pos_{axis}(m)" for axis in "xyz")
QUATERNION = tuple(f"{AXIS}quat_{axis}" for axis in "wxyz")


def _recognises(folder: SetFolder) -> str:
    lists = (match.group() for match in folder.matching(LIST) if AXIS in folder.head(match.group()))
    name = next(lists, "")
    return f"{name} holds columns such as {POSITION[0]}" if name else ""


def _read(folder: SetFolder) -> AnnotatedSet:
    pictures = []
    for match in folder.matching(LIST):
        at = match["at"] or ""
        above = [part for part in at.split("/")[:-2] if part not in SPLITS]
        craft = above[-1] if above else "target"
        for place, row in folder.rows(match.group()):
            stamp = row.get("timestamp", "").strip()
            image = folder.first(f"{at}image/{stamp}.png")
            mask, depth = folder.first(f"{at}seg/{stamp}.png"), folder.first(f"{at}depth/{stamp}.npz")
            target = AnnotatedTarget(
                id=craft,
                rotation=cells_or_nan(row, QUATERNION),
                t_cam_body=T_CV_AIRSIM @ cells_or_nan(row, POSITION),
                mask=MaskSource(file=mask) if mask else None,
            )
            pictures.append(
                AnnotatedPicture(
                    name=image or f"{at}image/{stamp}.png",
                    exists=bool(image),
                    place=place,
                    sequence=match.group(),
                    camera=CAMERA,
                    targets=(target,),
                    depth=DepthSource(file=depth, metres=1e-3, nothing=NOTHING_M) if depth else None,
                    time=number(stamp),
                )
            )
    return AnnotatedSet(pictures=pictures, faults=folder.faults, q_cam_body=_q_cam_body, other_axes=True)


def _q_cam_body(q: Float) -> Float:
    """Return the quaternions (N, 4) in OpenCV's axes of the camera."""
    a, (scalar, vector) = Q_CV_AIRSIM, (q[:, :1], q[:, 1:])
    turned = a[0] * vector + scalar * a[1:] + np.cross(np.broadcast_to(a[1:], vector.shape), vector)
    return np.concatenate([a[0] * scalar - (vector @ a[1:])[:, None], turned], 1)


SPACESENSE_SET = SetFormat(
    name="spacesense",
    recognises=_recognises,
    read=_read,
    fields=PoseFields(files=LIST, rotation=QUATERNION, position=POSITION),
)
