"""Conditions choose the pictures that Python itself chooses, and what is not a condition is refused in a sentence."""

import numpy as np
import pytest

from spin_usd.errors import InputError
from spin_usd.reading.dataset import Dataset


@pytest.fixture(scope="module")
def dataset(rendered):
    return Dataset(rendered)


def fraction(picture) -> float:
    return float(picture.targets[0].visible_fraction)


@pytest.mark.parametrize(
    ("text", "same"),
    [
        ("range < 8", lambda p: p.targets[0].range < 8),
        (
            "5 < range <= 8 or not visible > 0.5",
            lambda p: 5 < p.targets[0].range <= 8 or not p.targets[0].visible_fraction > 0.5,
        ),
        ("tango.range * 2 - 1 > index + 12", lambda p: 2 * p.targets["tango"].range - 1 > p.index + 12),
        ("-record.targets[0].box.visible[0] / 2 < -20", lambda p: p.targets[0].box_visible[0] > 40),
        ("variant in ['nominal', 'noisy'] and frame != 'img000001'", lambda p: p.frame != "img000001"),
        ("record.pose.t_cam_body[2] > 6", lambda p: p.t_cam_body[2] > 6),
        ("record['camera'].width == 240 and index not in (0, 2)", lambda p: p.index == 1),
    ],
)
def test_a_text_says_what_the_function_does(dataset, text, same) -> None:
    assert dataset.where(text).names == dataset.where(same).names


def test_what_some_pictures_lack_meets_no_comparison(dataset) -> None:
    """Only the first picture is 0 in its index, so the reciprocal of the others is a number."""
    assert len(dataset.where("1 / index > 0")) == len(dataset) - 1
    assert len(dataset.where("1 / index != 5")) == len(dataset) - 1


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("rnge < 8", "'rnge' .* is not a value of a picture; choose among frame, variant, index, .* range"),
        ("range <", "is not a condition"),
        ("tango.colour > 1", "'tango.colour' .* is not a value of a target"),
        ("cubesat.range > 1", "'cubesat' .* is not a target; choose among tango"),
        ("record.sun.colour > 1", "'record.sun.colour' .* is in no picture's record"),
        ("range < 'far'", "cannot be tested on img"),
        ("__import__('os')", "is not read in a condition"),
        ("range.__class__", "'range' .* is not a target"),
        ("[p for p in frame]", "is not read in a condition"),
        ("range is 8", "is not read in a condition"),
        ("(" * 3000, "too long"),
        ("'a' * 2000000000 == frame", "cannot be tested on img.*'a' is not a number"),
        ("[1] * 2000000000 == [1]", "is not a number"),
        ("index * 1" + "0" * 400 + " > 1", "cannot be tested on img.*too large"),
        ("index * 10" + "0" * 300 + " * " + "1" + "0" * 400 + " > 1", "too large"),
        ("-" * 1900 + "1", "is not a condition"),
    ],
)
@pytest.mark.filterwarnings("ignore::SyntaxWarning")
def test_what_is_no_condition_is_refused(dataset, text, sentence) -> None:
    with pytest.raises(InputError, match=sentence):
        dataset.where(text)


def test_the_table_has_the_same_names(dataset) -> None:
    table = pytest.importorskip("pandas") and dataset.to_dataframe()
    assert len(table) == len(dataset)
    near = dataset.where("range < 8 and visible > 0.5")
    chosen = table[(table.range < 8) & (table.visible > 0.5)]
    assert list(zip(chosen.frame, chosen.variant, strict=True)) == list(near.names)
    assert np.array_equal(table[["qw", "qx", "qy", "qz"]], [picture.q_cam_body for picture in dataset])
