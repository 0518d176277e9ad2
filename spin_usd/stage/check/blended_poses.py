"""Rule: an exposure must not blend poses that do not belong to one motion.

USD interpolates between time samples. In a list of unrelated poses, whose time codes only count them, the poses between
two of them are not a real motion.
"""

from bisect import bisect_left, bisect_right
from itertools import pairwise

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.geometry.blur import rotation_angle
from spin_usd.scene.model import Scene
from spin_usd.stage.read.body_reader import BodyReader
from spin_usd.stage.read.camera import find_camera
from spin_usd.stage.read.shutter import Opening, read_opening
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.stage.usd.visibility import ancestors

MAX_TURN_RAD = np.radians(30.0)  # from one time sample to the next


class BlendedPoses:
    """Collects the pictures whose exposure blends time samples that differ by more than one motion would.

    That is a rotation above MAX_TURN_RAD, or a path longer than the first target's size (twice the radius about its
    centre).
    """

    do = "bring shutter:open and shutter:close together, or give the poses the times of one motion"

    def __init__(self, reader: StageReader) -> None:
        self.pictures: list[str] = []
        self._camera, self._bodies = find_camera(reader.stage), reader.bodies
        self.where = str(reader.bodies[0].prim.GetPath())
        self._times = [self._moving_times(body.prim) for body in reader.bodies]

    @property
    def found(self) -> str:
        """The finding's message."""
        return (
            f"the exposures of {len(self.pictures)} pictures blend time samples between which a body rotates by "
            f"more than {np.degrees(MAX_TURN_RAD):g} degrees or moves by more than its size"
        )

    def add(self, scene: Scene) -> None:
        """Look at one picture of the reader's stage."""
        if scene.shutter is None:
            return
        opening = read_opening(self._camera, scene.frame.time_code, rows=scene.camera.height)
        size = 2 * scene.target.mesh.radius
        if any(self._blends(body, times, opening, size) for body, times in zip(self._bodies, self._times, strict=True)):
            self.pictures.append(scene.frame.name)

    def _moving_times(self, prim: Usd.Prim) -> list[float]:
        """List the times of all samples that move the prim or the camera."""
        moving = [each for end in (self._camera, prim) for each in (*ancestors(end), end)]
        ops = [op for each in moving for op in UsdGeom.Xformable(each).GetOrderedXformOps()]
        return sorted({float(time) for op in ops for time in op.GetTimeSamples()})

    def _blends(self, body: BodyReader, times: list[float], opening: Opening, size: float) -> bool:
        """Return whether the exposure blends poses of `body`, sampled at `times`, that no motion joins."""
        first = bisect_right(times, opening.middle - opening.duration / 2) - 1
        last = bisect_left(times, opening.middle + opening.duration / 2)
        poses = [body.pose_at(time) for time in times[max(first, 0) : last + 1]]
        return any(
            rotation_angle(a, b) > MAX_TURN_RAD or np.linalg.norm(a.translation - b.translation) > size
            for a, b in pairwise(poses)
        )
