"""Named points of a target."""

from dataclasses import dataclass
from enum import StrEnum

from spin_usd.basics.arrays import Float


@dataclass(frozen=True, kw_only=True, eq=False)
class Keypoints:
    """Named points of a body, K of them."""

    names: tuple[str, ...]
    """(K,), each once."""
    points: Float
    """(K, 3): body axes, metres, double precision."""


class KeypointState(StrEnum):
    """Visibility of a keypoint.

    visible: nothing stands between the camera and it · self-occluded, occluded: the first surface before it is its own
    body's, or another body's · outside: it is outside the frame, or the lens's view · behind: it is behind the camera ·
    missing: its part is missing.

    A surface of its own body less than 0.5 % of the longest edge of its box before the keypoint does not hide it, so
    that keypoints on a surface or a little below it are visible, and the tip of a thin rod is visible from all sides. A
    keypoint deep in the body is self-occluded.
    """

    VISIBLE = "visible"
    SELF_OCCLUDED = "self-occluded"
    OCCLUDED = "occluded"
    OUTSIDE = "outside"
    BEHIND = "behind"
    MISSING = "missing"
