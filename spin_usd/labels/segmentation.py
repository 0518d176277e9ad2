"""Segmentation: the part of a body that each pixel shows."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from spin_usd.labels.label import Label
from spin_usd.labels.labelled_picture import LabelFault, LabelledPicture
from spin_usd.labels.preview import by_id
from spin_usd.scene.channels import Channels
from spin_usd.scene.derived.surface import Surface
from spin_usd.scene.scene import Scene


def segmentation(scene: Scene, surface: Surface) -> NDArray[np.uint16]:
    """Return (H, W) uint16: part ids, which count from 1; 0 for no surface."""
    return surface.image(surface.part, np.uint16)


def faults(picture: LabelledPicture) -> Iterator[LabelFault]:
    """Yield a fault where an id is not one of the dataset's parts."""
    highest = int(picture.arrays["segmentation"].max(initial=0))
    if highest > picture.parts:
        yield LabelFault(
            code="parts", message=f"segmentation holds id {highest}, dataset.json lists {picture.parts} parts"
        )


SEGMENTATION = Label(
    name="segmentation",
    make=segmentation,
    channels=Channels(meaning="part id, 16-bit; 0 = nothing", dtype="uint16", holds={"Y": "part id"}),
    suffix=".png",
    usd_type="int",
    file_bytes=0.03,
    preview=by_id,
    faults=faults,
    default=True,
)
