"""The table of measures: of a picture, of a pair, of its parts."""

import numpy as np

from spin_usd.realism.measures import (
    PAIR_MEASURES,
    PICTURE_MEASURES,
    compared,
    compared_parts,
    measured,
    silhouette,
)
from spin_usd.realism.picture_view import PictureView
from tests.cases.drawn_pictures import ellipse, view, written

SIZE = (192, 256)
TARGET = ellipse(SIZE)


def picture(seed, noise=3.0):
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    signal = np.where(TARGET, 60 + 40 * np.sin(x / 9) * np.cos(y / 13), 0)
    return view(written(signal, level=30, noise=noise, seed=seed), TARGET)


def test_names_and_units_are_given_once() -> None:
    names = [each.name for each in (*PICTURE_MEASURES, *PAIR_MEASURES)]
    assert len(names) == len(set(names))
    assert all(each.description.endswith(".") for each in (*PICTURE_MEASURES, *PAIR_MEASURES))


def test_equal_pictures_have_equal_measures() -> None:
    one = picture(1)
    assert measured(one, one) == measured(one, picture(1))
    assert compared(one, one) == {"correlation": 1.0, "wasserstein": 0.0} | compared(one, one)
    assert abs(compared(one, one)["correlation"] - 1) < 1e-12


def test_dark_is_decided_by_the_noisier_of_the_two() -> None:
    """A clean picture is not called brighter than the room where noise would hide the difference."""
    dim = np.where(TARGET, 2.0, 0)
    clean, noisy = (view(30 + dim, TARGET), view(written(dim, level=30, noise=12, seed=1), TARGET))
    assert measured(clean, clean)["dark_share"] == 0
    assert measured(clean, noisy)["dark_share"] == 1


def test_parts_are_compared_by_name_if_they_are_seen() -> None:
    parts = np.where(TARGET, np.where(np.arange(SIZE[1]) < SIZE[1] // 2, 1, 2), 0)
    real, ours = (PictureView(grey=picture(seed).grey, parts=parts) for seed in (1, 2))
    found = dict(compared_parts(real, ours, {1: "left", 2: "right", 3: "unseen"}))
    assert list(found) == ["left", "right"]
    assert all(each["correlation"] > 0.9 for each in found.values())
    assert found["left"]["pixels"] < (parts == 1).sum()


def test_the_silhouette_of_a_true_mask_is_where_it_is() -> None:
    found = silhouette(picture(1))
    assert abs(found.median) <= 1
    assert found.edges > 0.9 * found.searched
