"""The labels there are. A new one is a function of its own file and an entry here."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from spin_usd.labels.dense_pose import dense_pose
from spin_usd.labels.depth import depth
from spin_usd.labels.segmentation import segmentation
from spin_usd.scene.surface import Surface


@dataclass(frozen=True, kw_only=True)
class Label:
    """A kind of ground truth of the whole frame. `make(surface, (H, W))` gives (H, W), or (H, W, C) when there are
    several `channels`; `suffix` is its image file's extension; `meaning` says what its numbers are."""

    name: str
    make: Callable[[Surface, tuple[int, int]], NDArray[Any]]
    channels: tuple[str, ...]
    suffix: str
    meaning: str


LABELS = {
    label.name: label
    for label in (
        Label(
            name="depth",
            make=depth,
            channels=("Z",),
            suffix=".exr",
            meaning="planar z in the camera's frame, metres, float32; 0 = nothing",
        ),
        Label(
            name="segmentation",
            make=segmentation,
            channels=("Y",),
            suffix=".png",
            meaning="part id, 16-bit; 0 = nothing",
        ),
        Label(
            name="dense_pose",
            make=dense_pose,
            channels=("X", "Y", "Z"),
            suffix=".exr",
            meaning="the surface point in the target's body frame, metres, float32; 0 = nothing",
        ),
    )
}
