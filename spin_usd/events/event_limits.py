"""What a stage and its pictures must have for events."""

from collections.abc import Sequence

from spin_usd.errors import InputError
from spin_usd.formats.event_file import LONGEST

LONGEST_S = LONGEST / 1e6 - 1  # what comes late is in the file too


def refuse_without_events(times: Sequence[float | str | None], *, event_camera: bool, where: object) -> None:
    """Raise InputError where a stage can have no events between its pictures, whose times, seconds, it says or not:
    without an event camera, and where they are too few or too far apart."""
    seconds = [float(time) for time in times if time is not None]
    if len(seconds) < len(times):
        do = "author it from a scenario, or from a list whose poses have times"
        raise InputError("does not say when its pictures are taken, and events take time", where=where, do=do)
    if len(seconds) < 2:
        do = "choose two pictures or more"
        raise InputError("events are between pictures, and there is one", where=where, do=do)
    if (length := seconds[-1] - seconds[0]) > LONGEST_S:
        apart = f"its pictures are {length:g} s apart, and a file of events holds {LONGEST_S:g} s"
        raise InputError(apart, where=where, do="choose fewer with --frames")
    if not event_camera:
        do = "author it with --event-sensor, such as evk4, or apply SpinEventSensorAPI to its camera"
        raise InputError("has no event camera", where=where, do=do)
