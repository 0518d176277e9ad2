"""A typing error gets the nearest name; any other name the list."""

from spin_usd.basics.suggestion import suggestion


def test_the_nearest_name_is_suggested_else_all() -> None:
    assert suggestion("dept", ("depth", "boxes")) == "did you mean depth?"
    assert suggestion("moon", ("depth", "boxes")) == "choose among depth, boxes"
    assert suggestion("moon", ("depth", "boxes"), "see the list") == "see the list"
