"""A line of text says what its file would say."""

import pytest

from spin_usd.errors import InputError
from spin_usd.formats.checked_document import check_document
from spin_usd.specifications.sampling_text import is_sampling_text, sampling_document


def poses(text):
    return sampling_document(f"{text} count=5")["part"][0]["poses"]


def test_a_line_is_short_for_a_file() -> None:
    text = "range=3..10 attitude=uniform inside=0.9 count=1000 sun.direction=0,0,-1:60 target_lit_deg=70"
    document = sampling_document(text)
    check_document(document, "sample-1", "text")
    assert document == {
        "schema": "sample-1",
        "constraints": {"target_lit_deg": 70.0},
        "part": [
            {
                "name": "sample",
                "names": "img{picture:06d}",
                "pictures": 1000,
                "poses": {
                    "range": {"distribution": "uniform", "low": 3.0, "high": 10.0},
                    "attitude": {"distribution": "attitudes"},
                    "inside": 0.9,
                },
                "sample": {
                    "sun.direction": {"distribution": "directions", "axis": [0, 0, -1], "most": 60.0, "per": "frame"}
                },
            }
        ],
    }


@pytest.mark.parametrize(
    ("text", "key", "said"),
    [
        ("range=5", "range", {"distribution": "fixed", "value": 5.0}),
        ("range=log(1..1e3)", "range", {"distribution": "log_uniform", "low": 1.0, "high": 1000.0}),
        ("range=.5..2.", "range", {"distribution": "uniform", "low": 0.5, "high": 2.0}),
        ("u_share=-0.2..0.5", "u_share", {"distribution": "uniform", "low": -0.2, "high": 0.5}),
        ("inside=0.2..0.5", "inside", [0.2, 0.5]),
        ("range=5", "attitude", {"distribution": "attitudes"}),
        ("attitude=1,0,0,0", "attitude", {"distribution": "fixed", "value": [1, 0, 0, 0]}),
        ("attitude=1,0,0,0:9", "attitude", {"distribution": "attitudes_around", "around": [1, 0, 0, 0], "most": 9.0}),
        ("facing=0,1,0:30", "attitude", {"distribution": "facing", "axis": [0, 1, 0], "most": 30.0}),
    ],
)
def test_what_each_word_says(text, key, said) -> None:
    assert poses(text)[key] == said


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("earth.attitude=uniform", {"distribution": "attitudes"}),
        ("earth.attitude=1,0,0,0:9", {"distribution": "attitudes_around", "around": [1, 0, 0, 0], "most": 9.0}),
        ("earth.altitude=400..800km", {"distribution": "uniform", "low": 400.0, "high": 800.0, "unit": "km"}),
        ("earth.altitude=log(1e5..2e5)", {"distribution": "log_uniform", "low": 1e5, "high": 2e5, "unit": "m"}),
        ("earth.direction=uniform", {"distribution": "directions"}),
        ("earth.visible=false", {"distribution": "fixed", "value": False}),
    ],
)
def test_a_parameter_is_drawn_by_its_own_kind(word, said) -> None:
    document = sampling_document(f"range=3 count=5 {word}")
    check_document(document, "sample-1", "text")
    assert document["part"][0]["sample"] == {word.partition("=")[0]: {**said, "per": "frame"}}


def test_the_count_is_in_the_text_or_beside_it() -> None:
    assert sampling_document("range=5 count=7", 3)["part"][0]["pictures"] == 7
    assert sampling_document("range=5", 3)["part"][0]["pictures"] == 3


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("range=3..10", "add count"),
        ("range count=3", "'range' is not key=value"),
        ("range=3 range=4 count=3", "given twice"),
        ("ragne=3..10 count=3", "'ragne'"),
        ("range=3-10 count=3", "'range'"),
        ("range=near count=3", "'near' is not a number"),
        ("range=-5..-1 count=3", "'range': '-5..-1' contains -5; give numbers above 0"),
        ("range=0 count=3", "'range': '0' contains 0; give numbers above 0"),
        ("range=1e400 count=3", "'range': '1e400' is too large a number"),
        ("range=10..3 count=3", "'range': no number lies between 10 and 3; give the lower number first"),
        ("range=log(0..3) count=3", "'range': 'log(0..3)' contains 0; give log() numbers above 0"),
        ("range=3 count=0", "'count': 0 is not from 1 to 1000000"),
        ("range=3 count=1.5", "'count': 1.5 is not a whole number"),
        ("range=3 inside=2 count=3", "'inside': 2 is not from 0 to 1"),
        ("facing=0,0,1:-5 count=3", "'facing': -5 is not from 0 to 180"),
        ("facing=0,0,0:5 count=3", "'facing': '0,0,0:5' is all zeros"),
        ("sun.direction=0,0,-1:400 count=3", "'sun.direction': 400 is not from 0 to 180"),
        ("target_lit_deg=0..60 count=3", "'target_lit_deg': '0..60' is not a number; give one number"),
        ("target_lit_deg=400 count=3", "'target_lit_deg': 400 is not from 0 to 180"),
        ("attitude=1,0,0 count=3", "W,X,Y,Z"),
        ("attitude=uniform facing=0,0,1:3 count=3", "beside attitude"),
        ("sun.direction=up count=3", "X,Y,Z"),
        ("target_lit_deg=much count=3", "'target_lit_deg'"),
    ],
)
def test_what_is_wrong_names_the_word(text, word) -> None:
    with pytest.raises(InputError) as raised:
        sampling_document(text)
    assert word in str(raised.value)


def test_names_and_files_are_no_text() -> None:
    assert not any(map(is_sampling_text, ("speedplus", "folder/mine.toml")))
    assert is_sampling_text("range=3 count=1")
