"""Boxes of pixels: they behave as the sets of pixels that they are."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from spin_usd.geometry.region import Region, union

SIZE = 12
regions = st.builds(
    lambda x, y: Region(x0=x[0], y0=y[0], x1=x[1], y1=y[1]), *[st.tuples(*[st.integers(0, SIZE)] * 2)] * 2
)


def pixels(region):
    mask = np.zeros((SIZE, SIZE), bool)
    mask[region.slices] = True
    return mask


@given(regions, regions)
def test_intersection_is_that_of_the_pixels(a, b) -> None:
    np.testing.assert_array_equal(pixels(a & b), pixels(a) & pixels(b))


@given(st.lists(regions, max_size=3))
def test_union_is_the_smallest_box_of_the_pixels(boxes) -> None:
    covered = np.array([pixels(each) for each in boxes] or [np.zeros((SIZE, SIZE), bool)]).any(0)
    rows, columns = np.nonzero(covered)
    if not len(rows):
        assert union(boxes).empty
    else:
        assert union(boxes) == Region(x0=columns.min(), y0=rows.min(), x1=columns.max() + 1, y1=rows.max() + 1)


@given(regions)
def test_shape_counts_the_pixels(region) -> None:
    mask = pixels(region)
    assert mask.sum() == region.width * region.height
    assert region.empty == (not mask.any())
    assert mask[region.slices].shape == region.shape


@given(st.builds(Region, x0=st.integers(0, 9), y0=st.integers(0, 9), x1=st.integers(0, 30000), y1=st.integers(0, 40)))
def test_bands_cover_every_row_once(region) -> None:
    rows = [row for band in region.bands() for row in range(band.y0, band.y1)]
    assert rows == list(range(region.y0, region.y1))
    assert all((band.x0, band.x1) == (region.x0, region.x1) for band in region.bands())


def test_padding_grows_each_side() -> None:
    assert Region(x0=3, y0=4, x1=5, y1=6).padded(2) == Region(x0=1, y0=2, x1=7, y1=8)
