"""Labels: kinds of ground truth for every pixel of a picture."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import digest
from spin_usd.labels.labelled_picture import LabelFault, LabelledPicture
from spin_usd.scene.content import content
from spin_usd.scene.derived.surface import Surface
from spin_usd.scene.model import Scene
from spin_usd.scene.source.channels import Channels


@dataclass(frozen=True, kw_only=True)
class Label:
    """A kind of ground truth. All that describes it stands here.

    name: in `--labels`, as the folder of its files, and in records; lower-case letters, digits and "_"
    make: the label (H, W), or (H, W, C) where it has several channels, of a scene and its visible surface
    channels: what its numbers are; `channels.meaning` is what dataset.json says of it
    suffix: of its files, ".exr" for float32, ".png" for uint8 and uint16
    usd_type: of a pixel in USD; authored stages list the default labels as UsdRender variables
    file_bytes: what a pixel of the target takes in the file, compressed; `plan` expects that much
    preview: the label in colours for people, (H, W, 3) uint8 RGB
    faults: what `check` finds wrong with it in a picture that has it
    target_s: seconds of one core that a pixel of the target takes to make, beyond what labels share; for `plan`
    decided_by: what decides it beyond what the geometry key covers, which decides all others
    takes_next_frame: whether `make` and `decided_by` take `scene.next_frame`
    default: whether `render` writes it when no labels are named
    of_several: whether `render` writes it beside any other label where a stage has several bodies: without it nobody
    could tell which of them another label is of

    Channels are called Y, or R, G and B, whatever they hold: OpenCV's EXR reader reads no other names and silently
    gives zeros for them.
    """

    name: str
    make: Callable[[Scene, Surface], NDArray[Any]]
    channels: Channels
    suffix: str
    usd_type: str
    file_bytes: float
    preview: Callable[[NDArray[Any]], NDArray[np.uint8]]
    faults: Callable[[LabelledPicture], Iterator[LabelFault]]
    target_s: float = 0.0
    decided_by: Callable[[Scene], Any] | None = None
    takes_next_frame: bool = False
    default: bool = False
    of_several: bool = False

    def key(self, scene: Scene, geometry: str) -> str:
        """Return the digest of all that decides the label in `scene`, whose geometry key is given: that one, where
        nothing else does."""
        return digest(geometry, content(self.decided_by(scene))) if self.decided_by else geometry
