"""URSO as it lies: a list of images and one of poses for each split, in Unreal's axes."""

import numpy as np

from spin_usd.audit.annotated_set import AnnotatedPicture, AnnotatedSet, AnnotatedTarget
from spin_usd.exchange.sets.set_folder import SetFolder, cells_or_nan
from spin_usd.exchange.sets.set_format import PoseFields, SetFormat
from spin_usd.exchange.urso import HEAD, IMAGES, POSITION, QUATERNION
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.geometry.camera import Camera

CAMERA = Camera(width=1280, height=960, fx=640.0, fy=640.46, cx=640.0, cy=480.0)
"""Of the published sets; the layout has no camera file."""
LIST = r"(?P<at>(?:.*/)?)(?P<split>[A-Za-z]+)_poses_gt\.csv"


def _recognises(folder: SetFolder) -> str:
    lists = [match.group() for match in folder.matching(LIST)]
    name = next((name for name in lists if folder.head(name).replace(" ", "").startswith(HEAD)), "")
    return f"{name} holds the columns {HEAD} beside a list of images" if name else ""


def _read_set(folder: SetFolder) -> AnnotatedSet:
    pictures = []
    for match in folder.matching(LIST):
        at, split = match["at"], match["split"]
        lines = folder.head(f"{at}{split}{IMAGES}", MAX_POSE_LIST).splitlines()
        names = [line.strip() for line in lines if line.strip()]
        rows = list(folder.rows(match.group()))
        if len(names) != len(rows):
            folder.fault("files", match.group(), f"has {len(rows)} poses for {len(names)} images in {split}{IMAGES}")
        for name, (place, row) in zip(names, rows, strict=False):
            image = folder.image(name, at, f"{at}images/", f"{at}{split}/")
            forward, right, up = cells_or_nan(row, POSITION)
            q1, q2, q3, q4 = cells_or_nan(row, QUATERNION)
            target = AnnotatedTarget(
                id="target", rotation=np.array([q4, q1, q2, q3]), t_cam_body=np.array([right, -up, forward])
            )
            pictures.append(
                AnnotatedPicture(
                    name=image or name,
                    exists=bool(image),
                    place=place,
                    split=split,
                    camera=CAMERA if image and folder.size(image) == (1280, 960) else None,
                    targets=(target,),
                )
            )
    mirror = np.array([1, 1, -1, 1])
    return AnnotatedSet(
        pictures=pictures, faults=folder.faults, q_cam_body=lambda q: q * mirror, other_axes=True, scalar_last=True
    )


URSO_SET = SetFormat(
    name="urso",
    recognises=_recognises,
    read=_read_set,
    fields=PoseFields(files=LIST, rotation=QUATERNION, position=POSITION, scalar_last=True),
)
