"""Keypoints that cannot be of the target: their file is likely in another unit."""

import numpy as np

from spin_usd.arrays import Float
from spin_usd.scene.source.keypoints import Keypoints


def notes_on_far_keypoints(keypoints: Keypoints | None, corners: Float) -> tuple[str, ...]:
    """A note where keypoints are farther from the bounding box of the `corners` (N, 3), body frame, metres, than its
    diagonal is long."""
    if keypoints is None:
        return ()
    low, high = corners.min(axis=0), corners.max(axis=0)
    away = np.linalg.norm(np.maximum(0, np.maximum(low - keypoints.points, keypoints.points - high)), axis=1)
    far = int(np.count_nonzero(away > np.linalg.norm(high - low)))
    if not far:
        return ()
    name, most = keypoints.names[int(away.argmax())], float(away.max())
    return (
        f"keypoints far off the target: {far} of {len(away)} ({name!r}: {most:.3g} m from its bounding box); "
        "they are in metres, in body axes: check the unit of their file",
    )
