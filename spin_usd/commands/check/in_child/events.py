"""The child's part of `check` of a dataset: faults of the events of one variant, read in pieces."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.faults import reading
from spin_usd.commands.check.calls import CheckEvents
from spin_usd.commands.check.digests import EVENTS_AGAIN, digest_findings
from spin_usd.errors import InputError, MissingPackageError, SpinError
from spin_usd.files.folder import FileIn, Folder
from spin_usd.reading.events import PACKET, SECOND, EventStream
from spin_usd.records.descriptions import DatasetDescription
from spin_usd.records.event_record import EventRecord
from spin_usd.scene.finding import ERROR, WARNING, Finding
from spin_usd.store.names import event_record_of, events_of
from spin_usd.store.read_documents import read_dataset_json, read_event_record

DEVIATIONS = 10  # of jitter, by which an event may be late
MOST_RATE = 1e9  # events a second of all pixels: beyond any camera's interface
HOT_RATE, HOT_EVENTS = 1000, 100  # events a second of a pixel, and events, that a hot one has more of
HOT_SHARE, HOT_QUANTILE = 50, 0.999  # times as many as so large a share of all pixels has
HOT_ALONE, HOT_AROUND, HOT_PIXELS = 10, 2, 4  # times the fewest of the busiest 4, itself among them, of 5 x 5 pixels
IDS = 2**16


def event_findings(request: CheckEvents, progress: Callable[..., None]) -> list[Finding]:
    """Return what is wrong with the events of a variant that has a record of them."""
    folder, variant = Folder(Path(request.dataset)), request.variant
    where, name = event_record_of(variant), events_of(variant)
    try:
        with reading(where):
            record = read_event_record(folder, variant)
    except SpinError as e:
        return [Finding(code="record", where=where, message=f"{e.found}; {EVENTS_AGAIN}")]
    if wrong := list(digest_findings(folder.root, name, record.sha256, do=EVENTS_AGAIN)):
        return wrong
    description = None
    with suppress(InputError):  # which has a finding of its own
        description = read_dataset_json(folder)
    try:
        with reading(name):
            return list(_findings(EventStream(FileIn(folder, name)), record, description, progress))
    except SpinError as e:
        lacking = isinstance(e, MissingPackageError)
        message = f"{e.found}; {e.do if lacking else EVENTS_AGAIN}"
        return [Finding(code="unreadable", where=name, message=message, severity=WARNING if lacking else ERROR)]


def _findings(
    stream: EventStream, record: EventRecord, description: DatasetDescription | None, progress: Callable[..., None]
) -> Iterator[Finding]:
    if description and description.stage.hashes.get(record.variant) != record.stage:
        message = "were made from another state of the stage; run spin-usd render again with --events"
        yield Finding(code="outdated", where=record.file, message=message, severity=WARNING)
    camera = record.camera
    here = (stream.variant, stream.width, stream.height, len(stream), stream.start_us)
    there = (record.variant, camera.width, camera.height, record.events, round(record.start * SECOND))
    if here != there:
        found = f"variant, size, number and start of its events are {here}, but {there} by its record"
        yield Finding(code="events", where=record.file, message=f"{found}; {EVENTS_AGAIN}")
        return
    targets = _targets_of_parts(description) if description and record.labelled else None
    latest = _latest(record)
    counts = np.zeros(stream.height * stream.width, np.int64)
    early = late = unknown = 0
    before = stream.start_us
    for done, events in enumerate(stream.packets()):
        progress("checking: event", done * PACKET, len(stream))
        early += int(np.count_nonzero(np.diff(events["t"], prepend=before) < 0))
        late += int(np.count_nonzero(events["t"] > latest))
        before = events["t"][-1]
        counts += np.bincount(events["y"].astype(np.int64) * stream.width + events["x"], minlength=len(counts))
        if targets is not None:
            unknown += int(np.count_nonzero(targets[events["part"]] != events["target"]))
    of = f"of its {len(stream)} events"
    for count, found in (
        (early, f"{of} are before the one before them"),
        (late, f"{of} are later than the sensor's latency explains"),
        (unknown, f"{of} have a part that is not in dataset.json, or of another target there"),
    ):
        if count:
            yield Finding(code="events", where=record.file, message=f"{count} {found}; {EVENTS_AGAIN}")
    yield from rate_findings(record.file, counts.reshape(stream.height, stream.width), record.duration)


def rate_findings(where: str, counts: NDArray[np.int64], duration: float) -> Iterator[Finding]:
    """Yield a warning for no events, or more than a camera can send, and one on hot pixels, from the number of events
    of each pixel (H, W) in `duration` seconds."""
    total = int(counts.sum())
    if not total or total > MOST_RATE * duration:
        found = f"has {total} events in {duration:g} s; change thresholds, noise or light, if that is not intended"
        yield Finding(code="event-rate", where=where, message=found, severity=WARNING)
    if hot := hot_pixels(counts, duration):
        x, y = hot[0]
        found = f"{len(hot)} pixels are hot, such as {x}, {y} with {counts[y, x]} events in {duration:g} s"
        do = "look whether thresholds are near 0, or a light flickers"
        yield Finding(code="hot-pixels", where=where, message=f"{found}; {do}", severity=WARNING)


def hot_pixels(counts: NDArray[np.int64], duration: float) -> list[tuple[int, int]]:
    """Return column and row of hot pixels.

    One has more than HOT_RATE events a second and HOT_EVENTS at all; more than HOT_SHARE times the HOT_QUANTILE of all
    pixels, so that leak and noise, which all pixels have, do not explain it; and it is alone: a small bright target has
    many events too, but so have the pixels around.
    """
    usual = HOT_SHARE * np.quantile(counts, HOT_QUANTILE)
    rows, columns = np.nonzero(counts > max(HOT_RATE * duration, HOT_EVENTS, usual))
    around = np.pad(counts, HOT_AROUND)
    side = 2 * HOT_AROUND + 1
    return [
        (x, y)
        for y, x in zip(rows.tolist(), columns.tolist(), strict=True)
        if counts[y, x] > HOT_ALONE * np.sort(around[y : y + side, x : x + side], axis=None)[-HOT_PIXELS]
    ]


def _targets_of_parts(description: DatasetDescription) -> NDArray[np.int32]:
    """Return the target's id by a part's id; -1 for ids that are not parts."""
    targets = np.full(IDS, -1, np.int32)
    targets[0] = 0
    for number, part in description.parts.items():
        targets[int(number)] = part.target
    return targets


def _latest(record: EventRecord) -> float:
    """Return by when events are, microseconds."""
    lag = record.sensor.get("latency", 0.0) + DEVIATIONS * record.sensor.get("jitter", 0.0)
    return round((record.start + record.duration + lag) * SECOND) + 1
