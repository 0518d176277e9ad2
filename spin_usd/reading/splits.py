"""Which pictures go together, and into which split."""

import hashlib
from collections.abc import Iterable, Mapping, Sequence

from spin_usd.reading.picture import Picture


def split_of_each(groups: Sequence[str], shares: Mapping[str, float], *, seed: int) -> dict[str, str]:
    """Return the split of each of the `groups`: pictures of one group go together.

    Which go where is decided by a digest of the seed and the group: it is the same on every machine, in any order. Each
    split gets its share of the groups, rounded.
    """
    ranked = sorted(set(groups), key=lambda group: hashlib.sha256(f"{seed} {group}".encode()).digest())
    found: dict[str, str] = {}
    begin, upto = 0, 0.0
    for name, share in shares.items():
        upto += share
        end = round(upto * len(ranked))
        found |= dict.fromkeys(ranked[begin:end], name)
        begin = end
    return found


def poses_of(frames: Iterable[tuple[str, bytes]]) -> dict[str, str]:
    """Return for each frame the first frame that has its pose, mostly itself: a pose may occur twice in a list.
    `frames` are pictures' frames and poses; the first picture of a frame determines its pose."""
    backwards = [*frames][::-1]
    pose_of = dict(backwards)
    first = {pose: frame for frame, pose in backwards}
    return {frame: first[pose] for frame, pose in pose_of.items()}


def pose_bytes(picture: Picture) -> bytes:
    """Return the numbers of the picture's pose."""
    return picture.q_cam_body.tobytes() + picture.t_cam_body.tobytes()
