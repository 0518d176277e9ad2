"""Run lengths are COCO's: hand-counted, and they decode to the mask."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from spin_usd.exchange.layout.run_lengths import compressed, run_lengths

MASKS = hnp.arrays(bool, hnp.array_shapes(min_dims=2, max_dims=2, max_side=40))


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
