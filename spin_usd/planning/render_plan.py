"""The plan of a request to `render` or `plan`, with its files and their approximate time."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from spin_usd.basics.pluralise import duration, pluralise
from spin_usd.basics.progress import Progress
from spin_usd.errors import InputError
from spin_usd.labels.table import LABELS, LABELS_OF_SEVERAL, NEEDS, PIXEL_LABELS
from spin_usd.picture.kinds import FILE_KINDS
from spin_usd.planning.machine_speed import keep_trial, kept_trial
from spin_usd.planning.make_plan import Plan, make_plan
from spin_usd.planning.request import PlanRequest, RenderRequest
from spin_usd.planning.shard import Shard
from spin_usd.planning.variant_table import variant_table
from spin_usd.planning.work import CommonWork
from spin_usd.processes.processors import usable_cpus
from spin_usd.store.pictures_left import WantedFiles

LACKING = {
    "lidar": ("LiDAR", "author it with --lidar, for example --lidar flash, or leave that label out"),
    "paired": ("second camera", "author it with --camera twice, or leave that label out"),
}
"""Names and remedies of things that a stage lacks, by the need of a label."""


def plan(
    request: RenderRequest,
    *,
    progress: Progress,
    explain: bool = False,
    shard: Shard | None = None,
    copy_to: Path | None = None,
    had: Sequence[str] = (),
    timed: bool = False,
) -> Plan:
    """Plan the pictures of a run, or of its `shard` alone. With `explain` the plan also lists the work that is skipped,
    and why. `had`: the kinds of file in the dataset, which pictures keep when they are made again. `timed`: whether the
    plan needs an estimate of time, and so the speed of this machine.

    Writes nothing but that speed, unless `copy_to` is given: then the stage is first copied into that folder, and the
    copy is
    planned.
    """
    kept = kept_trial() if timed else None
    question = PlanRequest(
        request=request,
        devices=request.devices(),
        labels=tuple(kind for kind in LABELS if kind in (*request.labels, *request.labels_where_possible, *had)),
        copy_to=copy_to,
        explain=explain,
        shard=shard,
        trial=timed and kept is None,
    )
    planned = make_plan(question, processes=len(usable_cpus()), progress=progress)
    if planned.trial_s is None:
        return replace(planned, trial_s=kept)
    keep_trial(planned.trial_s)
    return planned


def wanted_kinds(request: RenderRequest, plan: Plan) -> tuple[str, ...]:
    """Return the kinds of file to make of each picture: the requested ones, with several bodies a label that tells them
    apart, and the possible ones of labels_where_possible. Raises InputError for a requested label that the stage cannot
    have, or that cannot hold so many targets."""
    full = _full_labels(len(plan.content.targets))
    missing = {name for name, needed in NEEDS.items() if not getattr(plan.content, needed)}
    for kind in request.kinds:
        if kind in full:
            do = "leave that label out: instance holds any number of targets"
            raise InputError(full[kind], where=request.stage, do=do)
        if kind in missing:
            what, do = LACKING[NEEDS[kind]]
            raise InputError(f"has no {what}, which the label {kind} needs", where=request.stage, do=do)
    of_pixels = any(kind in PIXEL_LABELS for kind in request.kinds)
    more = LABELS_OF_SEVERAL if of_pixels and plan.content.bodies > 1 else ()
    possible = set(request.labels_where_possible) - missing - full.keys()
    return tuple(kind for kind in FILE_KINDS if kind in (*request.kinds, *more, *possible))


def _full_labels(count: int) -> dict[str, str]:
    """Return why labels cannot hold so many targets, by the labels' names."""
    return {
        name: f"has {count} targets, and the label {name} holds {label.max_targets} at most"
        for name, label in PIXEL_LABELS.items()
        if label.max_targets is not None and count > label.max_targets
    }


def common_work(request: RenderRequest, plan: Plan) -> CommonWork:
    """Return how all pictures of the run are made."""
    width, height = plan.content.camera
    return CommonWork(
        renderer=request.renderer,
        effort=request.effort,
        kinds=wanted_kinds(request, plan),
        frame_pixels=width * height,
        device=plan.settings.device,
    )


def foretold(request: RenderRequest, plan: Plan, wanted: WantedFiles, out: Path, workers: int, cores: int) -> str:
    """Return the approximate time, as text, of a run into the dataset `out` with so many workers on these cores."""
    table = variant_table(plan, common_work(request, plan), wanted, out)
    pictures, by = pluralise(len(plan.pictures), "picture"), pluralise(workers, "worker")
    return f"{pictures} with {by}: about {duration(table.seconds(workers, cores))}"
