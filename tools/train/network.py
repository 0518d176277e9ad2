"""Keypoint heatmaps by a residual network and three deconvolutions (Xiao et al. 2018, "Simple Baselines for Human Pose
Estimation and Tracking"); the residual network is that of He et al. 2016.

No weights are learned elsewhere: a package that brings them cannot be had everywhere.
"""

from collections.abc import Iterator

import torch
from torch import Tensor, nn

STAGES = {18: (2, 2, 2, 2), 34: (3, 4, 6, 3), 50: (3, 4, 6, 3)}
"""Blocks of each stage, by the number of layers in all; from 50 on they are bottlenecks."""


class Block(nn.Module):
    """A residual block of two convolutions; as a `bottleneck` of three, four times as wide at its end."""

    def __init__(self, channels: int, width: int, stride: int, *, bottleneck: bool) -> None:
        super().__init__()
        out = width * 4 if bottleneck else width
        if bottleneck:
            layers = [*_convolution(channels, width, 1), *_convolution(width, width, 3, stride)]
            layers += _convolution(width, out, 1)
        else:
            layers = [*_convolution(channels, width, 3, stride), *_convolution(width, out, 3)]
        self.changed = nn.Sequential(*layers[:-1])  # the last activation comes after the sum
        same = stride == 1 and channels == out
        self.kept = nn.Identity() if same else nn.Sequential(*[*_convolution(channels, out, 1, stride)][:-1])

    def forward(self, x: Tensor) -> Tensor:
        return torch.relu(self.changed(x) + self.kept(x))


class HeatmapNetwork(nn.Module):
    """Crops (B, 1, S, S), values -1 to 1, to heatmaps (B, K, S / 4, S / 4).

    layers: 18, 34 or 50 · width: channels of the first stage, 64 as published · decoder: channels of the
    deconvolutions, 256 as published.
    """

    def __init__(self, keypoints: int, *, layers: int, width: int, decoder: int) -> None:
        super().__init__()
        bottleneck = layers >= 50
        parts: list[nn.Module] = [*_convolution(1, width, 7, 2), nn.MaxPool2d(3, 2, 1)]
        channels = width
        for stage, blocks in enumerate(STAGES[layers]):
            for block in range(blocks):
                own = width * 2**stage
                parts.append(Block(channels, own, 2 if stage and not block else 1, bottleneck=bottleneck))
                channels = own * 4 if bottleneck else own
        for _ in range(3):
            parts += [nn.ConvTranspose2d(channels, decoder, 4, 2, 1, bias=False), nn.BatchNorm2d(decoder), nn.ReLU()]
            channels = decoder
        self.all = nn.Sequential(*parts, nn.Conv2d(channels, keypoints, 1))
        for module in self.modules():
            if isinstance(module, nn.ConvTranspose2d):
                nn.init.normal_(module.weight, std=0.001)
        last = self.all[-1]
        nn.init.normal_(last.weight, std=0.001)
        nn.init.zeros_(last.bias)

    def forward(self, crops: Tensor) -> Tensor:
        heatmaps: Tensor = self.all(crops)
        return heatmaps


def _convolution(channels: int, out: int, size: int, stride: int = 1) -> Iterator[nn.Module]:
    convolution = nn.Conv2d(channels, out, size, stride, size // 2, bias=False)
    nn.init.kaiming_normal_(convolution.weight, mode="fan_out", nonlinearity="relu")
    yield from (convolution, nn.BatchNorm2d(out), nn.ReLU())
