"""Values that are kept as long as what they depend on is the same."""

import pytest

from spin_usd.basics.identity_memo import IdentityMemo

FIRST, SECOND = [1], [1]  # equal, and not the same


@pytest.mark.parametrize(
    ("asked", "made"),
    [
        ([(FIRST,), (FIRST,)], 1),
        ([(FIRST, SECOND), (FIRST, SECOND)], 1),
        ([(), ()], 1),
        ([(FIRST,), (SECOND,)], 2),
        ([(FIRST,), (FIRST, SECOND)], 2),
        ([(FIRST, SECOND), (FIRST,)], 2),
        ([(FIRST,), (SECOND,), (FIRST,)], 3),
    ],
)
def test_a_value_is_made_again_for_other_objects(asked: list[tuple[object, ...]], made: int) -> None:
    kept = IdentityMemo[object]()
    values = [kept.of(objects, object) for objects in asked]
    assert len(set(values)) == made


def test_a_value_that_could_not_be_made_is_tried_again() -> None:
    kept = IdentityMemo[float]()
    with pytest.raises(ZeroDivisionError):
        kept.of((FIRST,), lambda: 1 / 0)
    assert kept.of((FIRST,), lambda: 2.0) == 2.0
