"""Instance: which target each pixel shows."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from spin_usd.labels.label import Label
from spin_usd.labels.labelled_picture import LabelFault, LabelledPicture
from spin_usd.labels.preview import by_id
from spin_usd.scene.channels import Channels
from spin_usd.scene.derived.surface import Surface
from spin_usd.scene.scene import Scene


def instance(scene: Scene, surface: Surface) -> NDArray[np.uint16]:
    """Return (H, W) uint16: target ids, which count from 1; 0 for no surface, and for occluders."""
    return surface.image(surface.target, np.uint16)


def faults(picture: LabelledPicture) -> Iterator[LabelFault]:
    """The target of each pixel is the target of the part in the segmentation."""
    parts = picture.arrays.get("segmentation")
    if parts is None or parts.max(initial=0) >= len(picture.target_of_part):
        return
    differing = int((picture.arrays["instance"] != picture.target_of_part[parts]).sum())
    if differing:
        message = f"instance and segmentation name different targets in {differing} pixels"
        yield LabelFault(code="instance", message=message)


INSTANCE = Label(
    name="instance",
    make=instance,
    channels=Channels(
        meaning="target id, 16-bit; 0 = nothing, or geometry that is no target",
        dtype="uint16",
        holds={"Y": "target id"},
    ),
    suffix=".png",
    usd_type="int",
    file_bytes=0.03,
    preview=by_id,
    faults=faults,
    of_several=True,
)
