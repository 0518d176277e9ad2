"""`check --cross`: labels of a dataset's pictures against those that Cycles casts again, in children."""

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from spin_usd.dataset.process.child import Child
from spin_usd.dataset.process.child_limits import START_PATIENCE_S, rendering_memory
from spin_usd.dataset.process.open_renderer import CHECKING, require_renderer
from spin_usd.dataset.process.processors import usable_cpus
from spin_usd.dataset.process.shared_calls import Call, results_of
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.errors import InputError, SpinError
from spin_usd.progress import Progress
from spin_usd.scene.finding import Finding

PICTURES_PER_CHILD = 16  # opening Blender takes as long as casting so many


def cross_findings(path: Path, count: int | None, *, progress: Progress) -> Iterator[Finding]:
    """Find where labels differ from those of Cycles, in `count` pictures of the dataset `path`, evenly spread, or in
    all. Raises InputError where it is no dataset, or `count` is none; UnsupportedError without Blender."""
    store = Store(root=path.absolute())
    if not store.is_dataset():
        raise InputError("is not a dataset, and --cross is for those", where=path, do="give a dataset's folder")
    if count is not None and count < 1:
        raise InputError(f"--cross-pictures is {count}", do="give 1 or more, or leave it out for all")
    require_renderer(CHECKING, instead="leave --cross out")
    return _crossed(store, _spread(list(store.records()), count), progress)


def _crossed(store: Store, records: Sequence[str], progress: Progress) -> Iterator[Finding]:
    calls = [Call("cross_picture", {"dataset": str(store.root), "record": record}) for record in records]
    children = max(1, min(len(usable_cpus()), len(calls) // PICTURES_PER_CHILD))
    start = partial(Child, memory=rendering_memory())
    results = results_of(calls, children, progress=progress, start=start, within_s=START_PATIENCE_S)
    for done, (record, result) in enumerate(zip(records, results, strict=True)):
        progress("comparing with Cycles: picture", done, len(records))
        if isinstance(result, SpinError):
            yield Finding(code="cross", where=record, message=f"cannot be cast again: {result.found}")
        else:
            yield from (Finding(**each) for each in result)
    progress("comparing with Cycles: picture", len(records), len(records))


def _spread(records: Sequence[str], count: int | None) -> list[str]:
    """Return `count` of the records, evenly spread, or all."""
    if count is None or count >= len(records):
        return list(records)
    return [records[place * len(records) // count] for place in range(count)]
