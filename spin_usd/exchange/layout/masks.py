"""Masks as COCO's run lengths, and as polygons."""

import numpy as np
from numpy.typing import NDArray

DIGIT_BITS = 5  # of a number that a character holds, lowest first
FIRST_CHARACTER = 48
Corners = NDArray[np.int64]
STEPS = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])  # right, down, left, up: each a right turn after the one before


def run_lengths(mask: NDArray[np.bool_]) -> list[int]:
    """Lengths of the runs of False and True in turn, of a mask (H, W) read down its columns from the left. The first is
    of False, so it is 0 where the top left pixel is True."""
    down = mask.ravel(order="F")
    changes = np.flatnonzero(down[1:] != down[:-1]) + 1
    first = [0] if down[0] else []
    lengths: list[int] = np.diff([*first, *changes.tolist(), down.size], prepend=0).tolist()
    return lengths


def compressed(lengths: list[int]) -> str:
    """Write the run lengths as the short text that pycocotools reads. From the fourth on, each is written as the
    difference from the previous one of its kind.

    Source: P. Dollar and T.-Y. Lin, the mask interface of the COCO API (2014); its C file `maskApi` has the same in
    `rleEncode` and `rleToString`.
    """
    characters = bytearray()
    for place, length in enumerate(lengths):
        number = length - lengths[place - 2] if place > 2 else length
        characters += bytes(_characters(number))
    return characters.decode("ascii")


def _characters(number: int) -> list[int]:
    """Cut the number into digits; the highest bit of the last one is its sign, and a further bit marks that more
    follow."""
    digits = []
    while True:
        digit, number = number & (1 << DIGIT_BITS) - 1, number >> DIGIT_BITS
        negative = digit >> DIGIT_BITS - 1
        more = number != (-1 if negative else 0)
        digits.append(digit + (more << DIGIT_BITS) + FIRST_CHARACTER)
        if not more:
            return digits


def outlines(mask: NDArray[np.bool_]) -> list[Corners]:
    """Return the corners (N, 2), x and y, of each closed outline of a mask (H, W); (0, 0) is the image's corner.

    An outline goes along the edges of pixels, so that it covers what the mask covers. Seen in the image it goes
    clockwise around pixels and counter-clockwise around holes, so that the areas of all by the shoelace formula add up
    to the mask's. Pixels that touch only at a corner are separate.
    """
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    if not len(rows):
        return []
    y, x = int(rows[0]), int(columns[0])
    there = _edges(np.pad(mask[y : rows[-1] + 1, x : columns[-1] + 1], 1))
    starts, directions = np.divmod(np.flatnonzero(there), 4)
    points = np.stack(np.divmod(starts, there.shape[1])[::-1], -1) + np.array([x, y])
    return [points[ring] for ring in _corner_rings(_following(there), directions)]


def _edges(padded: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return (H + 1, W + 1, 4) whether an edge of the outline starts at each corner of a pixel and goes right, down,
    left or up, of a mask (H, W) that is padded by one pixel. The mask lies to the right of each edge."""
    before_down, after_down = padded[:-1, 1:], padded[1:, 1:]  # above and below the edge that goes right
    before_left, after_left = padded[1:, :-1], padded[1:, 1:]  # left and right of the edge that goes down
    there = np.zeros((*after_down.shape, 4), bool)
    there[:, :, 0] = after_down & ~before_down
    there[:, :, 1] = before_left & ~after_left
    there[:, 1:, 2] = (before_down & ~after_down)[:, :-1]
    there[1:, :, 3] = (after_left & ~before_left)[:-1]
    return there


def _following(there: NDArray[np.bool_]) -> list[int]:
    """Return the place of the edge that follows each edge, among all that there are: the rightmost."""
    flat = there.ravel()
    edges = np.flatnonzero(flat)
    starts, directions = np.divmod(edges, 4)
    ends = starts + STEPS[directions] @ (1, there.shape[1])
    right, straight, left = (4 * ends + (directions + turn) % 4 for turn in (1, 0, 3))
    following = np.where(flat[right], right, np.where(flat[straight], straight, left))
    places: list[int] = np.searchsorted(edges, following).tolist()
    return places


def _corner_rings(following: list[int], directions: NDArray[np.int64]) -> list[list[int]]:
    """Return the edges of each ring that go another way than the edge before."""
    turns = directions.tolist()
    rings, seen = [], [False] * len(following)
    for first in range(len(following)):
        ring, edge = [], first
        while not seen[edge]:
            seen[edge] = True
            if turns[following[edge]] != turns[edge]:
                ring.append(following[edge])
            edge = following[edge]
        if ring:
            rings.append(ring)
    return rings


def joined(rings: list[Corners]) -> Corners:
    """Return one closed line (N, 2) through all outlines of a mask, one at least.

    It goes from one outline to the next and back over a bridge of no width, so that it encloses what they enclose,
    holes left out.
    """
    from scipy.spatial import KDTree

    line, *others = sorted(rings, key=len, reverse=True)
    for ring in others:
        distances, nearest = KDTree(line).query(ring)
        there = int(np.argmin(distances))
        here = int(np.asarray(nearest)[there])
        line = np.concatenate([line[: here + 1], ring[there:], ring[: there + 1], line[here:]])
    return line
