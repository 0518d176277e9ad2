"""Splits are seeded, disjoint and complete, and whoever shares a pose shares a split."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from spin_usd.commands.export.plan import named_splits, read_split
from spin_usd.errors import InputError
from spin_usd.reading.splits import poses_of, split_of_each

FRAMES = [f"img{number:06}" for number in range(100)]


def test_shares_are_read() -> None:
    assert read_split("train=0.8, validation=0.2") == {"train": 0.8, "validation": 0.2}
    assert read_split(None) == {"train": 1.0}


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("train=0.8", "sum up to 0.8; make it 1"),
        ("train=0.8,train=0.2", "has 'train' as a name"),
        ("train", "has the share ''"),
        ("train=nan,test=1", "has the share 'nan'"),
        ("train=-0.5,test=1.5", "has the share '-0.5'"),
        ("../x=1", "has '../x' as a name"),
        ("", "has '' as a name"),
    ],
)
def test_what_is_no_split_is_refused_in_a_sentence(text, sentence) -> None:
    with pytest.raises(InputError, match=sentence.replace("?", r"\?")):
        read_split(text)


def test_a_format_gives_splits_its_own_names() -> None:
    names = {"train": "train", "validation": "val"}
    assert named_splits({"train": 0.5, "validation": 0.5}, names, format_name="urso") == {"train": 0.5, "val": 0.5}
    assert named_splits({"val": 1.0}, names, format_name="urso") == {"val": 1.0}
    with pytest.raises(InputError, match="urso has no split 'dev'; choose among train, validation"):
        named_splits({"dev": 1.0}, names, format_name="urso")


@given(st.integers(0, 2**32), st.integers(1, 300), st.floats(0.01, 0.99))
def test_every_frame_is_in_one_split_and_each_has_its_share(seed, count, share) -> None:
    frames = [f"f{number}" for number in range(count)]
    found = split_of_each(frames, {"train": share, "test": 1 - share}, seed=seed)
    assert set(found) == set(frames)
    assert sum(split == "train" for split in found.values()) == round(share * count)


def test_the_seed_decides_and_the_order_of_frames_does_not() -> None:
    shares = {"train": 0.8, "validation": 0.2}
    first = split_of_each(FRAMES, shares, seed=0)
    assert split_of_each(FRAMES[::-1], shares, seed=0) == first
    assert split_of_each(FRAMES, shares, seed=1) != first


def test_frames_of_one_pose_are_one_group() -> None:
    """The third frame has the first one's pose; a variant's own pose does not take a frame out of its group."""
    pictures = [("a", b"1"), ("b", b"2"), ("c", b"1"), ("b", b"3")]
    assert poses_of(pictures) == {"a": "a", "b": "b", "c": "a"}
