"""What a render will cost: a first estimate from measured constants, refined by the run's own progress.

Measured on 2 cores of an x86-64 server with the SPEED+ camera and a 23,360-face Tango; another machine differs by
its own speed, which is why a running render's ETA uses the pictures it has made instead.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from spin_usd.dataset.job import PlannedPicture
from spin_usd.dataset.picture import IMAGE, RADIANCE
from spin_usd.labels.label import LABELS

BLENDER_SAMPLE_S = 1.25e-6  # per sample and pixel of the region of interest, of which about half are target
RAYCAST_SAMPLE_S = 0.6e-6
PASS_S = 0.03  # what a pass costs beside its samples
LABEL_PIXEL_S = 1.0e-6  # per pixel of the region: the ray, the cast, the point
FRAME_PIXEL_S = 3.5e-8  # per pixel of the whole frame and file: encode, decode again, hash, sync
START_S = 3.0  # a worker's start
BYTES_PER_REGION_PIXEL = {IMAGE: 0.35, RADIANCE: 6.0, "depth": 1.3, "segmentation": 0.03, "dense_pose": 4.0}
BYTES_PER_FRAME_PIXEL = 0.01  # compressed emptiness


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Of a whole run: pictures, renders and label passes with distinct content, bytes on disk, seconds of one core."""

    pictures: int
    distinct_renders: int
    distinct_labels: int
    bytes: int
    core_seconds: float


def estimate(
    pictures: Sequence[PlannedPicture],
    description: Mapping[str, Any],
    kinds: Sequence[str],
    renderer: str,
    samples: int,
) -> Estimate:
    """The cost of making `pictures` with the given kinds of file."""
    beauty = IMAGE in kinds or RADIANCE in kinds
    labelled = any(kind in LABELS for kind in kinds)
    width, height = description["camera"]
    region = sum(picture.region_pixels for picture in pictures)
    frame = width * height * len(pictures)
    sample_s = BLENDER_SAMPLE_S if renderer == "blender" else RAYCAST_SAMPLE_S
    seconds = START_S + FRAME_PIXEL_S * frame * len(kinds)
    if beauty:
        seconds += region * samples * sample_s + PASS_S * len(pictures)
    if labelled:
        seconds += region * LABEL_PIXEL_S + PASS_S * len(pictures)
    size = sum(region * BYTES_PER_REGION_PIXEL[kind] + frame * BYTES_PER_FRAME_PIXEL for kind in kinds)
    return Estimate(
        pictures=len(pictures),
        distinct_renders=len({picture.radiance for picture in pictures}) if beauty else 0,
        distinct_labels=len({picture.geometry for picture in pictures}) if labelled else 0,
        bytes=round(size),
        core_seconds=seconds,
    )
