"""Times as seconds and as UTC."""

from datetime import UTC, datetime

import pytest

from spin_usd.basics.utc import UTC_TEXT, parsed_utc, utc_after, utc_text


@pytest.mark.parametrize(
    ("text", "time"),
    [
        ("2026-11-26T12:00:00Z", datetime(2026, 11, 26, 12, tzinfo=UTC)),
        ("2026-11-26 12:00:00.25", datetime(2026, 11, 26, 12, 0, 0, 250_000, tzinfo=UTC)),
        ("2026-11-26T14:00:00+02:00", datetime(2026, 11, 26, 12, tzinfo=UTC)),
    ],
)
def test_text_is_utc_unless_it_says_an_offset(text: str, time: datetime) -> None:
    assert parsed_utc(text) == time
    assert UTC_TEXT.fullmatch(utc_text(time))
    assert parsed_utc(utc_text(time)) == time


def test_seconds_are_added_to_the_microsecond() -> None:
    assert utc_after("2026-12-31T23:59:58Z", 2.5) == "2027-01-01T00:00:00.5Z"
    assert utc_after("2026-12-31T23:59:58.000001Z", 0) == "2026-12-31T23:59:58.000001Z"
    assert utc_after("2026-12-31T23:59:58Z", -58) == "2026-12-31T23:59:00Z"
