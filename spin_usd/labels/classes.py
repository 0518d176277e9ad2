"""Classes: the class of the part that each pixel shows."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from spin_usd.labels.label import Label
from spin_usd.labels.labelled_picture import LabelFault, LabelledPicture
from spin_usd.labels.preview import by_id
from spin_usd.scene.channels import Channels
from spin_usd.scene.derived.part_classes import class_of_parts
from spin_usd.scene.derived.surface import Surface
from spin_usd.scene.scene import Scene


def classes(scene: Scene, surface: Surface) -> NDArray[np.uint16]:
    """Return (H, W) uint16: class ids, which count from 1 in the alphabetic order of the classes of all parts; 0 for no
    surface."""
    return surface.image(class_of_parts(scene)[surface.part], np.uint16)


def faults(picture: LabelledPicture) -> Iterator[LabelFault]:
    """Each pixel has the class of its part."""
    ids = picture.arrays.get("segmentation")
    if ids is None or ids.max(initial=0) >= len(picture.class_of_part):
        return
    wrong = int((picture.arrays["classes"] != picture.class_of_part[ids]).sum())
    if wrong:
        message = f"classes and the class of the part in segmentation differ in {wrong} pixels"
        yield LabelFault(code="classes", message=message)


CLASSES = Label(
    name="classes",
    make=classes,
    decided_by=lambda scene: class_of_parts(scene),
    channels=Channels(meaning="class id, 16-bit; 0 = nothing", dtype="uint16", holds={"Y": "class id"}),
    suffix=".png",
    usd_type="int",
    file_bytes=0.02,
    preview=by_id,
    faults=faults,
)
