"""Outlines enclose their mask: by hand, by area, and filled in again."""

import numpy as np
from hypothesis import given
from hypothesis.extra import numpy as hnp

from spin_usd.exchange.layout.outlines import joined, outlines, signed_area

MASKS = hnp.arrays(bool, hnp.array_shapes(min_dims=2, max_dims=2, max_side=12))


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


@given(MASKS)
def test_outlines_cover_what_the_mask_covers(mask) -> None:
    rings = outlines(mask)
    assert sum(signed_area(ring) for ring in rings) == mask.sum()
    covered = np.zeros(mask.shape, bool)
    for ring in rings:
        covered ^= filled(ring, mask.shape)
    np.testing.assert_array_equal(covered, mask)


@given(MASKS)
def test_the_joined_line_covers_what_the_mask_covers(mask) -> None:
    if mask.any():
        line = joined(outlines(mask))
        assert signed_area(line) == mask.sum()
        np.testing.assert_array_equal(filled(line, mask.shape), mask)
