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
    STEP_S."""
    if picture.utc is not None:
        return (parsed_utc(picture.utc) - EPOCH) // MICROSECOND * 1000
    seconds = picture.index * STEP_S if picture.time_s is None else picture.time_s
    return (START - EPOCH) // MICROSECOND * 1000 + round(seconds * 1e9)
