"""Times of pictures: seconds since a start, and the start as UTC if known."""

import re
from contextlib import suppress
from datetime import UTC, datetime, timedelta

from spin_usd.basics.json_fields import UTC_PATTERN

UTC_TEXT = re.compile(UTC_PATTERN)


def parsed_utc(text: str) -> datetime:
    """Return the time of ISO 8601 text, which is UTC unless it has an offset. Raises ValueError."""
    found = datetime.fromisoformat(text)
    return found.replace(tzinfo=UTC) if found.tzinfo is None else found.astimezone(UTC)


def is_utc(text: str) -> bool:
    """Return whether a text is a UTC as `utc_text` writes it."""
    with suppress(ValueError):
        return bool(UTC_TEXT.fullmatch(text) and parsed_utc(text))
    return False


def utc_text(time: datetime) -> str:
    """Return a time as ISO 8601 has it, to the microsecond, without zeros at its end."""
    text = time.replace(tzinfo=None).isoformat(timespec="microseconds").rstrip("0").rstrip(".")
    return f"{text}Z"


def utc_after(epoch: str, seconds: float) -> str:
    """Return the UTC so many seconds after the `epoch`, as `utc_text`. A leap second between them is not counted: there
    was none since 2017."""
    return utc_text(parsed_utc(epoch) + timedelta(seconds=seconds))
