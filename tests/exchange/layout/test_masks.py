"""Run lengths are COCO's: hand-counted, and they decode to the mask; outlines enclose theirs: by hand, by area, and
filled in again."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from spin_usd.exchange.layout.masks import compressed, joined, outlines, run_lengths

MASKS = hnp.arrays(bool, hnp.array_shapes(min_dims=2, max_dims=2, max_side=40))
SMALL_MASKS = hnp.arrays(bool, hnp.array_shapes(min_dims=2, max_dims=2, max_side=12))


def test_runs_go_down_the_columns_and_begin_with_false() -> None:
    mask = np.array([[0, 1, 0], [1, 1, 0]], bool)
    assert run_lengths(mask) == [1, 3, 2]
    assert run_lengths(np.array([[1, 0], [0, 0]], bool)) == [0, 1, 3]
    assert run_lengths(np.zeros((2, 3), bool)) == [6]
    assert run_lengths(np.ones((2, 3), bool)) == [0, 6]


@pytest.mark.parametrize(
    ("lengths", "text"),
    [
        ([0], "0"),
        ([15], "?"),  # 48 + 15
        ([16], "`0"),  # 16 alone would read as a minus: 48 + 32 + 16, then 0
        ([31], "o0"),  # 48 + 32 + 31
        ([6, 1, 40, 4], "61X13"),  # 40 = 8 + 1 * 32: 48 + 32 + 8 = 'X', '1'; then 4 - 1 = 3
        ([1, 3, 2, 1], "132N"),  # 1 - 3 = -2: its five bits are 30
    ],
)
def test_the_text_is_cocos(lengths, text) -> None:
    assert compressed(lengths) == text


def lengths_in(text: str) -> list[int]:
    """The run lengths that the text holds, read by the format's description."""
    found: list[int] = []
    number = shift = 0
    for character in text.encode():
        number |= (character - 48 & 31) << shift
        shift += 5
        if not character - 48 & 32:
            signed = number - (1 << shift) if character - 48 & 16 else number
            found.append(signed + (found[-2] if len(found) > 2 else 0))
            number = shift = 0
    return found


@given(MASKS)
def test_the_text_holds_the_mask(mask) -> None:
    lengths = lengths_in(compressed(run_lengths(mask)))
    assert lengths == run_lengths(mask)
    values = np.arange(len(lengths)) % 2 == 1
    np.testing.assert_array_equal(np.repeat(values, lengths).reshape(mask.shape, order="F"), mask)


@given(st.lists(st.integers(1, 2**31), min_size=1))
def test_long_runs_come_back(lengths) -> None:
    assert lengths_in(compressed(lengths)) == lengths


def signed_area(corners) -> float:
    """The area within a closed line (N, 2) by the shoelace formula: positive where it goes clockwise as the image is
    seen."""
    x, y = np.asarray(corners, np.float64).T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def test_one_pixel_is_a_square_clockwise() -> None:
    mask = np.zeros((4, 5), bool)
    mask[1, 3] = True
    (ring,) = outlines(mask)
    first = ring.tolist().index([3, 1])
    assert np.roll(ring, -first, axis=0).tolist() == [[3, 1], [4, 1], [4, 2], [3, 2]]


def test_a_hole_goes_the_other_way() -> None:
    mask = np.ones((3, 3), bool)
    mask[1, 1] = False
    assert sorted(signed_area(ring) for ring in outlines(mask)) == [-1, 9]


def test_pixels_that_touch_at_a_corner_are_apart() -> None:
    assert [len(ring) for ring in outlines(np.eye(2, dtype=bool))] == [4, 4]


def test_straight_edges_have_no_corners_between_their_ends() -> None:
    assert [len(ring) for ring in outlines(np.ones((7, 9), bool))] == [4]


def test_nothing_has_no_outline() -> None:
    assert outlines(np.zeros((3, 3), bool)) == []


def filled(line, shape):
    """The pixels whose centres lie within the closed line, by the crossings of a ray to the left."""
    y, x = np.mgrid[: shape[0], : shape[1]] + 0.5
    inside = np.zeros(shape, bool)
    for (x0, y0), (x1, y1) in zip(line, np.roll(line, -1, axis=0), strict=True):
        if y0 != y1:
            at = x0 + (y - y0) * (x1 - x0) / (y1 - y0)
            inside ^= (min(y0, y1) < y) & (y < max(y0, y1)) & (at < x)
    return inside


@given(SMALL_MASKS)
def test_outlines_cover_what_the_mask_covers(mask) -> None:
    rings = outlines(mask)
    assert sum(signed_area(ring) for ring in rings) == mask.sum()
    covered = np.zeros(mask.shape, bool)
    for ring in rings:
        covered ^= filled(ring, mask.shape)
    np.testing.assert_array_equal(covered, mask)


@given(SMALL_MASKS)
def test_the_joined_line_covers_what_the_mask_covers(mask) -> None:
    if mask.any():
        line = joined(outlines(mask))
        assert signed_area(line) == mask.sum()
        np.testing.assert_array_equal(filled(line, mask.shape), mask)
