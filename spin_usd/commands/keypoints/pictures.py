"""The keypoints in pictures of a dataset: their places, and whether the target hides them, as in records."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.commands.keypoints.calls import PICTURE_PART, CutPicture
from spin_usd.commands.keypoints.shown_target import ShownTarget
from spin_usd.errors import InputError
from spin_usd.geometry.region import Region
from spin_usd.geometry.transform import Transform
from spin_usd.picture.keypoint_states import keypoint_states
from spin_usd.processes.executor import Executor
from spin_usd.reading.dataset import Dataset
from spin_usd.reading.picture import Picture
from spin_usd.scene.body import Body
from spin_usd.scene.keypoints import Keypoints, KeypointState
from spin_usd.scene.scene import FrameId, OneBody
from spin_usd.scene.sensor import Sensor

KEPT = 64  # images that are kept: some megabytes
MARGIN = 0.15  # of the target's box in the picture, shown around it


@dataclass(frozen=True, kw_only=True, eq=False)
class Tile:
    """The shown part of a picture, around the target."""

    title: str
    region: Region
    """The same part, in pixels of the picture."""
    jpeg: str
    """The image of that part, as base64."""


class Pictures:
    """The pictures of a dataset, whose images a child decodes. Each is shown around the dataset's target of the same
    name, or else the first."""

    def __init__(self, folder: Path, target: ShownTarget, child: Executor[None]) -> None:
        """Open the dataset in `folder`. Raises InputError for one without pictures."""
        self._dataset, self._target, self._child = Dataset(folder), target, child
        if not len(self._dataset):
            raise InputError("holds no pictures", where=folder, do="render some first")
        ids = {each.name: each.id for each in reversed(self._dataset.targets)}
        self._id = ids.get(target.body.name, 1)
        self.note = (
            None if target.body.name in ids else f"{folder} shows {self._dataset.target}: it is taken for the same"
        )
        self.tile = lru_cache(KEPT)(self._tile)

    def __len__(self) -> int:
        return len(self._dataset)

    def places(self, number: int, keypoints: Keypoints) -> tuple[Float, Sequence[KeypointState]]:
        """Return the pixels (K, 2) of the keypoints in the picture of that number, NaN where the lens sees none, and
        their states; other bodies of the picture hide nothing here. None at all where the picture has no such
        target."""
        picture = self._dataset[number]
        pose = self._pose(picture)
        if pose is None:
            return np.zeros((0, 2)), ()
        return keypoint_states([self._scene(picture, pose, keypoints)], 0, self._target.caster)

    def _tile(self, number: int) -> Tile:
        picture = self._dataset[number]
        region = self._around(picture)
        part = CutPicture(dataset=str(picture.root), frame=picture.frame, variant=picture.variant, region=region)
        image = self._child.call(PICTURE_PART, part, reads=picture.root)
        return Tile(title=f"{picture.frame} ({picture.variant})", region=region, jpeg=image)

    def _around(self, picture: Picture) -> Region:
        """Return the part of the picture that shows the target, with a margin; all of it if that is unknown."""
        pose, frame = self._pose(picture), picture.camera.frame
        pixels = np.zeros((0, 2)) if pose is None else picture.camera.project(pose.points(self._target.mesh.hull))
        if not len(pixels) or not np.isfinite(pixels).all():
            return frame
        (x0, y0), (x1, y1) = np.floor(pixels.min(0)).astype(int).tolist(), np.ceil(pixels.max(0)).astype(int).tolist()
        around = Region(x0=x0, y0=y0, x1=x1, y1=y1).padded(round(MARGIN * max(x1 - x0, y1 - y0)) + 8) & frame
        return frame if around.empty else around

    def _pose(self, picture: Picture) -> Transform | None:
        """Return the target's pose; None where the picture has no such target."""
        for target in picture.targets:
            if target.id == self._id:
                return Transform.from_quaternion(to="cam", of="body", q=target.q_cam_body, t=target.t_cam_body)
        return None

    def _scene(self, picture: Picture, pose: Transform, keypoints: Keypoints) -> OneBody:
        """Return a scene of the target alone, unlit, which determines the states of its keypoints."""
        return OneBody(
            frame=FrameId(index=picture.index, name=picture.frame, time_code=picture.index, variant=picture.variant),
            camera=picture.camera,
            bodies=(Body(id=1, target=self._target.with_keypoints(keypoints), T_cam_body=pose),),
            lights=(),
            sensor=Sensor(),
        )
