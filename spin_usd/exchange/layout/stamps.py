"""When a picture was taken, for formats in which each has a time."""

from datetime import UTC, datetime, timedelta

from spin_usd.basics.utc import parsed_utc
from spin_usd.reading.picture import Picture

STEP_S = 0.1  # between two pictures without times, as KITTI's 10 Hz
EPOCH, MICROSECOND = datetime(1970, 1, 1, tzinfo=UTC), timedelta(microseconds=1)
START = datetime(2000, 1, 1, tzinfo=UTC)  # of pictures whose times have none
SAYS = (
    "Timestamps are the pictures' UTC; without UTC their seconds from 2000-01-01 on; without any times one every 0.1 s."
)


def stamp_of(picture: Picture) -> int:
    """Return the nanoseconds since 1970 of the picture's UTC, of its seconds after START, or else of one every
    STEP_S. UTC has microseconds, so it is second 0 that is rounded to them, if the picture has seconds."""
    seconds = picture.time_s
    if picture.utc is not None:
        start = parsed_utc(picture.utc) - timedelta(seconds=seconds or 0.0)
    else:
        start, seconds = START, picture.index * STEP_S if seconds is None else seconds
    return (start - EPOCH) // MICROSECOND * 1000 + round((seconds or 0.0) * 1e9)
