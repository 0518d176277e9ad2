"""The calls of children that make events: one opens a stage, the others make the light and the events of its chunks."""

from msgspec import Struct

from spin_usd.planning.worker_options import WorkerOptions
from spin_usd.processes.call import Call


class CountSteps(Struct, frozen=True, kw_only=True):
    """The request to count the time steps of events."""

    stage: str
    pictures: dict[str, list[int]]
    """Places of the pictures by variant."""


class StepCounts(Struct, frozen=True, kw_only=True):
    """The time steps of a variant's events."""

    steps: int
    seconds: float
    """Time that they cover."""
    renders: int
    """Least number of renders."""


class OpenEvents(Struct, frozen=True, kw_only=True):
    """The request to open a stage that lies in a dataset, for the events of a variant."""

    options: WorkerOptions
    variant: str
    pictures: list[int]
    """Places in the stage's frames; the events are between the first and the last."""
    labelled: bool
    """Whether events contain the ids of target and part."""
    key: str
    """Key of all that decides the events."""
    times: list[float] | None = None
    """Times of all steps; None to find them."""
    exposure: float | None = None
    """Factor of an automatic exposure; None to meter it."""
    cpus: list[int] = []
    """Processors that the worker may use."""


class OpenedEvents(Struct, frozen=True, kw_only=True):
    """A stage that is open for events."""

    times: list[float]
    """Times of all steps, seconds."""
    chunks: int
    """Number of chunks of steps."""
    chunk_key: str
    """Key of the chunks in the cache."""
    exposure: float
    """Factor of an automatic exposure; 1 if it is given."""


class ChunkMade(Struct, frozen=True, kw_only=True):
    """The result of a call on a chunk, or on all of them."""

    lost: bool = False
    """Whether a chunk was damaged or missing, so that all were removed."""


COUNT_STEPS = Call("spin_usd.events.event_stage:count_steps", CountSteps, dict[str, StepCounts])
OPEN_EVENTS = Call("spin_usd.events.in_child:EventWorker", OpenEvents, OpenedEvents)
MAKE_LIGHT = Call("spin_usd.events.in_child:EventWorker.light", int, ChunkMade)
MAKE_EVENTS = Call("spin_usd.events.in_child:EventWorker.events", int, ChunkMade)
FINISH_EVENTS = Call("spin_usd.events.in_child:EventWorker.finish", int, ChunkMade)
"""Their requests are numbers of chunks; the last one's is not used."""
