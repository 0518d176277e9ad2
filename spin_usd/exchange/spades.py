"""SPADES, of stream 2 of SPARK 2026: events and poses of a trajectory in an HDF5 file, and its camera.

h5/RTnnn.h5 has events/xs, ys, ts and ps, and labels/data, a table of filename, position in metres, quaternion, scalar
last, and timestamp. Times count 100 us from the trajectory's start; so do those of its synthetic half, while its real
half counts microseconds and has no labels. Sources: the set's description, its loader and its camera.json, from
StaffordHo/spark2026-pose-estimation. The folder of the images that labels name is not public: here images/RTnnn.
"""

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from spin_usd.basics.faults import decoding
from spin_usd.errors import InputError, UnsupportedError
from spin_usd.exchange.events import RECORDINGS, recording, streams_of
from spin_usd.exchange.layout.export_format import ExportFormat, Layout, MadeFile, Output
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.images import any_image
from spin_usd.exchange.layout.limits import needs_extra, no_distortion, one_camera
from spin_usd.exchange.pose_format import SCALAR_LAST, PoseEntry, PoseFormat, files_like
from spin_usd.exchange.speedplus import camera_file
from spin_usd.files.size_limits import MAX_SHARD
from spin_usd.files.user_file import open_file
from spin_usd.formats.hdf5 import ColumnFile, open_hdf5, own_dataset

TICK_US = 100
TICKS = 10_000  # in a second
HALF_TICK = 0.5 / TICKS
EVENTS = {"events/xs": "x", "events/ys": "y", "events/ts": "t", "events/ps": "p"}
LABELS = "labels/data"
POSITION, QUATERNION = ("Tx", "Ty", "Tz"), ("Qx", "Qy", "Qz", "Qw")
NUMBERS = (*POSITION, *QUATERNION, "timestamp")
INTEGER = "<i8"  # the set has int: sums in readers do not overflow
HDF5 = "HDF\r\n\x1a\n"  # of a file's head, after its first byte, which is not text
CONVENTIONS = (
    "h5/RTnnn.h5 is one variant: events/xs, ys, ts, ps are column, row, time and sign, 1 brighter; x and y from the "
    "upper left pixel, which is (0, 0). It has all events of its variant, whichever pictures are exported.",
    "Times are whole 100 us since the stream's start, as in the set's synthetic half: event times are cut to them, "
    "label times are rounded.",
    "labels/data: p_cam = R(q) p_body + T; Qx, Qy, Qz, Qw is the unit quaternion, scalar last, Hamilton, of the "
    "rotation from the body's axes to the camera's; T is the body's origin in the camera's axes, in metres.",
    "Camera axes are OpenCV's: x right, y down, z forward. camera.json: cameraMatrix in pixels, (0, 0) being the "
    "corner of the image.",
    "Images are in images/RTnnn, which is assumed; labels of events are in the dataset alone.",
)


def _sequence(dataset: ExportedDataset, variant: str) -> str:
    return f"RT{dataset.variants.index(variant):03}"


def _filename(dataset: ExportedDataset, picture: ExportedPicture) -> str:
    return f"img{picture.number - dataset.firsts[picture.variant]:03}_{_sequence(dataset, picture.variant)}.png"


def refuse(dataset: ExportedDataset) -> None:
    """Raise InputError and UnsupportedError where a picture is not between the first and the last of its events."""
    streams = streams_of(dataset)
    for picture in dataset:
        stream, time, where = streams[picture.variant], picture.picture.time_s, picture.name
        if time is None:
            raise UnsupportedError("has no time, which a label has", where=where, do="export to spark")
        if not -HALF_TICK <= time - stream.start <= stream.duration + HALF_TICK:
            found = f"is of {time:g} s, and its events from {stream.start:g} to {stream.start + stream.duration:g} s"
            raise UnsupportedError(found, where=where, do="choose pictures with --frames")


def _files(dataset: ExportedDataset, picture: ExportedPicture) -> Iterator[Output]:
    """Yield the image, and the trajectory that the picture is the last of, if it is."""
    sequence = _sequence(dataset, picture.variant)
    yield any_image(picture, f"images/{sequence}/{_filename(dataset, picture)}")
    if numbers := dataset.ended_by(picture):
        yield MadeFile(path=f"h5/{sequence}.h5", write=partial(_write, dataset, numbers))


def _write(dataset: ExportedDataset, numbers: Sequence[int], path: Path) -> None:
    pictures = [dataset.picture(number) for number in numbers]
    stream = dataset.dataset.events(pictures[0].variant)
    with ColumnFile(path, dict.fromkeys(EVENTS, INTEGER)) as columns:
        for packet in stream.packets():
            packet["t"] = (packet["t"] - stream.start_us) // TICK_US
            columns.append({name: packet[field] for name, field in EVENTS.items()})
        columns.finish()
        rows = []
        for picture in pictures:
            w, *xyz = picture.target.q_cam_body.tolist()
            time = round(((picture.picture.time_s or 0.0) - stream.start) * TICKS)
            rows.append((_filename(dataset, picture), *picture.target.t_cam_body.tolist(), *xyz, w, time))
        length = max(len(row[0]) for row in rows)
        types = [("filename", f"S{length}"), *((name, "<f8") for name in NUMBERS[:-1]), (NUMBERS[-1], INTEGER)]
        columns.file[LABELS] = np.array(rows, types)


SPADES = ExportFormat(
    name="spades",
    holds="in the layout of SPADES: events and poses of trajectories",
    layout=Layout(
        needs=("image",),
        conventions=CONVENTIONS,
        shared=lambda dataset: iter((camera_file(dataset),)),
        files=_files,
        limits=(needs_extra("events", but="faery"), no_distortion, one_camera),
        refuse=refuse,
        splits={"train": "train"},
    ),
)


def read_poses(path: Path) -> Iterator[PoseEntry]:
    """Read the labels of the file. Raises InputError, and MissingPackageError without h5py."""
    with open_file(path, MAX_SHARD) as file, decoding(path):
        hdf5 = open_hdf5(file)
        if LABELS not in hdf5:
            if any(each in hdf5 for each in RECORDINGS) and not any(each in hdf5 for each in EVENTS):
                raise recording(path)
            do = "give one of its synthetic half: its real half has no poses"
            raise InputError(f"has no {LABELS}, as files of SPADES have", where=path, do=do)
        labels = own_dataset(hdf5, LABELS)[()]
        kinds = {name: labels.dtype[name].kind for name in labels.dtype.names or ()}
        if labels.ndim != 1 or any(kinds.get(name, "") not in {*"iuf"} for name in NUMBERS) or "filename" not in kinds:
            do = f"give filename and the numbers {', '.join(NUMBERS)}"
            raise InputError(f"has no table of poses in {LABELS}", where=path, do=do)
        names = [name.decode() if isinstance(name, bytes) else str(name) for name in labels["filename"].tolist()]
        numbers = np.stack([labels[name].astype(np.float64) for name in NUMBERS], -1)
    if not np.isfinite(numbers).all():
        row, column = np.argwhere(~np.isfinite(numbers))[0].tolist()
        found = f"has the {NUMBERS[column]} {numbers[row, column]}"
        raise InputError(found, where=f"{path}, entry {row} ({names[row]!r})", do="give a number")
    for name, (*t, x, y, z, w, time) in zip(names, numbers.tolist(), strict=True):
        yield PoseEntry(filename=name, q_cam_body=(w, x, y, z), t_cam_body=t, time=time / TICKS)


SPADES_POSES = PoseFormat(
    name="SPADES",
    recognises=lambda path, head: head[1:].startswith(HDF5),
    read=read_poses,
    lists=files_like("*.h5", "h5/*.h5"),
    rotation=SCALAR_LAST,
)
