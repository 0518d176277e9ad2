"""The kinds of file that a picture has, and the passes that make them: known to a plan without making any."""

from collections.abc import Mapping

from spin_usd.labels.table import LABELS
from spin_usd.scene.channels import Channels

IMAGE = "image"
RADIANCE = "radiance"
COLOURS = {"R": "red", "G": "green", "B": "blue"}
RADIANCE_CHANNELS = Channels(
    meaning="the target's linear radiance R, G, B, W/m2/sr, and the share of the pixel it covers, A; float32",
    dtype="float32",
    holds={**COLOURS, "A": "coverage"},
    unit="W/m2/sr",
    encoding="linear",
)
IMAGE_CHANNELS = {"mono": {"Y": "grey"}, "rgb": COLOURS}
LAYOUTS: dict[str, tuple[Mapping[str, str], ...]] = {
    IMAGE: tuple(IMAGE_CHANNELS.values()),
    RADIANCE: (RADIANCE_CHANNELS.holds,),
    **{name: (label.channels.holds,) for name, label in LABELS.items()},
}
"""Channels that each kind of file can have."""
IMAGE_MEANING = "what the sensor wrote; its bits, channels and transfer curve are in each record"
RENDERED = frozenset({IMAGE, RADIANCE})
"""The kinds of file that show light, which a renderer makes; labels need no renderer."""
FILE_KINDS = (IMAGE, RADIANCE, *LABELS)
LABEL_PASS, BEAM_PASS, BEAUTY_PASS = "label pass", "beam pass", "beauty pass"
DEVICE_PASS = "beauty pass on a device"  # a graphics processor, which workers share
