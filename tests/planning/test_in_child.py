"""Which variants a plan is of."""

import pytest

from spin_usd.errors import InputError
from spin_usd.planning.in_child import wanted_variants

KNOWN = ("nominal", "dark", "noisy_1", "noisy_10", "noisy_2")


@pytest.mark.parametrize(
    ("asked", "found"),
    [
        ([], ["nominal"]),
        (["all"], list(KNOWN)),
        (["noisy_*"], ["noisy_1", "noisy_10", "noisy_2"]),
        (["noisy_?", "dark"], ["noisy_1", "noisy_2", "dark"]),
        (["noisy_2", "noisy_[12]"], ["noisy_2", "noisy_1"]),
    ],
)
def test_names_and_patterns_choose_variants_each_once(asked, found) -> None:
    assert wanted_variants(asked, KNOWN) == found


def test_a_pattern_that_chooses_nothing_is_refused_with_those_there_are() -> None:
    with pytest.raises(InputError, match=r"no variant 'loud_\*'; choose among nominal, dark, noisy_1"):
        wanted_variants(["dark", "loud_*"], KNOWN)
