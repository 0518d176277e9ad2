"""Export a dataset: plan, refuse, then write a picture at a time, and a card.

The card is README.md, which describes the export and its conventions, and a contact sheet.
"""

import time
from array import array
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import to_builtins

from spin_usd.basics.arrays import Float
from spin_usd.basics.pluralise import pluralise
from spin_usd.basics.progress import Progress
from spin_usd.commands.export.options import ExportOptions
from spin_usd.commands.export.pictures import LIST, all_indexes, made_by_children, made_here
from spin_usd.commands.export.plan import ExportPlan, plan_export
from spin_usd.commands.export.report import ExportReport
from spin_usd.commands.export.writer import Counts, Writer
from spin_usd.errors import InputError, SpinError
from spin_usd.exchange.cameras.camera_format import CENTRE, CORNER
from spin_usd.exchange.layout.export_format import MadeFile
from spin_usd.exchange.layout.exported_dataset import Entry
from spin_usd.exchange.layout.images import RGB
from spin_usd.exchange.layout.index_file import write_text_file
from spin_usd.exchange.layout.rectified_picture import NO, YES, as_rectified
from spin_usd.files.folder import Folder
from spin_usd.geometry.camera import Camera
from spin_usd.reading.contact_sheet import draw_contact_sheet, spread
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
CARD, SHEET = "README.md", "contact_sheet.jpg"
SHOWN = 4  # pictures on the contact sheet: to read one of full size with its labels takes a tenth of a second
CAMERAS = 20  # at most that are listed
PIXELS = {
    CORNER: "Here (0, 0) is the corner of the image, so the first pixel's centre is (0.5, 0.5). Functions that put "
    "(0, 0) at the first pixel's centre need cx - 0.5 and cy - 0.5.",
    CENTRE: "Here (0, 0) is the first pixel's centre, as in the format's own files. Functions that put (0, 0) at the "
    "corner of the image need cx + 0.5 and cy + 0.5.",
}
"""By where the first pixel's centre is."""
BANDS, SECTORS = 6, 12  # of equal heights and azimuths: cells of equal area
ROWS = {
    "range": "range of the target, m",
    "turn": "rotation from body axes to camera axes, degrees",
    "sun": "Sun to camera as seen from the target, degrees",
    "visible": "visible fraction of the target",
}


def export(request: dict[str, Any], progress: Progress) -> ExportReport:
    """Export by the `request`, which is ExportOptions as JSON. Raises like export_dataset."""
    return export_dataset(ExportOptions(**request), progress=progress)


def export_dataset(request: ExportOptions, *, progress: Progress) -> ExportReport:
    """Export by the request. Another run adds what is missing.

    Raises InputError and UnsupportedError for content that cannot be exported: before anything is written if records
    show it, else at its file. Raises OutputError.
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
        made=sum(counts.made.values()),
        made_endings=counts.made,
        kept=counts.kept,
        seconds=time.monotonic() - began,
        notes=_notes(plan),
    )


def _notes(plan: ExportPlan) -> tuple[str, ...]:
    """Return a note on grey images, where the format's readers seldom take them."""
    if plan.exported.options.get(RGB.name) != NO or not plan.survey.grey:
        return ()
    told = f"{pluralise(plan.survey.grey, 'image')} in grey, and most trainers of splats need RGB"
    return (f"{told}: --option {RGB.name}={YES} gives three equal channels, in another folder",)


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
    """Raise InputError if the folder contains anything but the export `described`, begun or finished. Write nothing."""
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


def card_files(plan: ExportPlan) -> Iterator[MadeFile]:
    """Yield the card's files."""
    dataset = plan.exported.dataset
    pictures = [dataset.picture(entry.frame, entry.variant) for entry in _shown(plan)]
    yield MadeFile(path=SHEET, write=partial(draw_contact_sheet, pictures))
    yield MadeFile(path=CARD, write=write_text_file(card_text(plan)))


def _shown(plan: ExportPlan) -> list[Entry]:
    entries = plan.exported.entries
    return [entries[place] for place in spread(len(entries), SHOWN)]


def card_text(plan: ExportPlan) -> str:
    """Return the card in Markdown."""
    exported, described = plan.exported, plan.described
    left_out = f" {plan.left_out} more show nothing of it, and are left out." if plan.left_out else ""
    options = ", ".join(f"{name}={value}" for name, value in exported.options.items()) or "none"
    blocks = (
        f"# {exported.target}, {len(exported)} pictures as {plan.format.name}",
        f"Synthetic pictures of the spacecraft {exported.target}, {plan.format.holds}, made with spin_usd "
        f"{described['spin_usd']}.{left_out}",
        f"![Some of the pictures and their labels]({SHEET})",
        "## Pictures",
        _tally(plan),
        "All variants of a pose are in one split. The split is drawn from the seed "
        f"{described['seed']}, with the shares {_shares(plan)}.",
        "## Statistics",
        statistics_table(plan.survey.columns),
        views(plan.survey.columns),
        "## Conventions",
        "\n".join(f"- {sentence}" for sentence in plan.layout.conventions),
        "## Camera",
        _cameras(plan),
        PIXELS[plan.layout.first_centre],
        "## Origin",
        f"Options of the format: {options}. `export.json` has the digest of the records that this was made from.",
        "## Licence",
        "Not stated: the owner of the pictures writes it here.",
    )
    return plan.layout.card_head(exported) + "\n\n".join(blocks) + "\n"


def _shares(plan: ExportPlan) -> str:
    return ", ".join(f"{name} {share:g}" for name, share in plan.described["splits"].items())


def _tally(plan: ExportPlan) -> str:
    variants = list(dict.fromkeys(entry.variant for entry in plan.exported.entries))
    rows = [
        f"| {split} | {variant} | {plan.survey.tally[split, variant]} |"
        for split in plan.exported.splits
        for variant in variants
    ]
    return "\n".join(("| split | variant | pictures |", "| --- | --- | --- |", *rows))


def _cameras(plan: ExportPlan) -> str:
    """Return a table of the cameras, in the pixels of the format's own files."""
    cameras = {as_rectified(camera, plan.exported): first for camera, first in reversed(plan.survey.cameras.items())}
    shift = plan.layout.first_centre - CORNER
    shown = [
        (replace(camera, cx=camera.cx + shift, cy=camera.cy + shift), first)
        for camera, first in [*reversed(cameras.items())][:CAMERAS]
    ]
    rows = [f"| {_camera(camera)} | {first} |" for camera, first in shown]
    more = [f"\nand {len(cameras) - CAMERAS} more."] if len(cameras) > CAMERAS else []
    head = ("| width | height | fx | fy | cx | cy | k1, k2, p1, p2, k3 | first in |", "| --- " * 8 + "|")
    return "\n".join((*head, *rows, *more))


def _camera(camera: Camera) -> str:
    numbers = (camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy)
    lens = ", ".join(map(str, camera.distortion)) if camera.distorted else "none"
    return " | ".join((*map(str, numbers), f"fisheye, k1 to k4: {lens}" if camera.fisheye else lens))


def statistics_table(columns: "Mapping[str, array[float]]") -> str:
    """Return a table in Markdown of least, median, mean and greatest of each column that has numbers."""
    lines = ["| | least | median | mean | greatest |", "| --- | --- | --- | --- | --- |", *_rows(columns)]
    return "\n".join(lines)


def _rows(columns: "Mapping[str, array[float]]") -> Iterator[str]:
    for name, words in ROWS.items():
        numbers = known(columns[name])
        if len(numbers):
            shown = (numbers.min(), np.median(numbers), numbers.mean(), numbers.max())
            yield f"| {words} | {' | '.join(f'{number:.4g}' for number in shown)} |"


def views(columns: "Mapping[str, array[float]]") -> str:
    """Return the number of directions from which the target is seen, out of cells of equal area around it."""
    azimuth, height = np.array(columns["azimuth"]), np.array(columns["height"])
    band = np.clip((height + 1) / 2 * BANDS, 0, BANDS - 1).astype(int)
    sector = np.clip((azimuth + 180) / 360 * SECTORS, 0, SECTORS - 1).astype(int)
    seen = len(np.unique(band * SECTORS + sector))
    return f"The camera sees the target from {seen} of {BANDS * SECTORS} cells of equal area around it."


def known(column: "array[float]") -> Float:
    """Return the numbers of a column that are not NaN."""
    numbers = np.array(column)
    found: Float = numbers[~np.isnan(numbers)]
    return found
