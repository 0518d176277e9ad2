"""Requirements on a stage and its pictures for events."""

from collections.abc import Sequence

from spin_usd.errors import InputError
from spin_usd.formats.event_file import LONGEST

LONGEST_S = LONGEST / 1e6 - 1  # late events are in the file too


def refuse_without_events(times: Sequence[float | str | None], *, event_camera: bool, where: object) -> None:
    """Raise InputError if a stage cannot have events between its pictures, given their times, seconds, or None: without
    an event camera or times, with too few pictures or too long a time."""
    seconds = [float(time) for time in times if time is not None]
    if len(seconds) < len(times):
        do = "author it from a scenario, or from a list whose poses have times"
        raise InputError("does not contain the times of its pictures, which events need", where=where, do=do)
    if len(seconds) < 2:
        do = "choose two pictures or more"
        raise InputError("events are between pictures, and there is only one", where=where, do=do)
    if (length := seconds[-1] - seconds[0]) > LONGEST_S:
        apart = f"its pictures are {length:g} s apart, and a file of events covers {LONGEST_S:g} s"
        raise InputError(apart, where=where, do="choose fewer with --frames")
    if not event_camera:
        do = "author it with --event-sensor, such as evk4, or apply SpinEventSensorAPI to its camera"
        raise InputError("has no event camera", where=where, do=do)
