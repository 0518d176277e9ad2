"""The small facts of a target in one picture: boxes, counts of pixels, keypoints."""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from spin_usd.arrays import Float
from spin_usd.dataset.picture.keypoint_states import KeypointState, keypoint_states
from spin_usd.dataset.picture.pixel_counts import PixelCounts, count_pixels
from spin_usd.dataset.picture.shown_bodies import ShownBodies, shown_by_rays
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.derived.surface_box import cut_off, surface_box
from spin_usd.scene.mesh import BOX
from spin_usd.scene.model import Scene


@dataclass(frozen=True, kw_only=True, eq=False)
class TargetFacts:
    """What a record says of a target beside its pose.

    box_visible: tight box x0, y0, x1, y1 of the pixels that show it · box_amodal (2, 2): of its projected surface, in
    the frame or not · truncated: whether some of it is outside the frame · box (2, 3): its own bounding box, in its own
    axes, metres, and corners (8, 2): that in the picture, pixels · keypoints (N, 2) pixels, and their states. None or
    NaN where there is none.
    """

    counts: PixelCounts
    box_visible: list[int] | None
    box_amodal: Float | None
    truncated: bool
    box: Float
    corners: Float
    keypoints: Float
    states: tuple[KeypointState, ...]

    def as_json(self) -> dict[str, Any]:
        """Return what the record says of them, by schema record-1."""
        return {
            "pixels": {"visible": self.counts.visible, "amodal": self.counts.amodal},
            "visible_fraction": self.counts.visible_fraction,
            "box": {
                "visible": self.box_visible,
                "amodal": None if self.box_amodal is None else self.box_amodal.ravel().tolist(),
                "truncated": self.truncated,
            },
            "box_3d": {"box": self.box.tolist(), "corners": [_pixel_or_null(uv) for uv in self.corners]},
            "keypoints": [
                [*(_pixel_or_null(uv) or (None, None)), state]
                for uv, state in zip(self.keypoints, self.states, strict=True)
            ],
        }


def target_facts(scene: Scene, shown: ShownBodies | None, caster: EmbreeCaster) -> list[TargetFacts]:
    """Return the facts of each of the scene's targets, in order of their ids. `shown`: what its labels show; None where
    no label says so."""
    shown = shown or shown_by_rays(scene, caster)
    return [_facts(scene, place, shown, caster) for place in range(len(scene.targets))]


def _facts(scene: Scene, place: int, shown: ShownBodies, caster: EmbreeCaster) -> TargetFacts:
    """Return the facts of the target with that place among the scene's bodies."""
    alone, body = scene.apart[place], scene.bodies[place].id
    box = surface_box(alone, partial(caster.meets, alone))
    low, high = alone.target.mesh.box
    keypoints, states = keypoint_states(scene.apart, place, caster)
    return TargetFacts(
        counts=count_pixels(alone, body, shown, box, caster),
        box_visible=shown.box(body),
        box_amodal=box,
        truncated=cut_off(alone, box),
        box=alone.target.mesh.box,
        corners=alone.camera.project(alone.T_cam_body.points(corners_of_box(low, high))),
        keypoints=keypoints,
        states=states,
    )


def corners_of_box(low: Float, high: Float) -> Float:
    """Return (8, 3) the corners of the box from `low` to `high` (3,): z changes first, then y, then x."""
    corners: Float = np.where(BOX, high, low)
    return corners


def _pixel_or_null(uv: Float) -> list[float] | None:
    return uv.tolist() if np.isfinite(uv).all() else None
