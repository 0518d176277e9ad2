"""Times of pose lists: exact until the first one is subtracted, in the unit that the file or their size gives."""

from datetime import UTC, datetime, timedelta
from decimal import Decimal, InvalidOperation

from spin_usd.errors import InputError

PLACES = {
    **dict.fromkeys(("s", "sec", "secs", "seconds"), 0),
    **dict.fromkeys(("ms", "msec", "msecs", "milliseconds"), 3),
    **dict.fromkeys(("us", "usec", "usecs", "\N{MICRO SIGN}s", "\N{GREEK SMALL LETTER MU}s", "microseconds"), 6),
    **dict.fromkeys(("ns", "nsec", "nsecs", "nanosec", "nanoseconds"), 9),
}
"""Units of time in small letters, as powers of ten in a second."""
SINCE_1970 = {"nanoseconds": 10**17, "microseconds": 10**14, "milliseconds": 10**11}
"""Least stamps of each unit, those of 1973. As the next larger unit the same numbers are years after 5000."""
LARGEST = 10**20
STAMP_S = 10**8  # from here on a time counts from 1970, not from the list's start
NO_STAMP_S = 5 * 10**9  # and from the year 2128 on it counts from something else
UNIX = datetime(1970, 1, 1, tzinfo=UTC)


class PoseTimes:
    """The times of one list, from its first row on."""

    def __init__(self, unit: str = "", *, from_first: bool = False) -> None:
        """unit: one of PLACES, "" if the file gives none. from_first: True if second 0 is always the first row."""
        self.by_size = False
        """Whether the unit is by the size of the first time."""
        self.unit, self._from_first = unit, from_first
        self._first: Decimal | None = None

    @property
    def note(self) -> str:
        return f"its times are too large for seconds since 1970: they are taken for {self.unit}"

    @property
    def epoch(self) -> datetime | None:
        """UTC of second 0, to the microsecond, if times are so large that they count from 1970."""
        first = 0 if self._first is None else round(self._first.scaleb(6 - PLACES[self.unit]))
        return UNIX + timedelta(microseconds=first) if STAMP_S * 10**6 <= first < NO_STAMP_S * 10**6 else None

    def seconds(self, text: str, where: str) -> float:
        """Return the seconds of a row. Raises InputError."""
        try:
            time = Decimal(text)
        except InvalidOperation:
            time = Decimal("nan")
        if "_" in text or not (time.is_finite() and -LARGEST < time < LARGEST):
            do = "give seconds, or UTC such as 2026-11-26T12:00:00.5Z"
            raise InputError(f"has the time {text!r}", where=where, do=do)
        if self._first is None:
            if not self.unit:
                self.unit = next((unit for unit, least in SINCE_1970.items() if time >= least), "s")
                self.by_size = self.unit != "s"
            counted = self._from_first or time >= Decimal(STAMP_S).scaleb(PLACES[self.unit])
            self._first = time if counted else Decimal(0)
        return float((time - self._first).scaleb(-PLACES[self.unit]))
