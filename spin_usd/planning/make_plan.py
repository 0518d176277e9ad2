"""The supervising side of a plan: the stage is read in child processes, which share out the pictures."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from spin_usd.basics.progress import Progress
from spin_usd.errors import OutputError, SpinError
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.planning.columns import COLUMNS, PLANNING
from spin_usd.planning.plan_calls import (
    OPEN_PLAN,
    PLAN_PART,
    OpenedStage,
    OpenPlan,
    PlannedPart,
    PlanPart,
    StageContent,
)
from spin_usd.planning.request import PlanRequest
from spin_usd.planning.skipped_counts import SkippedCount, skipped_counts
from spin_usd.processes.ask_child import unreadable
from spin_usd.processes.child_ahead import next_child
from spin_usd.processes.deaths import READING_TRIES, ChildDiedError
from spin_usd.processes.executor import Executor
from spin_usd.processes.task import Task
from spin_usd.records.descriptions import StageOrigin
from spin_usd.records.record import StageProvenance
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.derived.views import Views, merged

SHARED_FROM = 4000  # pictures: fewer are planned before a second process has opened the stage
STAGE_SHARE = 2  # processes at most that share the planning of a stage


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    """A planned run: the contents of the stage, and the pictures to make."""

    root: Path
    """The stage's root layer, or its copy's."""
    settings: RenderSettings
    variants: tuple[str, ...]
    """Wanted variants, in their order."""
    known_variants: tuple[str, ...]
    """All variants of the stage."""
    names: tuple[str, ...]
    """Names of all frames of the stage."""
    frames: tuple[str, ...]
    """Names of the wanted frames, in all shards."""
    stages: Mapping[str, StageProvenance]
    """Provenance of the stage by variant, relative to its own folder."""
    origin: StageOrigin
    """Inputs and options that the stage was made from."""
    content: StageContent
    """Content that all pictures share."""
    pictures: tuple[PlannedPicture, ...]
    """Pictures to make, by variant, then in the stage's order."""
    skipped: tuple[SkippedCount, ...] = ()
    """Work that they do not need, if it was counted."""
    notes: tuple[str, ...] = ()
    """Sentences on differences between the render and the stage."""
    views: Views | None = None
    """Summary of the pictures' contents."""
    trial_s: float | None = None
    """Seconds of a trial of this machine; None without one."""


def make_plan(question: PlanRequest, *, processes: int, progress: Progress) -> Plan:
    """Read the stage in children: a malicious one harms nothing else. A child that dies is replaced.

    Raises the errors of children; if they die again and again, RenderError if they were killed, and StageError if the
    stage is the cause.
    """
    try:
        return _plan(question, processes, progress)
    except ChildDiedError as died:
        raise unreadable(died, question.request.stage) from died
    except SpinError as e:
        if question.copy_to is None or e.where is None or isinstance(e, OutputError):  # a fault of our copy
            raise
        where = str(e.where).replace(
            str(question.copy_to), str(question.request.stage.parent)
        )  # the user's file, not our copy
        raise type(e)(e.found, where=where, do=e.do) from e


def _plan(question: PlanRequest, processes: int, progress: Progress) -> Plan:
    asked = question.request
    writes = (question.copy_to.parent,) if question.copy_to else ()
    with Executor[None](lambda _: next_child(OPEN_PLAN, writes=writes), workers=processes) as executor:
        opened = executor.call(
            OPEN_PLAN,
            OpenPlan(
                stage=str(asked.stage.absolute()),
                variants=asked.variants,
                frames=asked.options.frames,
                seed=asked.options.seed,
                devices=question.devices,
                renders=asked.renders,
                copy_to=str(question.copy_to) if question.copy_to else None,
                trial=question.trial,
            ),
            progress=progress,
        )
        settings = RenderSettings(renderer=asked.renderer, effort=asked.effort, seed=opened.seed, device=opened.device)
        chosen = _chosen(question, opened)
        pictures = len(chosen) * len(opened.variants)
        done = _SharedProgress(progress, pictures)
        count = sharing(pictures, processes)
        tasks = [
            Task(
                call=PLAN_PART,
                request=_request(question, opened, settings, part, number, count),
                tries=READING_TRIES,
                progress=done.of(number),
            )
            for number, part in enumerate(_parts(chosen, count))
        ]
        answers = [task.result for task in executor.in_order(tasks)]
    return _merged(opened, settings, answers)


class _SharedProgress:
    """Progress of several children together, over `total` pictures."""

    def __init__(self, progress: Progress, total: int) -> None:
        self._progress, self._total = progress, total
        self._done: dict[int, int] = {}

    def of(self, number: int) -> Progress:
        """Return the callback for the progress of the child of that number."""

        def report(what: str, done: int, total: int) -> None:
            self._done[number] = done
            self._progress(PLANNING, sum(self._done.values()), self._total)

        return report


def _request(
    question: PlanRequest,
    opened: OpenedStage,
    settings: RenderSettings,
    chosen: list[int],
    number: int,
    count: int,
) -> PlanPart:
    """Return the request to the `number`th of `count` children for the `chosen` frames."""
    return PlanPart(
        root=opened.root,
        variants=opened.variants,
        chosen=chosen,
        settings=settings,
        image_suffix=question.request.image_suffix if question.request.image else None,
        renders=question.request.renders,
        labels=question.labels,
        provenance=tuple(opened.variants[number::count]),
        explain=question.explain,
    )


def _merged(opened: OpenedStage, settings: RenderSettings, answers: Sequence[list[PlannedPart]]) -> Plan:
    """Return the plan in the children's `answers`, each a part of every variant."""
    parts_in_order = [part for parts in zip(*answers, strict=True) for part in parts]
    stages = {part.variant: part.stage for part in parts_in_order if part.stage}
    return Plan(
        root=Path(opened.root),
        settings=settings,
        variants=tuple(opened.variants),
        known_variants=tuple(opened.known_variants),
        names=tuple(opened.names),
        frames=tuple(opened.names[place] for place in opened.chosen),
        stages={variant: stages[variant] for variant in opened.variants},
        origin=opened.origin,
        content=opened.content,
        pictures=tuple(_pictures(answers)),
        notes=tuple(dict.fromkeys(note for parts in answers for part in parts for note in part.notes)),
        views=merged([part.views for part in parts_in_order if part.views]),
        skipped=skipped_counts((part.variant, part.skipped) for part in parts_in_order),
        trial_s=opened.trial_s,
    )


def _chosen(question: PlanRequest, opened: OpenedStage) -> list[int]:
    """Return the places in the stage of the frames to plan."""
    chosen: list[int] = opened.chosen
    if question.shard is None:
        return chosen
    return [chosen[place] for place in question.shard.own([opened.names[place] for place in chosen])]


def _parts(chosen: list[int], count: int) -> Iterator[list[int]]:
    """Yield `count` equal runs of the chosen frames."""
    for number in range(count):
        yield chosen[len(chosen) * number // count : len(chosen) * (number + 1) // count]


def sharing(pictures: int, processes: int) -> int:
    """Return how many of the processes share the planning of the pictures, in all their variants."""
    return min(processes, STAGE_SHARE) if pictures >= SHARED_FROM else 1


def _pictures(answers: Sequence[list[PlannedPart]]) -> Iterator[PlannedPicture]:
    """Yield all pictures; equal keys are one string, for most are the same as in the variant before."""
    known: dict[str, str] = {}
    alike: dict[tuple[str, ...], tuple[str, ...]] = {}
    before: list[dict[str, list[Any]]] = [{} for _ in answers]
    for parts in zip(*answers, strict=True):  # of one variant
        for part, columns in zip(parts, before, strict=True):
            columns.update((name, column) for name in COLUMNS if (column := part.columns[name]) is not None)
            for index, frame, time_code, *keys, extent, groups, features, stated, label_keys in zip(
                *(columns[name] for name in COLUMNS), strict=True
            ):
                geometry, radiance, exposure, targets = (known.setdefault(key, key) for key in keys)
                yield PlannedPicture(
                    variant=part.variant,
                    index=index,
                    frame=known.setdefault(frame, frame),
                    time_code=time_code,
                    geometry=geometry,
                    radiance=radiance,
                    exposure=exposure,
                    targets=targets,
                    region=tuple(extent[:4]),
                    target_pixels=extent[4],
                    light_groups=groups,
                    features=alike.setdefault(tuple(features), tuple(features)),
                    stated=stated,
                    label_keys=label_keys,
                )
