"""The calls of children that measure: one opens a stage with a renderer, the others render and compare."""

from types import NoneType

from msgspec import Struct

from spin_usd.accuracy.measurement import Configuration, Figures, LabelFigures, MeasuredPicture, Saving
from spin_usd.processes.call import Call
from spin_usd.scene.effort import Effort

Keys = list[str]
"""Keys of stored renders."""


class OpenMeasuring(Struct, frozen=True, kw_only=True):
    """The request to open a stage and a renderer."""

    stage: str
    variant: str
    folder: str
    """Folder of the renders."""
    work: str
    """Folder for temporary files."""
    cpus: list[int]
    """Processors that the worker may use."""
    renderer: str
    crop: bool = True
    """Whether only the target's region is rendered."""


class MakeRuns(Struct, frozen=True, kw_only=True):
    """The request to render a picture with several seeds; progress names each render by its key."""

    index: int
    """Place of the picture in the stage."""
    effort: Effort
    seeds: dict[str, int]
    """Seeds by the keys under which the renders are stored."""


class SeedPairs(Struct, frozen=True, kw_only=True):
    """Renders with and without some work, seed by seed."""

    with_it: Keys
    without: Keys


class MakePairs(Struct, frozen=True, kw_only=True):
    """The request to render a picture with some work and without any, for each seed."""

    index: int
    effort: Effort
    work: list[str]
    seeds: list[int]
    pairs: SeedPairs
    """Keys under which the renders are stored."""


class RenderOnce(Struct, frozen=True, kw_only=True):
    """The request for one render of a picture."""

    index: int
    effort: Effort
    seed: int = 0


class FindErrors(Struct, frozen=True, kw_only=True):
    """The request for the errors of settings of a picture."""

    index: int
    reference: Keys
    runs: list[Keys]
    """Renders of each setting."""


class FoundErrors(Struct, frozen=True, kw_only=True):
    """Relative mean square errors."""

    reference: float
    settings: list[float]


class FindFigures(Struct, frozen=True, kw_only=True):
    """The request for the figures of settings of a picture."""

    index: int
    seed: int
    """Seed of the dataset, for the background."""
    reference: Keys
    reference_samples: int
    capped: bool
    """Whether the reference was cut off before it was good enough."""
    settings: list[Configuration]
    runs: list[Keys]
    """Renders of each setting."""


class FoundFigures(Struct, frozen=True, kw_only=True):
    """A picture that was measured."""

    picture: MeasuredPicture
    figures: list[Figures]


class FindSavings(Struct, frozen=True, kw_only=True):
    """The request for the savings and changes by leaving work out of a picture."""

    index: int
    reference: Keys
    runs: dict[str, SeedPairs]
    """Renders by the work left out."""


_WORKER = "spin_usd.commands.measure.worker:MeasuringWorker"
OPEN_MEASURING = Call(_WORKER, OpenMeasuring, NoneType)
MAKE_RUNS = Call(f"{_WORKER}.make_runs", MakeRuns, NoneType)
MAKE_PAIRS = Call(f"{_WORKER}.make_pairs", MakePairs, NoneType)
RENDER_DIGEST = Call(f"{_WORKER}.render_digest", RenderOnce, str)
COMPARE_LABELS = Call(f"{_WORKER}.labels", int, LabelFigures)
FIND_ERRORS = Call(f"{_WORKER}.errors", FindErrors, FoundErrors)
FIND_FIGURES = Call(f"{_WORKER}.figures", FindFigures, FoundFigures)
FIND_SKIPPED_WORK = Call(f"{_WORKER}.skipped_work", RenderOnce, list[str])
FIND_SAVINGS = Call(f"{_WORKER}.savings", FindSavings, list[Saving])
