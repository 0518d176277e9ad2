"""What colours the images of a planet may have."""

from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType

from spin_usd.scene.texture import Image
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import AT_LEAST_0, SHARE, Range

COLOURS: Mapping[str, Range] = MappingProxyType(
    {schema.PLANET_ALBEDO_FILE: SHARE, schema.PLANET_NIGHT_FILE: AT_LEAST_0}
)
"""The linear red, green and blue that an image may hold, by the attribute that names its file."""


def colours_outside(image: Image, attribute: str) -> str | None:
    """Return in words which colours the image holds, where some are outside what `attribute` allows; else None."""
    low, high = _extremes(image)
    allowed = COLOURS[attribute]
    return None if low in allowed and high in allowed else f"holds colours from {low:.3g} to {high:.3g}"


@lru_cache(maxsize=4)
def _extremes(image: Image) -> tuple[float, float]:
    """Return its least and its greatest colour. It is cached: a map of a planet has millions of pixels."""
    colours = image.extremes[:, :3]
    return float(colours.min()), float(colours.max())
