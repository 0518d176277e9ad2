"""What is kept is what was used last, and no more of it than fits."""

from spin_usd.studio.recently_used import RecentlyUsed


def test_what_was_not_used_for_longest_goes_first() -> None:
    kept = RecentlyUsed[str](10)
    for key in "abc":
        kept.keep(key, key.upper(), 4)
    assert [kept.find(key) for key in "abc"] == [None, "B", "C"]
    kept.find("b")
    kept.keep("d", "D", 3)
    assert [kept.find(key) for key in "abcd"] == [None, "B", None, "D"]


def test_one_is_kept_whatever_its_size_and_again_counts_once() -> None:
    kept = RecentlyUsed[str](10)
    kept.keep("large", "x", 100)
    assert kept.find("large") == "x"
    kept.keep("small", "y", 6)
    kept.keep("small", "z", 4)
    kept.keep("other", "w", 6)
    assert [kept.find(key) for key in ("large", "small", "other")] == [None, "z", "w"]
