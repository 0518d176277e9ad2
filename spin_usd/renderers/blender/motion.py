"""A body's motion while the shutter is open: keyframes, one for each of the times at which Cycles needs poses.

Cycles takes the objects' poses at 3, 5, 9, ... equally spaced times, and moves them straight and rotates them steadily
in between; each ray has a time of its own, spread evenly over all but the first 1/512 and the last 3/512 (measured).
Its rolling shutter counts rows of the whole frame, cropped or not, and opens for the row i from the top after (i + 1) /
rows of its readout. So Cycles is given a little more time than the shutter's own, such that the rays have just that.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.geometry.rotation import quaternion_from_matrix, turn_between
from spin_usd.renderers.blender.nodes import assign
from spin_usd.scene.scene import OneBody, Shutter

FIRST_RAY, LAST_RAY = 1 / 512, 509 / 512  # of the time for which Cycles exposes
STILL = {"use_motion_blur": False}
CHANNELS = (("location", 3), ("rotation_quaternion", 4))


class MotionSetup:
    """Moves one body's axes in the Blender scene, whose own pose is the pose at the shutter's middle."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._moving: Any = None

    def hold(self) -> None:
        """Show everything at rest, in its own pose."""
        if self._moving is None:
            return
        assign(self._scene.render, STILL)
        self._moving.animation_data_clear()
        self._moving.location, self._moving.rotation_quaternion = (0, 0, 0), (1, 0, 0, 0)
        self._moving = None

    def move(self, axes: Any, objects: Iterable[Any], scene: OneBody) -> None:
        """Move the `axes` around the target's centre, in which `objects` show it, as the scene's shutter sees it; hold
        without one."""
        self.hold()
        if scene.shutter is None:
            return
        timing = Timing.of(scene.shutter, scene.camera.height)
        steps = len(scene.poses) - 1
        self._open_shutter(timing, steps)
        action, slot = self._action(relative_poses(scene, np.linspace(timing.start, timing.end, steps + 1)))
        for shown in objects:
            assign(shown.cycles, {"use_motion_blur": True, "use_deform_motion": False})
            assign(shown.cycles, {"motion_steps": steps.bit_length() - 1})
        axes.rotation_mode = "QUATERNION"
        animation = axes.animation_data_create()
        animation.action, animation.action_slot = action, slot
        self._moving = axes

    def _open_shutter(self, timing: "Timing", steps: int) -> None:
        """One frame of Blender's time for each step, so that poses fall on whole frames."""
        render = {"use_motion_blur": True, "motion_blur_shutter": float(steps), "motion_blur_position": "CENTER"}
        assign(self._scene.render, render)
        rolling = {"rolling_shutter_type": "TOP" if timing.exposed < 1 else "NONE"}
        assign(self._scene.cycles, {**rolling, "rolling_shutter_duration": timing.exposed})

    def _action(self, poses: Float) -> tuple[Any, Any]:
        """Return an action with `poses` (steps + 1, 7) around the current frame; the one before is freed."""
        for stale in [action for action in bpy.data.actions if not action.users]:
            bpy.data.actions.remove(stale)
        action = bpy.data.actions.new("shutter")
        slot = action.slots.new(id_type="OBJECT", name="target")
        bag = action.layers.new("shutter").strips.new(type="KEYFRAME").channelbag(slot, ensure=True)
        frames = self._scene.frame_current + np.arange(len(poses)) - len(poses) // 2
        curves = (bag.fcurves.new(path, index=index) for path, count in CHANNELS for index in range(count))
        for curve, values in zip(curves, poses.T, strict=True):
            curve.keyframe_points.add(len(frames))
            curve.keyframe_points.foreach_set("co", np.stack([frames, values], -1).ravel())
            curve.keyframe_points.foreach_set("interpolation", np.ones(len(frames), np.int32))  # linear
            curve.update()
        return action, slot


@dataclass(frozen=True, kw_only=True)
class Timing:
    """Cycles' own start and end, where 0 and 1 are the shutter's."""

    start: float
    end: float
    exposed: float
    """The share of it in which a row is."""

    @classmethod
    def of(cls, shutter: Shutter, rows: int) -> "Timing":
        exposure = (1 - shutter.readout) / (LAST_RAY - FIRST_RAY)
        span = shutter.last_row - shutter.first_row
        readout = shutter.readout * span * rows / (rows - 1) if shutter.readout else 0.0
        start = shutter.readout * shutter.first_row - exposure * FIRST_RAY - readout / rows
        return cls(start=start, end=start + exposure + readout, exposed=exposure / (exposure + readout))


def relative_poses(scene: OneBody, times: Float) -> Float:
    """Return (N, 7) location, metres, and quaternion, scalar first, of the target's centre and axes at the `times`
    (N,), from 0 to 1 of the shutter's, as seen from its own centre and axes at the middle."""
    poses, middle, centre = scene.poses, scene.T_cam_body, scene.target.mesh.centre
    found = np.empty((len(times), 7))
    for row, place in zip(found, times * (len(poses) - 1), strict=True):
        i = min(max(int(place), 0), len(poses) - 2)
        before, after, share = poses[i], poses[i + 1], place - i
        start, end = before.points(centre), after.points(centre)
        where = start + share * (end - start)
        axes = turn_between(before.rotation, after.rotation, share)
        row[:3] = middle.rotation.T @ (where - middle.points(centre))
        row[3:] = quaternion_from_matrix(middle.rotation.T @ axes)
    return found
