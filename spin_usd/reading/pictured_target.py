"""A target in one picture of a dataset, as its record has it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from msgspec import UNSET

from spin_usd.basics.arrays import Float, frozen
from spin_usd.reading.window import Window
from spin_usd.records.record import RecordedTarget


@dataclass(frozen=True, kw_only=True, eq=False)
class PicturedTarget:
    """One of the targets of a picture; arrays are read-only float64, pixels have (0, 0) at the image's corner.

    Attributes:
        id: its number in the label `instance`, from 1.
        name: its name.
        T_cam_body: (4, 4) its pose, as a Picture has it for the first target.
        q_cam_body: (4,) its rotation as a unit quaternion, scalar first.
        t_cam_body: (3,) the origin of its axes, metres.
        velocity: (3,) of the origin of its axes, in the camera's, m/s; NaN if unknown.
        angular_velocity: (3,) radians a second, in the camera's axes; likewise.
        range: from the camera to the origin of its axes, metres.
        box_visible: (4,) tight box x0, y0, x1, y1 around the pixels that show it, x1 and y1 past the last; NaN where
            none does.
        box_amodal: (4,) box of its projected surface, also outside the frame and behind other bodies; NaN where the
            lens sees none of it.
        truncated: whether some of it is outside the frame or behind the camera.
        pixels_visible: how many pixels show it.
        pixels_amodal: how many pixels of the frame would show it if nothing else were there.
        visible_fraction: visible pixels over all that it would cover, also outside the frame; NaN where it covers none.
        box: (2, 3) its least and greatest coordinates in its own axes, metres.
        box_3d: (8, 2) pixels of the corners of that box, from least x, y and z on, z first growing, then y, then x; NaN
            where the lens sees none.
        keypoints: (N, 2) pixels of its keypoints, hidden ones too; NaN where the lens sees none.
        keypoint_states: (N,) "visible", "self-occluded", "occluded" by another body, "outside" the frame, or "behind"
            the camera, or "missing" with its part.
        shaped_keypoints: (N, 3) its keypoints in its own axes, metres, where its shape is not the model's; NaN for
            missing ones; None where it is.

    In a part of a picture, by `crop` or `resize`, boxes and keypoints are in the part's pixels; truncated and the
    states are by its frame, box_visible is what that leaves of the whole picture's, and numbers of pixels are the
    whole picture's.
    """

    id: int
    name: str
    T_cam_body: Float
    q_cam_body: Float
    t_cam_body: Float
    velocity: Float
    angular_velocity: Float
    range: float
    box_visible: Float
    box_amodal: Float
    truncated: bool
    pixels_visible: int
    pixels_amodal: int
    visible_fraction: float
    box: Float
    box_3d: Float
    keypoints: Float
    keypoint_states: tuple[str, ...]
    shaped_keypoints: Float | None = None

    @classmethod
    def of(cls, found: RecordedTarget) -> Self:
        """Make it of a record's entry."""
        return cls(
            id=found.id,
            name=found.name,
            T_cam_body=frozen(found.pose.T_cam_body.matrix),
            q_cam_body=frozen(found.pose.q_cam_body),
            t_cam_body=frozen(found.pose.t_cam_body),
            velocity=_numbers(None if found.motion is UNSET else found.motion.velocity, (3,)),
            angular_velocity=_numbers(None if found.motion is UNSET else found.motion.angular_velocity, (3,)),
            range=found.range,
            box_visible=_numbers(found.box.visible, (4,)),
            box_amodal=_numbers(found.box.amodal, (4,)),
            truncated=found.box.truncated,
            pixels_visible=found.pixels.visible,
            pixels_amodal=found.pixels.amodal,
            visible_fraction=float("nan" if found.visible_fraction is None else found.visible_fraction),
            box=frozen(found.box_3d.box),
            box_3d=frozen([_numbers(corner, (2,)) for corner in found.box_3d.corners]),
            keypoints=frozen(np.array([(u, v) for u, v, _ in found.keypoints], np.float64).reshape(-1, 2)),
            keypoint_states=tuple(str(state) for _, _, state in found.keypoints),
            shaped_keypoints=None if (points := found.true_keypoints) is None else frozen(points),
        )

    def seen_in(self, window: Window) -> Self:
        """Return it as the window shows it."""
        keypoints, (width, height) = window.pixels(self.keypoints), window.size
        with np.errstate(invalid="ignore"):
            inside = ((keypoints >= 0) & (keypoints < window.size)).all(-1)
        states = zip(self.keypoint_states, inside, np.isnan(keypoints).any(-1), strict=True)
        visible = np.clip(_moved(self.box_visible, window), 0, (width, height, width, height))
        empty = not (visible[2] > visible[0] and visible[3] > visible[1])
        amodal = _moved(self.box_amodal, window)
        return replace(
            self,
            box_visible=frozen(np.full(4, np.nan) if empty else visible),
            box_amodal=frozen(amodal),
            truncated=self.truncated or bool((amodal < 0).any() or (amodal > (width, height, width, height)).any()),
            box_3d=frozen(window.pixels(self.box_3d)),
            keypoints=frozen(keypoints),
            keypoint_states=tuple(state if there or unseen else "outside" for state, there, unseen in states),
        )


def _moved(box: Float, window: Window) -> Float:
    """Return the box (4,) in the window."""
    return window.pixels(box.reshape(2, 2)).ravel()


def _numbers(found: Sequence[float] | None, shape: tuple[int, ...]) -> Float:
    """Return the numbers of that shape; NaN for null."""
    return frozen(np.full(shape, np.nan) if found is None else found)
