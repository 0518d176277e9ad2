"""Export a dataset: plan, refuse, then write a picture at a time."""

import time
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from msgspec import to_builtins

from spin_usd.commands.export.card import card_files
from spin_usd.commands.export.options import ExportOptions
from spin_usd.commands.export.pictures import LIST, all_indexes, made_by_children, made_here
from spin_usd.commands.export.plan import ExportPlan, plan_export
from spin_usd.commands.export.report import ExportReport
from spin_usd.commands.export.writer import Counts, Writer
from spin_usd.errors import InputError, SpinError
from spin_usd.files.folder import Folder
from spin_usd.progress import Progress
from spin_usd.records.descriptions import ExportDescription
from spin_usd.store.atomic import write_json
from spin_usd.store.dataset_folder import Lease, Store, refuse_dataset
from spin_usd.store.json_schema import read_json

SELF = "export.json"
SCHEMA = "export-1"
WORDS = {
    "format": "of another format",
    "options": "with other options",
    "dataset": "of other pictures",
    "target": "of another target",
    "splits": "with other splits",
    "seed": "with another seed",
    "pictures": "of other pictures",
    "spin_usd": "by another version of spin_usd",
}


def export(request: Mapping[str, Any], *, progress: Progress) -> ExportReport:
    """Export as the `request` says, which is ExportOptions as JSON. Raises as export_dataset."""
    return export_dataset(ExportOptions(**request), progress=progress)


def export_dataset(request: ExportOptions, *, progress: Progress) -> ExportReport:
    """Export as the request says. Run again, it makes what is missing.

    Raises InputError and UnsupportedError for what cannot be exported: before anything is written where records tell,
    else when its file is met. Raises OutputError.
    """
    began = time.monotonic()
    refuse_dataset(Path(request.out), Path(request.dataset))
    with blaming_records(Path(request.dataset)):
        plan, counts = _planned_and_written(request, progress)
    held = Counter(entry.split for entry in plan.exported.entries)
    return ExportReport(
        out=str(request.out),
        format=plan.format.name,
        pictures=len(plan.exported),
        splits={split: held[split] for split in plan.exported.splits},
        left_out=plan.left_out,
        linked=counts.linked,
        made=counts.made,
        kept=counts.kept,
        seconds=time.monotonic() - began,
    )


def _planned_and_written(request: ExportOptions, progress: Progress) -> tuple[ExportPlan, Counts]:
    """Plan the export and write it; return how many files there are of each kind."""
    plan = plan_export(request, progress=progress)
    refuse_other(Path(request.out), plan.described)
    with Store(root=Path(request.out)).locked() as lease:
        describe(Path(request.out), plan.described, complete=False, work=lease.work)
        counts = _write(plan, request, lease, progress)
        describe(Path(request.out), plan.described, complete=True, work=lease.work)
    return plan, counts


def _write(plan: ExportPlan, request: ExportOptions, lease: Lease, progress: Progress) -> Counts:
    """Write all files, and return how many there are of each kind."""
    exported, layout = plan.exported, plan.layout
    writer = Writer(out=Path(request.out), work=lease.work, copy=request.copy, indexes=all_indexes(exported, layout))
    listed = 0
    try:
        for output in layout.shared(exported):
            writer.write(output)
        if request.workers == 1:
            made = made_here(exported, layout, request, lease.work)
        else:
            made = made_by_children(exported, request, lease.work, (lease.descriptor,))
        progress("exporting: picture", 0, len(exported))
        for rows, counts in made:
            for row in rows:
                writer.add(row)
                listed += row.path == LIST
            writer.counts.add(counts)
            progress("exporting: picture", listed, len(exported))
        writer.finish()
        for last in (*layout.last(exported, Path(request.out)), *card_files(plan)):
            writer.write(last)
    finally:
        writer.close()
    return writer.counts


@contextmanager
def blaming_records(dataset: Path) -> Iterator[None]:
    """Raise InputError that names the first record that breaks its schema, where the block fails over anything.

    To hold every record to its schema takes longer than to export it, so it is done when something has gone wrong.
    """
    try:
        yield
    except SpinError:
        raise
    except Exception:
        store = Store(root=dataset)
        for name in store.records():
            read_json(store.folder, name, "record-1")
        raise


def refuse_other(out: Path, described: Mapping[str, Any]) -> None:
    """Raise InputError where the folder holds anything but what is `described`, begun or finished. Write nothing."""
    held = Store(root=out).contents()
    if not held:
        return
    if SELF not in held:
        raise InputError(f"holds {held[0]} but no {SELF}", where=out, do="choose an empty folder")
    found = read_json(Folder(out), SELF, SCHEMA)
    for name, words in WORDS.items():
        if found[name] != described[name]:
            raise InputError(f"is an export {words}", where=out, do="choose another folder, or remove that one")


def describe(out: Path, described: Mapping[str, Any], *, complete: bool, work: Path) -> None:
    """Write export.json."""
    write_json(Folder(out), SELF, to_builtins(ExportDescription(**described, complete=complete)), work=work)
