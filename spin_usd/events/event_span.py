"""The span of time that events are of, from the first to the last of their pictures."""

from collections.abc import Sequence

from spin_usd.errors import InputError
from spin_usd.formats.event_file import LONGEST

LONGEST_S = LONGEST / 1e6 - 1  # what comes late is in the file too


def event_span(pictures: Sequence[float | str | None], *, event_camera: bool, where: object) -> list[float]:
    """Return the times of the pictures, seconds, given those that the stage `where` says. Raises InputError for one
    that does not say all, has no event camera, or of which there are too few pictures or too many."""
    seconds = [each for each in pictures if isinstance(each, float)]
    if len(seconds) < len(pictures):
        do = "author it from a scenario, or from a list whose poses have times"
        raise InputError("does not say when its pictures are taken, and events take time", where=where, do=do)
    if len(pictures) < 2:
        do = "choose two pictures or more"
        raise InputError("events are between pictures, and there is one", where=where, do=do)
    if (length := seconds[-1] - seconds[0]) > LONGEST_S:
        apart = f"its pictures are {length:g} s apart, and a file of events holds {LONGEST_S:g} s"
        raise InputError(apart, where=where, do="choose fewer with --frames")
    if not event_camera:
        do = "author it with --event-sensor, such as evk4, or apply SpinEventSensorAPI to its camera"
        raise InputError("has no event camera", where=where, do=do)
    return seconds
