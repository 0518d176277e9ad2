"""Events in the file formats of event cameras: one file for each variant.

faery writes them, except Prophesee's RAW: in faery's EVT 3.0 (0.7.1) times after a pause that crosses a multiple of
16.8 s cannot be read back. Source: Prophesee's specification of EVT 3.0, and how its OpenEB reads that.
"""

import re
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.faults import reading
from spin_usd.errors import InputError, UnsupportedError
from spin_usd.exchange.layout.export_format import ExportFormat, Layout, MadeFile
from spin_usd.exchange.layout.exported_dataset import ExportedDataset
from spin_usd.exchange.layout.limits import needs_extra
from spin_usd.reading.events import EventStream
from spin_usd.scene.event import Events

Size = tuple[int, int]
CONVENTIONS = (
    "A file has all events of its variant, whichever pictures are exported. Times are microseconds since the stream's "
    "start; x is a column and y a row from the upper left pixel, which is (0, 0); on is brighter.",
    "Labels of events, and poses, are in the dataset alone.",
)
DOUBLED = ("expelliarmus reads the times of EVT 3.0 doubled, by a fault of its own: halve them there.",)
EVT3_SIDE = 2**11  # pixels that 11 bits can number
ADDRESS_Y, ADDRESS_X, TIME_LOW, TIME_HIGH = 0x0000, 0x2000, 0x6000, 0x8000
"""Words of EVT 3.0: the upper four bits give the meaning of the other twelve."""
BRIGHTER = 1 << 11

RECORDING = re.compile(r"#!AER-DAT|Event Stream|(?:%[^\n]*\n)*?%[^\n]*\b(?:evt \d|events?\b|height \d)", re.IGNORECASE)
"""Beginning of a recording in AEDAT, ES, or Prophesee's RAW or DAT."""
RECORDINGS = ("events", "CD")
"""Groups of recordings in HDF5, as DSEC and Metavision have them."""


def recording(path: Path) -> InputError:
    """Return the error for a recording of events in the place of a pose list."""
    do = "give the poses of its camera in a list of their own; docs/how-to/poses.md lists the formats"
    return InputError("is a recording of events, which has no poses that are read", where=path, do=do)


def write_evt3(packets: Iterable[Events], path: Path, size: Size) -> None:
    """Write the packets, whose times start at 0, of a sensor of that size (width, height), as EVT 3.0. Raises
    UnsupportedError for a sensor that it does not hold."""
    if max(size) > EVT3_SIDE:
        found = f"has events of {size[0]} x {size[1]} pixels, and EVT 3.0 has {EVT3_SIDE} a side at most"
        raise UnsupportedError(found, where=path.name, do="export it to aedat4")
    width, height = size
    head = f"% evt 3.0\n% format EVT3;height={height};width={width}\n% geometry {width}x{height}\n% end\n"
    with path.open("wb") as file:
        file.write(head.encode())
        time, row = -1, -1
        for packet in packets:
            if len(packet):
                file.write(_evt3_words(packet, time, row).tobytes())
                time, row = int(packet["t"][-1]), int(packet["y"][-1])


def _evt3_words(events: Events, time: int, row: int) -> NDArray[np.uint16]:
    """Return the words (N,) of events that come after one of that time and row, both -1 for none.

    Every 4096 us there is a word of the time's upper bits, of which there are twelve: readers count how often they
    begin anew, and take a great step back for an error.
    """
    high = events["t"] >> 12
    steps = np.diff(high, prepend=time >> 12)
    has_low = np.diff(events["t"], prepend=time) > 0
    has_row = np.diff(events["y"].astype(np.int64), prepend=row) != 0
    last = np.cumsum(steps + has_low + has_row + 1) - 1
    words = TIME_HIGH | np.zeros(last[-1] + 1, np.uint16)
    is_high = np.ones(len(words), bool)
    for places, values in (
        (last, ADDRESS_X | (BRIGHTER * events["p"]) | events["x"]),
        ((last - 1)[has_row], (ADDRESS_Y | events["y"])[has_row]),
        ((last - 1 - has_row)[has_low], (TIME_LOW | (events["t"] & 0xFFF))[has_low]),
    ):
        words[places], is_high[places] = values, False
    words[is_high] |= (np.arange((time >> 12) + 1, high[-1] + 1) & 0xFFF).astype(np.uint16)
    return words.astype("<u2")


def _write_by_faery(packets: Iterable[Events], path: Path, size: Size, *, kind: str) -> None:
    """Write the packets likewise, as a file of the `kind` that faery calls so."""
    with reading():
        from faery import EVENTS_DTYPE
        from faery.file_encoder import events_to_file

    taken = (each[["t", "x", "y", "p"]].astype(EVENTS_DTYPE) for each in packets)
    events_to_file(taken, path, size, zero_t0=False, use_write_suffix=False, file_type=kind)


def _write(stream: EventStream, write: Callable[[Iterable[Events], Path, Size], None], path: Path) -> None:
    """Write the stream into the file at `path`, a packet at a time."""
    write(_from_start(stream), path, (stream.width, stream.height))


def _from_start(stream: EventStream) -> Iterator[Events]:
    for packet in stream.packets():
        packet["t"] -= stream.start_us
        yield packet


def streams_of(dataset: ExportedDataset) -> dict[str, EventStream]:
    """Return the events of each variant. Raises InputError where one has none."""
    return {variant: dataset.dataset.events(variant) for variant in dataset.variants}


def _layout(ending: str, write: Callable[[Iterable[Events], Path, Size], None]) -> Layout:
    """Return the layout of files with that `ending`, each filled by `write`."""

    def files(dataset: ExportedDataset) -> Iterator[MadeFile]:
        for name, stream in streams_of(dataset).items():
            yield MadeFile(path=f"{name}{ending}", write=partial(_write, stream, write))

    return Layout(
        needs=(),
        conventions=CONVENTIONS + (DOUBLED if write is write_evt3 else ()),
        shared=files,
        limits=(needs_extra("events", but="faery" if write is write_evt3 else ""),),
        refuse=streams_of,
        files=lambda dataset, picture: iter(()),
        file=lambda dataset, picture: f"{picture.variant}{ending}",
        splits={"train": "train"},
        several=True,
    )


EVENT_FORMATS = tuple(
    ExportFormat(name=name, holds=f"as events in {words}", layout=_layout(ending, write))
    for name, words, ending, write in (
        ("evt3", "Prophesee's RAW, EVT 3.0", ".raw", write_evt3),
        ("aedat4", "iniVation's AEDAT4", ".aedat4", partial(_write_by_faery, kind="aedat")),
        ("dat", "Prophesee's DAT", ".dat", partial(_write_by_faery, kind="dat")),
        ("es", "Event Stream", ".es", partial(_write_by_faery, kind="es")),
        ("events_csv", "CSV", ".csv", partial(_write_by_faery, kind="csv")),
    )
)
