"""Rule: a target's keypoints are where its pose puts them, and the depth around them agrees with their visibility."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.commands.check.digests import MAKE_AGAIN
from spin_usd.commands.check.in_child.checked_picture import CheckedPicture
from spin_usd.commands.check.in_child.checked_target import CheckedTarget, targets_of
from spin_usd.geometry.bounds import NEAR
from spin_usd.picture.keypoint_states import skin
from spin_usd.scene.finding import Finding
from spin_usd.scene.keypoints import KeypointState

AWAY_PX, AWAY_SHARE = 1e-3, 1e-7  # of a pixel, and of where it is: the record's quaternion is rounded
BORDER_PX = 1e-6  # within which either side of the frame's edge is right
AROUND = 1  # pixels around a keypoint's own, whose depth is looked at
MIN_HIDDEN = 3  # keypoints: fewer may be hidden by rods too thin for pixels to show
UNSEEN = (KeypointState.OUTSIDE, KeypointState.BEHIND, KeypointState.MISSING)


@dataclass(frozen=True, kw_only=True)
class DepthAround:
    """The depth of the pixels around a keypoint that is in the frame, metres."""

    z: float
    """The keypoint's own depth."""
    skin: float
    """How far before the keypoint a surface does not hide it."""
    near: float
    """The least depth around it, NaN where nothing is seen there."""
    far: float
    """The greatest depth around it, likewise."""
    whole: bool
    """Whether all of these pixels show one part."""

    @property
    def slope(self) -> float:
        """Further change of the depth within a pixel."""
        return self.far - self.near + self.skin

    @property
    def beside(self) -> bool:
        """Return whether a surface is seen as deep as the keypoint."""
        return self.near - self.slope <= self.z <= self.far + self.slope

    @property
    def covered(self) -> bool:
        """Return whether all that is seen there is before the keypoint: it lies behind a surface without a gap."""
        return self.whole and self.z > self.far + self.slope

    @property
    def uncovered(self) -> bool:
        """Return whether all that is seen there is behind the keypoint."""
        return self.whole and self.z < self.near - self.slope


def keypoint_findings(picture: CheckedPicture) -> Iterator[Finding]:
    """Yield errors for keypoints that are elsewhere, or in another state, than pose, camera and depth have them."""
    for target in targets_of(picture):
        names, recorded = list(target.described.keypoints), target.recorded.keypoints
        if not target.rigid:  # dataset.json has the keypoints of another shape
            continue
        if len(recorded) != len(names):
            found = f"has {len(recorded)} keypoints, and dataset.json lists {len(names)}"
            yield target.finding("keypoints", f"{found}; {MAKE_AGAIN}")
            continue
        for i, wrong in (*_misplaced(target), *_contradicted(target)):
            yield target.finding("keypoints", f"keypoint {names[i]} {wrong}; {MAKE_AGAIN}")


def depths_around(target: CheckedTarget) -> Iterator[tuple[int, DepthAround]]:
    """Yield the number of each keypoint that is in the frame, and the depth around it; nothing without that label."""
    depth = target.picture.arrays.get("depth")
    if depth is None:
        return
    parts = target.picture.arrays.get("segmentation", depth > 0)
    points = target.T_cam_body.points(target.keypoints)
    hiding = skin(np.ptp(target.recorded.box_3d.box, axis=0))
    for i, (u, v, state) in enumerate(target.recorded.keypoints):
        if u is not None and v is not None and state not in UNSEEN:
            row, column = int(v), int(u)
            window = slice(max(row - AROUND, 0), row + AROUND + 1), slice(max(column - AROUND, 0), column + AROUND + 1)
            seen = depth[window][depth[window] > 0]
            ends = (float(seen.min()), float(seen.max())) if len(seen) else (np.nan, np.nan)
            whole = len(seen) == depth[window].size and len(np.unique(parts[window])) == 1
            yield i, DepthAround(z=float(points[i, 2]), skin=hiding, near=ends[0], far=ends[1], whole=whole)


def _misplaced(target: CheckedTarget) -> Iterator[tuple[int, str]]:
    """Yield the faults of keypoints that are not where their pose puts them, or whose states "behind" and "outside" are
    wrong."""
    points = target.T_cam_body.points(target.keypoints)
    expected, size = target.camera.project(points), np.array([target.camera.width, target.camera.height])
    for i, (u, v, state) in enumerate(target.recorded.keypoints):
        if (u is None) != bool(np.isnan(expected[i, 0])):
            yield i, "has a pixel where the lens sees none, or none where it sees one"
            continue
        if u is not None:
            off = float(np.abs(expected[i] - (u, v)).max())
            if not off <= AWAY_PX + AWAY_SHARE * float(np.abs(expected[i]).max()):
                yield i, f"is {off:.3g} px from where its pose puts it"
        inside = (
            _inside(expected[i], size, -BORDER_PX) if state in UNSEEN else not _inside(expected[i], size, BORDER_PX)
        )
        behind = abs(points[i, 2] - NEAR) > NEAR and (points[i, 2] <= NEAR) != (state == KeypointState.BEHIND)
        if inside or behind:
            yield i, f"is recorded as {state}, which its pose contradicts"


def _inside(uv: Float, size: Float, margin: float) -> bool:
    """Return whether the pixel is in the frame, grown by the margin."""
    return bool(((uv >= -margin) & (uv < size + margin)).all())


def _contradicted(target: CheckedTarget) -> Iterator[tuple[int, str]]:
    """Yield visible keypoints behind a surface, and hidden ones where most of a target's have nothing before them."""
    states = [state for _, _, state in target.recorded.keypoints]
    around = dict(depths_around(target))
    hidden = [i for i in around if states[i] != KeypointState.VISIBLE and around[i].whole]
    bare = [i for i in hidden if around[i].uncovered]
    for i, depth in around.items():
        if states[i] == KeypointState.VISIBLE and depth.covered:
            yield i, f"is recorded as visible, but lies {depth.z - depth.far:.3g} m behind the depth there"
    if len(bare) >= MIN_HIDDEN and 2 * len(bare) > len(hidden):
        yield bare[0], f"and {len(bare) - 1} others are recorded as hidden, but the depth shows nothing before them"
