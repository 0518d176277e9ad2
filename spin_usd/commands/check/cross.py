"""`check --cross`: labels of a dataset's pictures against those that Cycles casts again, in children."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from spin_usd.errors import InputError, SpinError
from spin_usd.processes.child import Child
from spin_usd.processes.child_limits import START_PATIENCE_S, rendering_memory
from spin_usd.processes.open_renderer import CHECKING, require_renderer
from spin_usd.processes.processors import usable_cpus
from spin_usd.processes.shared_calls import Call, results_of
from spin_usd.progress import Progress
from spin_usd.scene.finding import Finding
from spin_usd.store.dataset_folder import Store

COMPARING = "comparing with Cycles: picture"
PICTURES_PER_CHILD = 16  # opening Blender takes as long as casting so many


@dataclass(frozen=True, kw_only=True)
class CrossReport:
    """The result of a comparison. compared: how many pictures were compared · findings: where their labels differ, and
    which pictures could not be compared."""

    compared: int
    findings: Sequence[Finding]


def refuse_cross(path: Path, count: int | None) -> None:
    """Raise InputError where `path` is not a dataset, or `count`, of pictures, is below 1; UnsupportedError without
    Blender."""
    if not Store(root=path.absolute()).is_dataset():
        raise InputError("is not a dataset, and --cross is for those", where=path, do="give a dataset's folder")
    if count is not None and count < 1:
        raise InputError(f"--cross-pictures is {count}", do="give 1 or more, or leave it out for all")
    require_renderer(CHECKING, instead="leave --cross out")


def cross_check(path: Path, count: int | None, *, progress: Progress) -> CrossReport:
    """Compare the labels of `count` pictures of the dataset `path`, evenly spread, or of all, with those of Cycles."""
    store, compared = Store(root=path.absolute()), 0
    records = _spread(list(store.records()), count)
    calls = [Call("cross_picture", {"dataset": str(store.root), "record": record}) for record in records]
    children = max(1, min(len(usable_cpus()), len(calls) // PICTURES_PER_CHILD))
    start = partial(Child, memory=rendering_memory())
    results = results_of(calls, children, progress=progress, start=start, within_s=START_PATIENCE_S)
    findings: list[Finding] = []
    progress(COMPARING, 0, len(records))
    for done, (record, result) in enumerate(zip(records, results, strict=True), 1):
        if isinstance(result, SpinError):
            findings.append(Finding(code="cross", where=record, message=f"cannot be cast again: {result.found}"))
        else:
            compared += result["compared"]
            findings += (Finding(**each) for each in result["findings"])
        progress(COMPARING, done, len(records))
    return CrossReport(compared=compared, findings=findings)


def _spread(records: Sequence[str], count: int | None) -> list[str]:
    """Return `count` of the records, evenly spread, or all."""
    if count is None or count >= len(records):
        return list(records)
    return [records[place * len(records) // count] for place in range(count)]
