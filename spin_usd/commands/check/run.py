"""Findings on a stage or a dataset."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from msgspec import structs

from spin_usd.basics.progress import Progress
from spin_usd.commands.check.calls import CROSS_PICTURE, CheckPicture
from spin_usd.commands.check.dataset import dataset_findings
from spin_usd.commands.check.foreign_run import check_foreign, refuse_foreign_options
from spin_usd.commands.check.options import CheckOptions
from spin_usd.commands.check.repair import repair
from spin_usd.commands.check.report import CheckReport
from spin_usd.commands.check.stage import stage_answer, stage_task
from spin_usd.errors import InputError, SpinError
from spin_usd.options import takes
from spin_usd.processes.child import Child
from spin_usd.processes.child_limits import START_PATIENCE_S, rendering_memory
from spin_usd.processes.deaths import READING_TRIES
from spin_usd.processes.executor import done_in_order
from spin_usd.processes.open_renderer import CHECKING, require_renderer
from spin_usd.processes.processors import usable_cpus
from spin_usd.processes.task import Task
from spin_usd.scene.finding import Finding
from spin_usd.store.dataset_folder import Store
from spin_usd.store.stage_path import root_layer

COMPARING = "comparing with Cycles: picture"
PICTURES_PER_CHILD = 16  # opening Blender takes as long as casting so many


@takes(CheckOptions)
def check(options: CheckOptions) -> CheckReport:
    """Check a stage or a dataset for faults: conventions, schemas, digests, label consistency.

    Raises InputError if `path` is neither a stage nor a dataset, or not a dataset with `repair` or `cross`, and for
    `cross_pictures` without `cross`, and for options of third-party data sets with anything else; UnsupportedError if
    `cross` lacks Blender.
    """
    path, progress = Path(options.path), options.progress
    if options.cross_pictures is not None and not options.cross:
        raise InputError("cross_pictures is given without cross", do="give cross too")
    if options.cross:
        refuse_cross(path, options.cross_pictures)
    if is_foreign(path):
        return check_foreign(path, options)
    refuse_foreign_options(options)
    if options.repair:
        report: CheckReport = repair(path, progress=progress, note=options.note)
    else:
        report = check_folder(path, progress=progress)
    if not options.cross:
        return report
    crossed = cross_check(path, options.cross_pictures, progress=progress)
    return structs.replace(report, findings=[*report.findings, *crossed.findings], compared=crossed.compared)


def check_folder(path: Path, *, progress: Progress) -> CheckReport:
    """Check the stage or dataset at `path`. Raises InputError when it is neither."""
    if Store(root=path).is_dataset():
        return CheckReport(kind="dataset", findings=list(dataset_findings(path.absolute(), progress=progress)))
    root = root_layer(path)
    if os.path.isfile(root) and root.suffix.lower().startswith(".usd"):
        return check_stage(root, progress=progress)
    if not os.path.exists(path):
        raise InputError("does not exist", where=path, do="check the path")
    do = "give a stage's root layer, the folder of its dataset.usda, or a dataset's folder"
    raise InputError("is neither a stage nor a dataset", where=path, do=do)


def is_foreign(path: Path) -> bool:
    """Return whether `path` is a folder of neither a stage nor a dataset."""
    return path.is_dir() and not Store(root=path).is_dataset() and not os.path.isfile(root_layer(path))


def check_stage(root: Path, *, progress: Progress) -> CheckReport:
    """Check the stage whose root layer is `root`."""
    (task,) = done_in_order([stage_task(root, progress)], 1)
    answer = stage_answer(task, root)
    return CheckReport(kind="stage", findings=answer.findings, views=answer.views)


@dataclass(frozen=True, kw_only=True)
class CrossReport:
    """The result of a comparison."""

    compared: int
    """How many pictures were compared."""
    findings: Sequence[Finding]
    """Where their labels differ, and which pictures could not be compared."""


def refuse_cross(path: Path, count: int | None) -> None:
    """Raise InputError where `path` is not a dataset, or `count`, of pictures, is below 1; UnsupportedError without
    Blender."""
    if not Store(root=path.absolute()).is_dataset():
        raise InputError("is not a dataset, which --cross needs", where=path, do="give a dataset's folder")
    if count is not None and count < 1:
        raise InputError(f"--cross-pictures is {count}", do="give 1 or more, or leave it out for all")
    require_renderer(CHECKING, instead="leave --cross out")


def cross_check(path: Path, count: int | None, *, progress: Progress) -> CrossReport:
    """Compare the labels of `count` pictures of the dataset `path`, evenly spread, or of all, with Cycles' labels."""
    store, compared = Store(root=path.absolute()), 0
    records = _spread(list(store.records()), count)
    requests = [CheckPicture(dataset=str(store.root), record=record) for record in records]
    tasks = [
        Task(call=CROSS_PICTURE, request=request, within_s=START_PATIENCE_S, tries=READING_TRIES)
        for request in requests
    ]
    children = max(1, min(len(usable_cpus()), len(tasks) // PICTURES_PER_CHILD))
    findings: list[Finding] = []
    progress(COMPARING, 0, len(records))
    ended = done_in_order(tasks, children, start=lambda _: Child(memory=rendering_memory()))
    for done, (record, task) in enumerate(zip(records, ended, strict=True), 1):
        if isinstance(task.failure, SpinError):
            message = f"cannot be cast again: {task.failure.found}"
            findings.append(Finding(code="cross", where=record, message=message))
        else:
            compared += task.result.compared
            findings += task.result.findings
        progress(COMPARING, done, len(records))
    return CrossReport(compared=compared, findings=findings)


def _spread(records: Sequence[str], count: int | None) -> list[str]:
    """Return `count` of the records, evenly spread, or all."""
    if count is None or count >= len(records):
        return list(records)
    return [records[place * len(records) // count] for place in range(count)]
