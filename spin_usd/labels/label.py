"""The labels there are. A new one is a function of its own file and an entry here."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from spin_usd.labels.dense_pose import dense_pose
from spin_usd.labels.depth import depth
from spin_usd.labels.segmentation import segmentation
from spin_usd.scene.derived.surface import Surface
from spin_usd.scene.source.channels import Channels


@dataclass(frozen=True, kw_only=True)
class Label:
    """A kind of ground truth of the whole frame. `make(surface, (H, W))` gives (H, W), or (H, W, C) when there are
    several `channels`; `suffix` is its image file's extension.

    Channels are called Y, or R, G and B, whatever they hold: OpenCV's reader of EXR knows no others and gives zeros for
    them, without a word.
    """

    name: str
    make: Callable[[Surface, tuple[int, int]], NDArray[Any]]
    channels: Channels
    suffix: str


LABELS = {
    label.name: label
    for label in (
        Label(
            name="depth",
            make=depth,
            channels=Channels(
                meaning="planar z in the camera's frame, metres: one float32 channel, Y; 0 = nothing",
                dtype="float32",
                holds={"Y": "z"},
                unit="m",
                frame="cam",
            ),
            suffix=".exr",
        ),
        Label(
            name="segmentation",
            make=segmentation,
            channels=Channels(meaning="part id, 16-bit; 0 = nothing", dtype="uint16", holds={"Y": "part id"}),
            suffix=".png",
        ),
        Label(
            name="dense_pose",
            make=dense_pose,
            channels=Channels(
                meaning="the surface point in the target's body frame, x, y, z in metres: float32 channels R, G, B; "
                "0 = nothing",
                dtype="float32",
                holds={"R": "x", "G": "y", "B": "z"},
                unit="m",
                frame="body",
            ),
            suffix=".exr",
        ),
    )
}
