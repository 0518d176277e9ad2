"""Previews: nothing stays black, order can be seen, sheets hold every picture."""

import numpy as np
import pytest

from spin_usd.labels import preview


def luminance(rgb):
    return rgb.astype(float) @ (0.2126, 0.7152, 0.0722)


def test_nearer_is_brighter() -> None:
    metres = np.linspace(3, 9, 40, dtype=np.float32)[None]
    assert (np.diff(luminance(preview.by_distance(metres))[0]) <= 0).all()
    assert np.ptp(luminance(preview.by_distance(metres))) > 100


@pytest.mark.parametrize(
    ("colour", "empty", "seen"),
    [
        (preview.by_distance, np.zeros((2, 3), np.float32), 5.0),
        (preview.by_id, np.zeros((2, 3), np.uint16), 7),
        (preview.by_position, np.zeros((2, 3, 3), np.float32), 0.5),
    ],
)
def test_background_is_black_and_the_target_is_not(colour, empty, seen) -> None:
    assert not colour(empty).any()
    array = empty.copy()
    array[0, 1] = seen
    rgb = colour(array)
    assert rgb.dtype == np.uint8
    np.testing.assert_array_equal(np.argwhere(rgb.any(-1)), [[0, 1]])


def test_parts_have_colours_of_their_own() -> None:
    colours = np.array([preview.part_colour(i) for i in range(1, 41)], float)
    apart = np.linalg.norm(colours[:, None] - colours, axis=-1) + 1000 * np.eye(40)
    assert apart.min() > 10
    assert min(apart[i, i + 1] for i in range(39)) > 60


def test_a_parts_colour_does_not_depend_on_the_others() -> None:
    few, many = np.array([[0, 3]], np.uint16), np.array([[500, 3]], np.uint16)
    np.testing.assert_array_equal(preview.by_id(few)[0, 1], preview.by_id(many)[0, 1])


def test_dense_pose_shows_x_y_z_as_red_green_blue() -> None:
    metres = np.array([[[-1, -1, -1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]], np.float32)
    rgb = preview.by_position(metres)[0]
    low, high = rgb[0, 0], rgb[1, 0]
    assert high > low > 0
    np.testing.assert_array_equal(rgb, [[low] * 3, [high, low, low], [low, high, low], [low, low, high]])


def test_sixteen_bit_grey_becomes_eight_bit_rgb() -> None:
    np.testing.assert_array_equal(
        preview.image(np.array([[0, 256, 65535]], np.uint16))[0], [[0] * 3, [1] * 3, [255] * 3]
    )


def test_a_sheet_holds_every_picture_by_its_average() -> None:
    rows = [[np.full((120, 192, 3), 10 * i + j, np.uint8) for j in range(3)] for i in range(2)]
    sheet = preview.contact_sheet(rows, width=48)
    gap = preview.GUTTER_PX
    assert sheet.shape == (2 * (30 + gap) + gap, 3 * (48 + gap) + gap, 3)
    for i in range(2):
        for j in range(3):
            y, x = gap + i * (30 + gap), gap + j * (48 + gap)
            assert (sheet[y : y + 30, x : x + 48] == 10 * i + j).all()


def test_reducing_averages_area() -> None:
    picture = np.random.default_rng(0).integers(0, 256, (40, 60, 3)).astype(np.uint8)
    mean = picture.reshape(10, 4, 15, 4, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(preview.reduced(picture, 15), mean, atol=0.51)
