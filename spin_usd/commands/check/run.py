"""Findings on a stage or a dataset."""

import os
from dataclasses import replace
from pathlib import Path

from spin_usd.commands.check.cross import cross_check, refuse_cross
from spin_usd.commands.check.dataset import dataset_findings
from spin_usd.commands.check.options import CheckOptions
from spin_usd.commands.check.repair import repair
from spin_usd.commands.check.report import CheckReport
from spin_usd.commands.check.stage import StageAnswer, stage_call
from spin_usd.errors import InputError
from spin_usd.options import takes
from spin_usd.processes.shared_calls import results_of
from spin_usd.progress import Progress
from spin_usd.store.dataset_folder import Store
from spin_usd.store.stage_path import root_layer


@takes(CheckOptions)
def check(options: CheckOptions) -> CheckReport:
    """Look for what is wrong with a stage or a dataset: conventions, schemas, digests, label consistency.

    Raises InputError where `path` is neither a stage nor a dataset, or no dataset with `repair` or `cross`, and for
    `cross_pictures` without `cross`; UnsupportedError where `cross` lacks Blender.
    """
    path, progress = Path(options.path), options.progress
    if options.cross_pictures is not None and not options.cross:
        raise InputError("cross_pictures is given without cross", do="give cross too")
    if options.cross:
        refuse_cross(path, options.cross_pictures)
    if options.repair:
        report: CheckReport = repair(path, progress=progress, note=options.note)
    else:
        report = check_folder(path, progress=progress)
    if not options.cross:
        return report
    crossed = cross_check(path, options.cross_pictures, progress=progress)
    return replace(report, findings=[*report.findings, *crossed.findings], compared=crossed.compared)


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


def check_stage(root: Path, *, progress: Progress) -> CheckReport:
    """Check the stage whose root layer is `root`."""
    (result,) = results_of([stage_call(root)], 1, progress=progress)
    answer = StageAnswer.of(result, root)
    return CheckReport(kind="stage", findings=list(answer.findings), views=answer.views)
