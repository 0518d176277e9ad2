"""Render the events of a craft that tumbles past, and train a network that finds it in voxel grids of them.

python docs/train_events.py FOLDER, where PyTorch and h5py are installed: two minutes on two cores, rendering included.
"""

import sys
from pathlib import Path

import numpy as np
import torch
from torch import nn

import spin_usd

BINS, WINDOW_S = 5, 0.05

folder = Path(sys.argv[1])
angles = np.linspace(0, 6, 61)
rows = [
    f"p{i},{np.cos(a / 2)},{0.6 * np.sin(a / 2)},{0.64 * np.sin(a / 2)},{0.48 * np.sin(a / 2)},"
    f"{np.sin(a)},{0.5 * np.sin(1.7 * a)},7,{i}"
    for i, a in enumerate(angles)
]
folder.mkdir(parents=True, exist_ok=True)
(folder / "poses.csv").write_text("\n".join(["name,qw,qx,qy,qz,x,y,z,time", *rows]))
stage = {"target": "tango", "camera": "speedplus", "resolution": 160, "event_sensor": "v2e_clean"}
spin_usd.author(poses=folder / "poses.csv", out=folder / "stage", **stage)
how = {"renderer": "raycast", "samples": 4, "labels_only": False, "labels": "none", "events": True}
spin_usd.render(folder / "stage", out=folder / "dataset", **how)
dataset = spin_usd.Dataset(folder / "dataset")
events = dataset.events()
windows = list(events.windows(WINDOW_S))
grids = torch.from_numpy(np.stack([events.voxel_grid(start, end, BINS) for start, end in windows]))
places = torch.from_numpy(np.stack([events.pose(end)[:3, 3] for _, end in windows])).float()
known, unseen = torch.arange(len(grids)).split([len(grids) * 4 // 5, len(grids) - len(grids) * 4 // 5])

torch.manual_seed(0)
sizes = (BINS, 16), (16, 32), (32, 64)
layers = [nn.Sequential(nn.Conv2d(i, o, 3, 2, 1), nn.BatchNorm2d(o), nn.ReLU()) for i, o in sizes]
network = nn.Sequential(*layers, nn.AdaptiveAvgPool2d(8), nn.Flatten(), nn.Linear(64 * 64, 2))
optimiser = torch.optim.Adam(network.parameters(), 1e-3)
for epoch in range(21):
    network.eval()
    with torch.no_grad():
        off = (network(grids[unseen]) - places[unseen, :2]).norm(dim=-1).mean()
    if epoch % 5 == 0:
        print(f"epoch {epoch}: the place across in {len(unseen)} later windows is {off:.2f} m off")
    network.train()
    for some in known[torch.randperm(len(known))].split(32):
        optimiser.zero_grad()
        nn.functional.smooth_l1_loss(network(grids[some]), places[some, :2], beta=0.02).backward()
        optimiser.step()
