"""The supervising side of a plan: the stage is read in child processes, which share out the pictures."""

import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from msgspec import convert

from spin_usd.basics.progress import Progress
from spin_usd.errors import OutputError, SpinError
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.planning.columns import COLUMNS, PLANNING
from spin_usd.planning.opened_stage import OpenedStage, StageContent
from spin_usd.planning.request import PlanRequest
from spin_usd.planning.skipped_counts import SkippedCount, skipped_counts
from spin_usd.processes.ask_child import unreadable
from spin_usd.processes.child import Child
from spin_usd.processes.child_ahead import next_child
from spin_usd.processes.child_limits import PATIENCE_S
from spin_usd.processes.deaths import READING_TRIES, ChildDiedError, Retries
from spin_usd.processes.pool import Answered, Failed, Pool, Reported
from spin_usd.records.descriptions import StageOrigin
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.derived.views import Views, merged

SHARED_FROM = 4000  # pictures: fewer are planned before a second process has opened the stage
STAGE_SHARE = 2  # processes at most that share the planning of a stage


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    """A run planned: what the stage holds and what a run would make of it."""

    root: Path
    """The stage's root layer, or its copy's."""
    settings: RenderSettings
    variants: tuple[str, ...]
    """Those wanted, in their order."""
    known_variants: tuple[str, ...]
    """All of the stage's."""
    names: tuple[str, ...]
    """Those of all of the stage's frames."""
    frames: tuple[str, ...]
    """Names of those wanted, in all shards."""
    stages: Mapping[str, Mapping[str, Any]]
    """What a record says of the stage, by variant."""
    origin: StageOrigin
    """What the stage was made from."""
    content: StageContent
    """What all pictures share."""
    pictures: tuple[PlannedPicture, ...]
    """Those to make, by variant, then in the stage's order."""
    skipped: tuple[SkippedCount, ...] = ()
    """What of their work they do not need, where that was asked."""
    notes: tuple[str, ...] = ()
    """Sentences on what is rendered otherwise than the stage says."""
    views: Views | None = None
    """What the pictures show."""
    trial_s: float | None = None
    """Seconds of a trial of this machine; None where nobody asked."""


def make_plan(question: PlanRequest, *, processes: int, progress: Progress) -> Plan:
    """Read the stage in children: one that was made to harm ends those, and nothing else. One that dies is replaced.

    Raises what they raise; where they die again and again, RenderError if they were killed, and StageError if it is of
    the stage.
    """
    try:
        return _plan(question, processes, progress)
    except ChildDiedError as died:
        raise unreadable(died, question.request.stage) from died
    except SpinError as e:
        if question.copy_to is None or e.where is None or isinstance(e, OutputError):  # that is about our copy
            raise
        where = str(e.where).replace(
            str(question.copy_to), str(question.request.stage.parent)
        )  # the user's file, not our copy
        raise type(e)(e.found, where=where, do=e.do) from e


def _plan(question: PlanRequest, processes: int, progress: Progress) -> Plan:
    with Pool[int]() as pool:
        first, opened = _opened(question)
        pool.add(0, first)
        settings = RenderSettings(
            renderer=question.request.renderer,
            effort=question.request.effort,
            seed=opened.seed,
            device=opened.device,
        )
        chosen = _chosen(question, opened)
        pictures = len(chosen) * len(opened.variants)
        count = sharing(pictures, processes)
        for number in range(1, count):
            pool.add(number, Child())
        requests = [
            _request(question, opened, settings, part, number, count)
            for number, part in enumerate(_parts(chosen, count))
        ]
        answers = _answers(pool, requests, lambda done: progress(PLANNING, done, pictures))
    return _merged(opened, settings, answers)


def _request(
    question: PlanRequest,
    opened: OpenedStage,
    settings: RenderSettings,
    chosen: Sequence[int],
    number: int,
    count: int,
) -> dict[str, Any]:
    """Return what the `number`th of `count` children is asked of the `chosen` frames."""
    return {
        "root": opened.root,
        "variants": opened.variants,
        "chosen": chosen,
        "settings": asdict(settings),
        "image_suffix": question.request.image_suffix if question.request.image else None,
        "renders": question.request.renders,
        "labels": question.labels,
        "provenance": opened.variants[number::count],
        "explain": question.explain,
    }


def _merged(opened: OpenedStage, settings: RenderSettings, answers: Sequence[Any]) -> Plan:
    """Return the plan in the children's `answers`, each a part of every variant."""
    parts_in_order = [part for parts in zip(*answers, strict=True) for part in parts]
    stages = {part["variant"]: part["stage"] for part in parts_in_order if part["stage"]}
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
        notes=tuple(dict.fromkeys(note for parts in answers for part in parts for note in part["notes"])),
        views=merged([convert(part["views"], Views) for part in parts_in_order if part["views"]]),
        skipped=skipped_counts((part["variant"], part["skipped"]) for part in parts_in_order),
        trial_s=opened.trial_s,
    )


def _opened(question: PlanRequest) -> tuple[Child, OpenedStage]:
    """Open the stage in a child; return that and what it answers. Raises ChildDiedError where several die."""
    asked, retries = question.request, Retries(READING_TRIES)
    while True:
        child = next_child()
        try:
            answer = child.call(
                "open_plan",
                stage=str(asked.stage.absolute()),
                variants=asked.variants,
                frames=asked.options.frames,
                seed=asked.options.seed,
                devices=question.devices,
                renders=asked.renders,
                copy_to=str(question.copy_to) if question.copy_to else None,
                trial=question.trial,
                within_s=PATIENCE_S,
            )
            return child, convert(answer, OpenedStage)
        except ChildDiedError as died:
            child.kill()
            if not retries.may_try_again(died):
                raise ChildDiedError(retries.in_words(died), cause=died.cause) from died
            if question.copy_to:
                shutil.rmtree(question.copy_to, ignore_errors=True)  # half a copy
        except BaseException:
            child.kill()
            raise


def _chosen(question: PlanRequest, opened: OpenedStage) -> list[int]:
    """Return the places in the stage of the frames to plan."""
    chosen: list[int] = opened.chosen
    if question.shard is None:
        return chosen
    return [chosen[place] for place in question.shard.own([opened.names[place] for place in chosen])]


def _parts(chosen: Sequence[int], count: int) -> Iterator[Sequence[int]]:
    """Yield `count` equal runs of the chosen frames."""
    for number in range(count):
        yield chosen[len(chosen) * number // count : len(chosen) * (number + 1) // count]


def sharing(pictures: int, processes: int) -> int:
    """Return how many of the processes share the planning of the pictures, in all their variants."""
    return min(processes, STAGE_SHARE) if pictures >= SHARED_FROM else 1


def _answers(pool: Pool[int], requests: Sequence[Mapping[str, Any]], progress: Callable[[int], None]) -> list[Any]:
    """Ask each child of the pool its own of these, and return what they answer, in their order; one that dies is
    replaced. Raises what one of them fails with, ChildDiedError where several die over the same request."""
    answers: dict[int, Any] = {}
    done = dict.fromkeys(range(len(requests)), 0)
    retries = [Retries(READING_TRIES) for _ in requests]
    for number, request in enumerate(requests):
        pool.send(number, "plan_pictures", within_s=PATIENCE_S, **request)
    while len(answers) < len(requests):
        for event in pool.wait():
            match event:
                case Reported(key=number, message=[_, planned, _]):
                    done[number] = planned
                    progress(sum(done.values()))
                case Answered(key=number, result=result):
                    answers[number] = result
                case Failed(key=number, reason=ChildDiedError() as died) if number not in answers:
                    if not retries[number].may_try_again(died):
                        raise ChildDiedError(retries[number].in_words(died), cause=died.cause)
                    pool.add(number, Child())
                    pool.send(number, "plan_pictures", within_s=PATIENCE_S, **requests[number])
                case Failed(key=number, reason=reason) if number not in answers:
                    raise reason
    return [answers[number] for number in range(len(requests))]


def _pictures(answers: Sequence[Any]) -> Iterator[PlannedPicture]:
    """Yield all pictures; equal keys are one string, for most are those of the variant before."""
    known: dict[str, str] = {}
    alike: dict[tuple[str, ...], tuple[str, ...]] = {}
    before: list[dict[str, list[Any]]] = [{} for _ in answers]
    for parts in zip(*answers, strict=True):  # of one variant
        for part, columns in zip(parts, before, strict=True):
            columns.update((name, part[name]) for name in COLUMNS if part[name] is not None)
            for index, frame, time_code, *keys, extent, groups, features, stated, label_keys in zip(
                *(columns[name] for name in COLUMNS), strict=True
            ):
                geometry, radiance, exposure, targets = (known.setdefault(key, key) for key in keys)
                yield PlannedPicture(
                    variant=part["variant"],
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
