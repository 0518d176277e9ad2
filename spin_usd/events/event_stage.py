"""A stage as an event camera sees it: its scene at any time between two of its pictures, and the times of its steps."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import ceil
from pathlib import Path

from spin_usd.basics.progress import Progress
from spin_usd.events.calls import CountSteps, StepCounts
from spin_usd.events.event_limits import refuse_without_events
from spin_usd.events.light_frames import CHUNK, LEAST_RENDERS
from spin_usd.events.time_steps import time_steps
from spin_usd.scene.derived.known_targets import KnownTargets
from spin_usd.scene.event_sensor import EventSensor
from spin_usd.scene.scene import Scene
from spin_usd.stage.read.stage_reader import StageReader


class EventStage:
    """The stage at `path` in a variant. pictures: places in its frames; events are between the first and the last.

    reader: the stage's · sensor: the pixels of its camera
    Raises InputError for a stage that can have no events.
    """

    def __init__(self, path: Path, *, variant: str, pictures: Sequence[int]) -> None:
        self.reader = StageReader(path, variant=variant)
        self._targets = KnownTargets()
        frames = [self.reader.frames[place] for place in sorted(pictures)]
        self._first = frames[0]
        found = self.reader.event_sensor(self._first)
        times = [frame.time_s for frame in frames]
        refuse_without_events(times, event_camera=found is not None, where=path)
        assert found
        self.sensor: EventSensor = found
        self._seconds = [time for time in times if time is not None]
        self._detector = self.reader.scene(self._first).sensor

    def times(self, progress: Progress) -> list[float]:
        """Return the times of all steps, seconds on the stage's clock."""
        return list(time_steps(partial(self.scene, progress), self._seconds))

    def scene(self, progress: Progress, seconds: float) -> Scene:
        """Read the scene at that time; `progress` is called with how far it is."""
        start, end = self._seconds[0], self._seconds[-1]
        progress(f"events of {self.reader.variant}: second", int(seconds - start), ceil(end - start))
        code = self.reader.clock.time_code(seconds)
        # all have the first picture's name, and so its seed: noise and photographs stay the same
        frame = replace(self._first, time_code=code, time_s=seconds, utc="", source_file="")
        scene = replace(self.reader.scene(frame, instant=True), sensor=self._detector)  # one exposure for all times
        return self._targets.in_place(scene)


def count_steps(request: CountSteps, progress: Progress) -> dict[str, StepCounts]:
    """Count the time steps of each variant's events."""
    found = {}
    for variant, places in request.pictures.items():
        times = EventStage(Path(request.stage), variant=variant, pictures=places).times(progress)
        renders = 1 + -(-(len(times) - 1) // CHUNK) * (LEAST_RENDERS - 1)
        seconds = times[-1] - times[0]
        found[variant] = StepCounts(steps=len(times), seconds=seconds, renders=min(renders, len(times)))
    return found
