"""The small facts of a target in one picture: boxes, counts of pixels, keypoints."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.geometry.region import Region
from spin_usd.picture.keypoint_states import keypoint_states
from spin_usd.picture.shown_bodies import NOTHING, ShownBodies, shown_by_rays
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.derived.surface_box import cut_off, surface_box
from spin_usd.scene.keypoints import KeypointState
from spin_usd.scene.mesh import BOX
from spin_usd.scene.scene import OneBody, Scene

MAX_RAYS = 1 << 14  # beside each side of the frame: pixels are counted one by one up to that, and sampled beyond


@dataclass(frozen=True, kw_only=True)
class PixelCounts:
    """Counts of pixel centres."""

    visible: int
    """Pixels that show the target."""
    amodal: int
    """Pixels within the frame that would show it without other bodies."""
    beyond: float
    """The same, outside the frame."""

    @property
    def visible_fraction(self) -> float | None:
        """The visible share of the whole silhouette; None if that covers no pixel centre."""
        whole = self.amodal + self.beyond
        return self.visible / whole if whole else None


def count_pixels(alone: OneBody, body: int, shown: ShownBodies, box: Float | None, caster: EmbreeCaster) -> PixelCounts:
    """Count the pixels of the target of `alone`, a scene without other bodies, whose id is `body` and whose surface has
    that `box` (2, 2)."""
    visible = int(np.count_nonzero(shown.ids == body))
    if box is None:
        return PixelCounts(visible=visible, amodal=visible, beyond=0)
    hidden = _hidden(alone, body, shown, caster)
    beyond = sum(_sampled(alone, strip, caster) for strip in _outside(alone.camera.frame, _whole_pixels(box)))
    return PixelCounts(visible=visible, amodal=visible + hidden, beyond=beyond)


def _hidden(alone: OneBody, body: int, shown: ShownBodies, caster: EmbreeCaster) -> int:
    """Count the pixels in which the target stands behind other bodies: only pixels that show those can do so."""
    rows, columns = np.nonzero((shown.ids != body) & (shown.ids != NOTHING))
    uv = np.stack([columns + shown.region.x0, rows + shown.region.y0], -1) + 0.5
    region = alone.region
    within = (uv > (region.x0, region.y0)).all(1) & (uv < (region.x1, region.y1)).all(1)
    if not within.any():
        return 0
    return int(caster.meets(alone, alone.camera.normalised(uv[within])).sum())


def _outside(frame: Region, box: Region) -> Iterator[Region]:
    """Yield the parts of `box` that lie left, right, above and below of the frame."""
    left = Region(x0=box.x0, y0=box.y0, x1=min(box.x1, 0), y1=box.y1)
    right = Region(x0=max(box.x0, frame.x1), y0=box.y0, x1=box.x1, y1=box.y1)
    x0, x1 = max(box.x0, 0), min(box.x1, frame.x1)
    above = Region(x0=x0, y0=box.y0, x1=x1, y1=min(box.y1, 0))
    below = Region(x0=x0, y0=max(box.y0, frame.y1), x1=x1, y1=box.y1)
    yield from (strip for strip in (left, right, above, below) if not strip.empty)


def _sampled(alone: OneBody, strip: Region, caster: EmbreeCaster) -> float:
    """Return how many pixel centres of the strip, outside the frame, the target covers: by the ray of each, or, if
    there are more than MAX_RAYS, by the rays of a grid of about as many cells."""
    shrink = max(1.0, (strip.width * strip.height / MAX_RAYS) ** 0.5)
    columns, rows = (max(1, int(np.ceil(size / shrink))) for size in (strip.width, strip.height))
    u = strip.x0 + (np.arange(columns) + 0.5) * (strip.width / columns)
    v = strip.y0 + (np.arange(rows) + 0.5) * (strip.height / rows)
    uv = np.stack(np.meshgrid(u, v), -1).reshape(-1, 2)
    xy, there = alone.camera.normalised_where_seen(uv)
    met = int(caster.meets(alone, xy[there]).sum())
    return met * (strip.width / columns) * (strip.height / rows)


def _whole_pixels(box: Float) -> Region:
    (x0, y0), (x1, y1) = np.floor(box[0]).astype(int), np.ceil(box[1]).astype(int)
    return Region(x0=int(x0), y0=int(y0), x1=int(x1), y1=int(y1))


@dataclass(frozen=True, kw_only=True, eq=False)
class TargetFacts:
    """A record's facts on a target, besides its pose; None or NaN if unknown."""

    counts: PixelCounts
    box_visible: list[int] | None
    """Tight box x0, y0, x1, y1 of the pixels that show it."""
    box_amodal: Float | None
    """(2, 2): box of its projected surface, in the frame or not."""
    truncated: bool
    """Whether some of it is outside the frame."""
    box: Float
    """(2, 3): its bounding box, in its own axes, metres."""
    corners: Float
    """(8, 2): corners of that box in the picture, pixels."""
    keypoints: Float
    """(N, 2) pixels."""
    states: tuple[KeypointState, ...]


def target_facts(scene: Scene, shown: ShownBodies | None, caster: EmbreeCaster) -> list[TargetFacts]:
    """Return the facts of each of the scene's targets, in order of their ids. `shown`: the bodies in its labels; None
    if no label contains them."""
    shown = shown or shown_by_rays(scene, caster)
    return [_facts(scene, place, shown, caster) for place in range(len(scene.targets))]


def _facts(scene: Scene, place: int, shown: ShownBodies, caster: EmbreeCaster) -> TargetFacts:
    """Return the facts of the target with that place among the scene's bodies."""
    alone, body = scene.one_body_scenes[place], scene.bodies[place].id
    box = surface_box(alone, partial(caster.meets, alone))
    low, high = alone.target.mesh.box
    keypoints, states = keypoint_states(scene.one_body_scenes, place, caster)
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
