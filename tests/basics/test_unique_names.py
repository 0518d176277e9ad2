"""Names are unlike one another, and repeats cost no more than names."""

from hypothesis import given
from hypothesis import strategies as st

from spin_usd.basics.unique_names import UniqueNames

MANY = 300_000  # what takes their square takes hours


@given(st.lists(st.sampled_from(["a", "A", "a_2", "a_1", "b", "B_2", ""])), st.booleans(), st.sampled_from([1, 2]))
def test_no_two_are_the_same(names: list[str], cased: bool, first: int) -> None:
    unique = UniqueNames(first=first, cased=cased)
    found = [unique.give(name) for name in names]
    assert len({name if cased else name.lower() for name in found}) == len(names)
    assert all(given.startswith(name) for name, given in zip(names, found, strict=True))
    assert found[:1] == names[:1]


def test_numbers_come_before_the_suffix() -> None:
    unique = UniqueNames()
    assert [unique.give("sky", ".png") for _ in range(3)] == ["sky.png", "sky_2.png", "sky_3.png"]


def test_many_repeats_end() -> None:
    unique = UniqueNames()
    assert [unique.give("a") for _ in range(MANY)][-1] == f"a_{MANY}"
