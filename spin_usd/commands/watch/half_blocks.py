"""A picture as characters of a terminal: each is two pixels, the upper one its colour, the lower one its background."""

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from spin_usd.files.new_file import write_whole
from spin_usd.formats.arrays.image_file import read_image
from spin_usd.labels.preview import reduced

UPPER_HALF, RESET = "\u2580", "\x1b[0m"


def half_blocks(png: bytes, columns: int) -> Iterator[str]:
    """Yield the lines that show the picture (PNG, RGB) so many characters wide, in 24-bit colours (ISO 8613-6)."""
    with TemporaryDirectory(prefix="spin_usd-") as folder:
        file = Path(folder, "picture.png")
        write_whole(file, png)
        pixels = reduced(read_image(file)[0], columns)
    even = np.pad(pixels, ((0, len(pixels) % 2), (0, 0), (0, 0)))
    for upper, lower in zip(even[::2].tolist(), even[1::2].tolist(), strict=True):
        pairs = zip(upper, lower, strict=True)
        yield "".join(f"\x1b[38;2;{_code(above)};48;2;{_code(below)}m{UPPER_HALF}" for above, below in pairs) + RESET


def _code(colour: list[int]) -> str:
    return ";".join(map(str, colour))
