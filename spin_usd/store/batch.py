"""Batches of pictures, as those who train networks stack them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from spin_usd.errors import InputError
from spin_usd.store.picture import Picture


def collate(pictures: Sequence[Picture], labels: Sequence[str] = ("image",)) -> dict[str, Any]:
    """Return a batch of B pictures of one size, as PyTorch's DataLoader takes it from its `collate_fn`.

    labels: what is stacked of the pictures' files, by these names: "image" (B, H, W) or (B, H, W, 3), "depth" and so
    on; another choice is `functools.partial(Dataset.collate, labels=("image", "depth"))`. Beside them it has
    "camera_matrix" (B, 3, 3), and of the first target "T_cam_body" (B, 4, 4), "q_cam_body" (B, 4), "t_cam_body" (B, 3),
    "box_visible" (B, 4), "keypoints" (B, K, 2) pixels and "keypoints_visible" (B, K); and the lists "frame" and
    "variant". Arrays are numpy's: `torch.from_numpy` takes them without a copy. Raises InputError where the pictures
    are not of one size.
    """
    first = [picture.targets[0] for picture in pictures]
    stacked = {label: [np.asarray(picture.label(label)) for picture in pictures] for label in labels}
    for label, arrays in stacked.items():
        shapes = sorted({array.shape for array in arrays})
        if len(shapes) > 1:
            found = f"cannot be stacked: {label} is {shapes[0]} and {shapes[1]}"
            raise InputError(found, where=pictures[0].root, do="make the pictures of one size: dataset.resize(256)")
    return {
        **{label: np.stack(arrays) for label, arrays in stacked.items()},
        "camera_matrix": np.stack([picture.camera_matrix for picture in pictures]),
        "T_cam_body": np.stack([picture.T_cam_body for picture in pictures]),
        "q_cam_body": np.stack([picture.q_cam_body for picture in pictures]),
        "t_cam_body": np.stack([picture.t_cam_body for picture in pictures]),
        "box_visible": np.stack([target.box_visible for target in first]),
        "keypoints": np.stack([target.keypoints for target in first]),
        "keypoints_visible": np.array([[state == "visible" for state in target.keypoint_states] for target in first]),
        "frame": [picture.frame for picture in pictures],
        "variant": [picture.variant for picture in pictures],
    }
