"""Train on pictures that look new in each epoch, with worker processes of PyTorch's DataLoader that outlive the epochs.

python docs/train_fresh.py FOLDER, where PyTorch is installed: a minute on two cores, rendering included.
"""

import sys
from pathlib import Path

import torch
from torch import nn
from torch.utils.data import DataLoader

import spin_usd

SPECIFICATION = """
schema = "augment-1"
[[augmentation]]
name = "fresh"
[augmentation.sample]
"sun.factor" = { distribution = "log_uniform", low = 0.3, high = 3 }
"exposure.stops" = { distribution = "normal", mean = 0, sigma = 0.5, unit = "stops" }
"sensor.read_noise" = { distribution = "uniform", low = 5, high = 20, unit = "electrons" }
"""

if __name__ == "__main__":  # workers that are spawned import this file
    folder = Path(sys.argv[1])
    poses = "range=3..8 inside=1 count=48"
    spin_usd.author(sample=poses, target="tango", camera="speedplus", resolution=240, out=folder / "stage")
    spin_usd.render(folder / "stage", out=folder / "dataset", renderer="raycast", samples=4, labels=["segmentation"])
    (folder / "fresh.toml").write_text(SPECIFICATION)
    fresh = spin_usd.FreshDataset(folder / "dataset", folder / "fresh.toml", seed=1, labels=["image"])
    crops = fresh.crop("tango", size=64, margin=0.2)
    loader = DataLoader(
        crops, batch_size=16, shuffle=True, num_workers=2, persistent_workers=True, collate_fn=crops.collate
    )
    network = nn.Sequential(
        nn.Conv2d(1, 16, 5, 4), nn.ReLU(), nn.Flatten(), nn.LazyLinear(crops[0].keypoint_pixels.size)
    )
    optimiser = torch.optim.Adam(network.parameters(), 1e-3)
    for epoch in range(3):
        crops.set_epoch(epoch)  # of the dataset that the loader has
        images = []
        for batch in loader:
            image, wanted = (
                torch.from_numpy(batch["image"])[:, None] / 255,
                torch.from_numpy(batch["keypoints"]).float(),
            )
            loss = nn.functional.mse_loss(network(image), wanted.flatten(1) / 64)
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            images.append(image)
        print(f"epoch {epoch}: {len(torch.cat(images))} images of mean {torch.cat(images).mean():.4f}, loss {loss:.3f}")
