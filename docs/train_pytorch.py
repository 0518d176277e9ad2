"""Author 400 poses, render them without Blender, and train a network that finds Tango's keypoints in crops of it.

python docs/train_pytorch.py FOLDER, where PyTorch is installed: a minute on two cores, rendering included.
"""

import sys
from pathlib import Path

import torch
from torch import nn

import spin_usd


def batch(pictures: spin_usd.Dataset) -> tuple[torch.Tensor, torch.Tensor]:
    """Return images (B, 1, 64, 64) and keypoints (B, K, 2) as shares of the crop."""
    made = pictures.collate([*pictures])
    return torch.from_numpy(made["image"])[:, None] / 255, torch.from_numpy(made["keypoints"]).float() / 64


folder = Path(sys.argv[1])
poses = "range=3..8 inside=1 attitude=0.557,-0.712,0.168,-0.393:30 count=400"  # up to 30 degrees from one
spin_usd.author(sample=poses, target="tango", camera="speedplus", resolution=240, out=folder / "stage")
spin_usd.render(folder / "stage", out=folder / "dataset", renderer="raycast", samples=4, labels=["segmentation"])
train, test = spin_usd.Dataset(folder / "dataset").crop("tango", size=64, margin=0.2).split(0.9, 0.1)
(images, wanted), (unseen, truth) = batch(train), batch(test)

torch.manual_seed(0)
sizes = (1, 16), (16, 32), (32, 64)
layers = [nn.Sequential(nn.Conv2d(i, o, 3, 2, 1), nn.BatchNorm2d(o), nn.ReLU()) for i, o in sizes]
last = nn.Linear(64 * 8 * 8, wanted[0].numel())
network = nn.Sequential(*layers, nn.Flatten(), last, nn.Unflatten(1, wanted.shape[1:]))
optimiser = torch.optim.Adam(network.parameters(), 1e-3)
for epoch in range(21):
    network.eval()
    with torch.no_grad():
        off = 64 * (network(unseen) - truth).norm(dim=-1).mean()
    if epoch % 10 == 0:
        print(f"epoch {epoch}: keypoints of {len(test)} unseen pictures are {off:.1f} pixels off")
    network.train()
    for some in torch.randperm(len(images)).split(32):
        optimiser.zero_grad()
        nn.functional.smooth_l1_loss(network(images[some]), wanted[some], beta=0.02).backward()
        optimiser.step()
