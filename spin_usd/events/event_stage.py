"""A stage as an event camera sees it: its scene at any time between two of its pictures, and the times of its steps."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from spin_usd.errors import InputError
from spin_usd.events.light_frames import CHUNK, LEAST_RENDERS
from spin_usd.events.time_steps import time_steps
from spin_usd.formats.event_file import LONGEST
from spin_usd.scene.derived.known_targets import KnownTargets
from spin_usd.scene.event_sensor import EventSensor
from spin_usd.scene.scene import Scene
from spin_usd.sensor.events import MICROSECONDS
from spin_usd.stage.read.stage_reader import StageReader

LONGEST_S = LONGEST / MICROSECONDS - 1  # what comes late is in the file too


class EventStage:
    """The stage at `path` in a variant. pictures: places in its frames, between the first and the last of which events
    are.

    reader: the stage's · sensor: the pixels of its camera
    Raises InputError for a stage that does not say when they are taken, or has no event camera.
    """

    def __init__(self, path: Path, *, variant: str, pictures: Sequence[int]) -> None:
        self.reader = StageReader(path, variant=variant)
        self._targets = KnownTargets()
        frames = [self.reader.frames[place] for place in sorted(pictures)]
        self._seconds = [frame.time_s for frame in frames if frame.time_s is not None]
        if len(self._seconds) < len(frames):
            do = "author it from a scenario, or from a list whose poses have times"
            raise InputError("does not say when its pictures are taken, and events take time", where=path, do=do)
        if len(frames) < 2:
            do = "choose two pictures or more"
            raise InputError("events are between pictures, and there is one", where=path, do=do)
        if (length := self._seconds[-1] - self._seconds[0]) > LONGEST_S:
            apart = f"its pictures are {length:g} s apart, and a file of events holds {LONGEST_S:g} s"
            raise InputError(apart, where=path, do="choose fewer with --frames")
        self._first = frames[0]
        found = self.reader.event_sensor(frames[0])
        if found is None:
            do = "author it with --event-sensor, such as evk4, or apply SpinEventSensorAPI to its camera"
            raise InputError("has no event camera", where=path, do=do)
        self.sensor: EventSensor = found

    def times(self, progress: Callable[..., None]) -> list[float]:
        """Return the times of all steps, seconds on the stage's clock; `progress` is called for each scene."""
        return list(time_steps(partial(self.scene, progress), self._seconds))

    def scene(self, progress: Callable[..., None], seconds: float) -> Scene:
        """Read the scene at that time."""
        progress()
        code = self.reader.clock.time_code(seconds)
        name = f"events_{round(seconds * MICROSECONDS)}"
        frame = replace(self._first, name=name, time_code=code, time_s=seconds, utc="", source_file="")
        return self._targets.in_place(self.reader.scene(frame, instant=True))


def refuse_without_events(*, stage: str, pictures: Mapping[str, Sequence[int]]) -> None:
    """Raise InputError for a stage whose variants, given with the places of their pictures, can have no events. The
    first alone is looked at: others mostly have the same camera and times."""
    variant, places = next(iter(pictures.items()))
    EventStage(Path(stage), variant=variant, pictures=places)


def count_steps(
    *, stage: str, pictures: Mapping[str, Sequence[int]], progress: Callable[..., None]
) -> dict[str, dict[str, Any]]:
    """Return by variant, whose `pictures` are given by their places, how many `steps` its events take, over how many
    `seconds`, and how many `renders` at least."""
    found = {}
    for variant, places in pictures.items():
        times = EventStage(Path(stage), variant=variant, pictures=places).times(progress)
        renders = 1 + -(-(len(times) - 1) // CHUNK) * (LEAST_RENDERS - 1)
        found[variant] = {"steps": len(times), "seconds": times[-1] - times[0], "renders": min(renders, len(times))}
    return found
