"""Masks as COCO's run lengths: column by column, and as the short text that pycocotools reads.

Source: P. Dollar and T.-Y. Lin, the mask interface of the COCO API (2014); its C file `maskApi` has the same in
`rleEncode` and `rleToString`.
"""

import numpy as np
from numpy.typing import NDArray

DIGIT_BITS = 5  # a character holds so many bits of a number, lowest first
FIRST_CHARACTER = 48


def run_lengths(mask: NDArray[np.bool_]) -> list[int]:
    """Lengths of the runs of False and True in turn, of a mask (H, W) read down its columns from the left. The first is
    of False, so it is 0 where the top left pixel is True."""
    down = mask.ravel(order="F")
    changes = np.flatnonzero(down[1:] != down[:-1]) + 1
    first = [0] if down[0] else []
    lengths: list[int] = np.diff([*first, *changes.tolist(), down.size], prepend=0).tolist()
    return lengths


def compressed(lengths: list[int]) -> str:
    """Write the run lengths as text. From the fourth on each is written as what it has more than the one of its kind
    before it."""
    characters = bytearray()
    for place, length in enumerate(lengths):
        number = length - lengths[place - 2] if place > 2 else length
        characters += bytes(_characters(number))
    return characters.decode("ascii")


def _characters(number: int) -> list[int]:
    """Cut the number into digits; the highest bit of the last one is its sign, and a further bit says that more
    follow."""
    digits = []
    while True:
        digit, number = number & (1 << DIGIT_BITS) - 1, number >> DIGIT_BITS
        negative = digit >> DIGIT_BITS - 1
        more = number != (-1 if negative else 0)
        digits.append(digit + (more << DIGIT_BITS) + FIRST_CHARACTER)
        if not more:
            return digits
