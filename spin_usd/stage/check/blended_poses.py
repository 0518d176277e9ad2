"""Rule: an exposure must not blend poses that do not belong to one motion.

USD interpolates between time samples. In a list of unrelated poses, whose time codes only count them, the poses between
two of them are not a real motion.
"""

from bisect import bisect_left, bisect_right
from itertools import pairwise

import numpy as np
from pxr import UsdGeom

from spin_usd.geometry.blur import rotation_angle
from spin_usd.scene.model import Scene
from spin_usd.stage.read.camera.camera import find_camera
from spin_usd.stage.read.camera.shutter import read_opening
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.stage.read.target.target import find_target
from spin_usd.stage.usd.visibility import ancestors

MAX_TURN_RAD = np.radians(30.0)  # from one time sample to the next


class BlendedPoses:
    """Collects the pictures whose exposure blends time samples that differ by more than one motion would.

    That is a rotation above MAX_TURN_RAD, or a path longer than the target's size (twice the radius about its centre).
    """

    do = "bring shutter:open and shutter:close together, or give the poses the times of one motion"

    def __init__(self, reader: StageReader) -> None:
        self.reader = reader
        self.pictures: list[str] = []
        self._camera, target = find_camera(reader.stage), find_target(reader.stage)
        self.where = str(target.GetPath())
        moving = [prim for end in (self._camera, target) for prim in (*ancestors(end), end)]
        ops = [op for prim in moving for op in UsdGeom.Xformable(prim).GetOrderedXformOps()]
        self._times = sorted({float(time) for op in ops for time in op.GetTimeSamples()})

    @property
    def found(self) -> str:
        """The finding's message."""
        return (
            f"the exposures of {len(self.pictures)} pictures blend time samples between which the target rotates by "
            f"more than {np.degrees(MAX_TURN_RAD):g} degrees or moves by more than its size"
        )

    def add(self, scene: Scene) -> None:
        """MaterialTemplate at one picture of the reader's stage."""
        if scene.shutter is None:
            return
        opening = read_opening(self._camera, scene.frame.time_code, rows=scene.camera.height)
        first = bisect_right(self._times, opening.middle - opening.duration / 2) - 1
        last = bisect_left(self._times, opening.middle + opening.duration / 2)
        poses = [self.reader.pose_at(time) for time in self._times[max(first, 0) : last + 1]]
        size = 2 * scene.target.mesh.radius
        if any(
            rotation_angle(a, b) > MAX_TURN_RAD or np.linalg.norm(a.translation - b.translation) > size
            for a, b in pairwise(poses)
        ):
            self.pictures.append(scene.frame.name)
