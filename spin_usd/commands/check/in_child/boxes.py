"""Rule: the boxes of each target agree with mask, pose and dense pose."""

from collections.abc import Iterator

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.commands.check.digests import MAKE_AGAIN
from spin_usd.commands.check.in_child.checked_picture import CheckedPicture
from spin_usd.commands.check.in_child.checked_target import CheckedTarget, targets_of
from spin_usd.picture.target_facts import corners_of_box
from spin_usd.scene.finding import Finding

CENTRE_PX = 0.5  # a pixel shows the surface at its centre
ROUNDING_PX = 1e-3
ROUNDING = 1e-6  # of a target's size: dense pose is float32
AWAY_PX, AWAY_SHARE = 1e-3, 1e-7  # of a pixel, and of where it is: the record's quaternion is rounded


def box_findings(picture: CheckedPicture) -> Iterator[Finding]:
    """Yield errors for boxes that disagree with mask, pose and dense pose."""
    for target in targets_of(picture):
        for fault in (*_visible(target), *_truncated(target), *_box_3d(target)):
            yield target.finding("box", f"{fault}; {MAKE_AGAIN}")


def box_of_mask(target: CheckedTarget) -> list[int] | None:
    """Return the tight box x0, y0, x1, y1 of the pixels that show the target; None where none does."""
    assert target.mask is not None
    rows, columns = np.flatnonzero(target.mask.any(1)), np.flatnonzero(target.mask.any(0))
    if not len(rows):
        return None
    return [int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1]


def _visible(target: CheckedTarget) -> Iterator[str]:
    """The visible box equals the mask's, and lies in the amodal one."""
    box = target.recorded.box
    if target.mask is not None and box_of_mask(target) != box.visible:
        yield f"its visible box is {box.visible}, and the box of its pixels {box_of_mask(target)}"
    if box.visible and not box.amodal:
        yield "it has a visible box, and no amodal one"
    elif box.visible and box.amodal:
        beyond = np.subtract(box.amodal, box.visible) * (1, 1, -1, -1)
        if not beyond.max() <= CENTRE_PX + ROUNDING_PX:
            yield f"its visible box reaches {beyond.max():.3g} px beyond its amodal one"


def _truncated(target: CheckedTarget) -> Iterator[str]:
    """A target is truncated where its amodal box leaves the frame, or not all of it can be seen by the lens."""
    amodal, truncated = target.recorded.box.amodal, target.recorded.box.truncated
    if amodal is None:
        if not truncated:
            yield "nothing of it is in the picture, but it is recorded as not truncated"
        return
    size = (target.camera.width, target.camera.height)
    leaves = max(-min(amodal[:2]), *np.subtract(amodal[2:], size).tolist())
    if leaves > ROUNDING_PX and not truncated:
        yield f"its amodal box leaves the frame by {leaves:.3g} px, but it is recorded as not truncated"
    if leaves < -ROUNDING_PX and truncated and None not in target.recorded.box_3d.corners:
        yield "all of it is in the frame, but it is recorded as truncated"


def _box_3d(target: CheckedTarget) -> Iterator[str]:
    """The corners match the box in metres, which contains the dense pose."""
    low, high = np.array(target.recorded.box_3d.box)
    expected = target.camera.project(target.T_cam_body.points(corners_of_box(low, high)))
    recorded = np.array([corner or (np.nan, np.nan) for corner in target.recorded.box_3d.corners])
    off = _distance(recorded, expected)
    if off:
        yield f"the corners of its 3D box are {off:.3g} px from where its pose puts them"
    dense = target.dense_pose
    if dense and len(dense[0]):
        beyond = float(np.maximum(low - dense[0], dense[0] - high).max())
        if not beyond <= ROUNDING * float(np.abs([low, high]).max()):
            yield f"its dense pose reaches {beyond:.3g} m beyond its 3D box"


def _distance(recorded: Float, expected: Float) -> float:
    """Return how far pixels (N, 2) are apart, infinity where one has none; 0 where rounding makes the difference."""
    known = np.isfinite(expected).all(1)
    if not np.array_equal(known, np.isfinite(recorded).all(1)):
        return float("inf")
    off = np.abs(recorded[known] - expected[known])
    wrong = off > AWAY_PX + AWAY_SHARE * np.abs(expected[known])
    return float(off[wrong].max(initial=0))
