"""Masks: the visible pixels of each target, and its whole silhouette without occlusion.

A file contains the masks of all targets, since they overlap: bit i - 1 of a pixel, whose value is 2 ** (i - 1), is set
where target i covers it.
"""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from spin_usd.labels.label import Label
from spin_usd.labels.labelled_picture import LabelFault, LabelledPicture
from spin_usd.labels.preview import by_bit
from spin_usd.scene.channels import Channels
from spin_usd.scene.derived.surface import Surface
from spin_usd.scene.scene import Scene

MAX_TARGETS = 16  # a bit each


def mask_visible(scene: Scene, surface: Surface) -> NDArray[np.uint16]:
    """Return (H, W) uint16: the bit of the target that is seen."""
    bits = np.array([0, *_bits(scene)], np.uint16)
    return surface.image(bits[surface.target], np.uint16)


def mask_amodal(scene: Scene, surface: Surface) -> NDArray[np.uint16]:
    """Return (H, W) uint16: the bits of the targets that would be seen if each were alone."""
    frame = np.zeros(scene.camera.frame.shape, np.uint16)
    for bit, alone in zip(_bits(scene), surface.alone, strict=False):  # targets come before occluders
        frame[alone.region.slices] |= np.where(alone.face >= 0, np.uint16(bit), np.uint16(0))
    return frame


def _bits(scene: Scene) -> list[int]:
    """Return the value of the bit of each of the scene's targets."""
    return [1 << (body.id - 1) for body in scene.targets]


def faults_visible(picture: LabelledPicture) -> Iterator[LabelFault]:
    """The visible mask is of the target that each pixel shows."""
    ids = picture.target_ids
    if ids is not None and ((1 << ids.astype(np.int64)) >> 1 != picture.arrays["mask_visible"]).any():
        yield LabelFault(code="support", message="mask_visible and instance or segmentation show different targets")


def faults_amodal(picture: LabelledPicture) -> Iterator[LabelFault]:
    """A target is where it is seen."""
    visible = picture.arrays.get("mask_visible")
    if visible is not None and (visible & ~picture.arrays["mask_amodal"]).any():
        yield LabelFault(code="support", message="mask_visible covers pixels outside mask_amodal")


def _mask(
    name: str,
    make: Callable[[Scene, Surface], NDArray[np.uint16]],
    faults: Callable[[LabelledPicture], Iterator[LabelFault]],
    meaning: str,
) -> Label:
    return Label(
        name=name,
        make=make,
        channels=Channels(
            meaning=f"{meaning}, 16-bit: bit i - 1 is set for target i; 0 = none",
            dtype="uint16",
            holds={"Y": "a bit a target"},
        ),
        suffix=".png",
        usd_type="int",
        file_bytes=0.01,
        max_targets=MAX_TARGETS,
        preview=by_bit,
        faults=faults,
    )


MASK_VISIBLE = _mask("mask_visible", mask_visible, faults_visible, "which target is seen")
MASK_AMODAL = _mask("mask_amodal", mask_amodal, faults_amodal, "which targets would be seen if each were alone")
