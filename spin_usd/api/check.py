"""Check a stage or a dataset for what is wrong with it."""

from dataclasses import replace
from pathlib import Path

from spin_usd.api.checked import checked
from spin_usd.dataset.check import check as checking
from spin_usd.dataset.check.cross import cross_check, refuse_cross
from spin_usd.dataset.repair import repair as repairing
from spin_usd.errors import InputError
from spin_usd.progress import Note, Progress, ignore, unsaid


@checked
def check(
    path: str | Path,
    *,
    repair: bool = False,
    cross: bool = False,
    cross_pictures: int | None = None,
    on_progress: Progress | None = None,
    on_note: Note | None = None,
) -> checking.CheckReport:
    """Look for what is wrong with a stage or a dataset: conventions, schemas, digests, label consistency.

    Args:
        path: a stage's root layer, the folder of its dataset.usda, or a dataset's folder.
        repair: first make again what is missing or damaged in a dataset, from its own stage; the report then says what
            was `repaired`, and what is `unrepaired`.
        cross: also cast a dataset's labels again through Cycles, which has no part in making them, and find where they
            differ by more than two exact passes may; the report then says how many pictures were `compared`.
        cross_pictures: compare so many pictures, evenly spread; all if not given.
        on_progress: called with what is counted, how many are done and how many there are.
        on_note: called with what is to be said meanwhile.

    Raises InputError where `path` is neither a stage nor a dataset, or no dataset with `repair` or `cross`, and for
    `cross_pictures` without `cross`; UnsupportedError where `cross` lacks Blender.
    """
    if cross_pictures is not None and not cross:
        raise InputError("cross_pictures is given without cross", do="give cross too")
    if cross:
        refuse_cross(Path(path), cross_pictures)
    progress, note = ignore if on_progress is None else on_progress, on_note or unsaid
    if repair:
        report: checking.CheckReport = repairing.repair(Path(path), progress=progress, note=note)
    else:
        report = checking.check(Path(path), progress=progress)
    if not cross:
        return report
    crossed = cross_check(Path(path), cross_pictures, progress=progress)
    return replace(report, findings=[*report.findings, *crossed.findings], compared=crossed.compared)
