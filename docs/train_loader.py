"""Author a stage, render it, load it in batches as PyTorch's DataLoader does, and measure how exact its labels are.

python docs/train_loader.py FOLDER
"""

import sys
from pathlib import Path

import cv2
import numpy as np

import spin_usd


def reprojection_error(picture: spin_usd.Picture) -> float:
    """How far OpenCV projects the dense pose from the centres of the pixels that show it: pixels, at most."""
    rows, columns = np.nonzero(picture.segmentation)
    points, (rotation, _) = picture.dense_pose[rows, columns].astype(float), cv2.Rodrigues(picture.T_cam_body[:3, :3])
    found = cv2.projectPoints(points, rotation, picture.t_cam_body, picture.camera_matrix, picture.distortion)[0][:, 0]
    return float(np.abs(found - np.stack([columns + 0.5, rows + 0.5], axis=-1)).max())


folder = Path(sys.argv[1])
spin_usd.author(sample="speedplus", count=2, target="tango", camera="speedplus", out=folder / "stage")
spin_usd.render(folder / "stage", out=folder / "dataset", renderer="raycast", samples=1)
dataset = spin_usd.Dataset(folder / "dataset")
# With PyTorch: for batch in DataLoader(dataset, batch_size=2, collate_fn=dataset.collate, num_workers=4):
for start in range(0, len(dataset), 2):
    batch = dataset.collate([*dataset[start : start + 2]])
    images, poses = batch["image"], batch["T_cam_body"]
    print(f"batch: images {images.shape} {images.dtype}, poses {poses.shape} {poses.dtype}")
print(f"dense pose: {max(map(reprojection_error, dataset)):.6f} pixels off at most, of {len(dataset)} pictures")
