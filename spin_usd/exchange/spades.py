"""SPADES, of stream 2 of SPARK 2026: events and poses of a trajectory in an HDF5 file, and its camera.

h5/RTnnn.h5 has events/xs, ys, ts and ps, and labels/data, a table of filename, position in metres, quaternion, scalar
last, and timestamp. Times count 100 us from the trajectory's start; so do those of its synthetic half, while its real
half counts microseconds and has no labels. Sources: the set's description, its loader and its camera.json, as
StaffordHo/spark2026-pose-estimation has them. Where the images that labels name lie is not public: here in
images/RTnnn.
"""

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from spin_usd.errors import InputError, UnsupportedError
from spin_usd.exchange.layout.export_format import ExportFormat, Layout, MadeFile, Output
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.images import any_image
from spin_usd.exchange.layout.limits import no_distortion, one_camera
from spin_usd.exchange.pose_format import SCALAR_LAST, PoseEntry, PoseFormat, files_like
from spin_usd.exchange.speedplus import camera_file
from spin_usd.faults import decoding
from spin_usd.files.size_limits import MAX_SHARD
from spin_usd.files.user_file import open_file
from spin_usd.formats.hdf5 import ColumnFile, open_hdf5, own_dataset

TICK_US = 100
TICKS = 10_000  # in a second
EVENTS = {"events/xs": "x", "events/ys": "y", "events/ts": "t", "events/ps": "p"}
LABELS = "labels/data"
POSITION, QUATERNION = ("Tx", "Ty", "Tz"), ("Qx", "Qy", "Qz", "Qw")
NUMBERS = (*POSITION, *QUATERNION, "timestamp")
INTEGER = "<i8"  # the set says int: no sum of a reader's overflows
HDF5 = "HDF\r\n\x1a\n"  # of a file's head, after its first byte, which is no text
CONVENTIONS = (
    "h5/RTnnn.h5 is one variant: events/xs, ys, ts, ps are column, row, time and sign, 1 brighter; x and y from the "
    "upper left pixel, which is (0, 0). It has all events of its variant, whichever pictures are exported.",
    "Times are whole 100 us since the stream's start, as in the set's synthetic half: events lose what is between.",
    "labels/data: p_cam = R(q) p_body + T; Qx, Qy, Qz, Qw is the unit quaternion, scalar last, Hamilton, of the "
    "rotation from the body's axes to the camera's; T is the body's origin in the camera's axes, in metres.",
    "Camera axes are OpenCV's: x right, y down, z forward. camera.json: cameraMatrix in pixels, (0, 0) being the "
    "corner of the image.",
    "Images are in images/RTnnn, which is assumed; labels of events are in the dataset alone.",
)


def _sequence(dataset: ExportedDataset, variant: str) -> str:
    return f"RT{dataset.variants.index(variant):03}"


def _filename(dataset: ExportedDataset, picture: ExportedPicture) -> str:
    return f"img{picture.number - dataset.first(picture.variant).number:03}_{_sequence(dataset, picture.variant)}.png"


def _files(dataset: ExportedDataset, picture: ExportedPicture) -> Iterator[Output]:
    """Yield the image, and the trajectory that the picture is the last of, if it is."""
    sequence = _sequence(dataset, picture.variant)
    yield any_image(picture, f"images/{sequence}/{_filename(dataset, picture)}")
    numbers = [number for number, entry in enumerate(dataset.entries) if entry.variant == picture.variant]
    if picture.number == numbers[-1]:
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
            if (seconds := picture.picture.time_s) is None:
                raise UnsupportedError("has no time, which a label has", where=picture.name, do="export to spark")
            w, *xyz = picture.target.q_cam_body.tolist()
            time = round((seconds - stream.start) * TICKS)
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
        limits=(no_distortion, one_camera),
        splits={"train": "train"},
    ),
)


def read_poses(path: Path) -> Iterator[PoseEntry]:
    """Read the labels of the file. Raises InputError, and MissingPackageError without h5py."""
    with open_file(path, MAX_SHARD) as file, decoding(path):
        hdf5 = open_hdf5(file)
        if LABELS not in hdf5:
            raise InputError(f"has no {LABELS}, as files of SPADES have", where=path, do="give a pose list")
        labels = own_dataset(hdf5, LABELS)[:]
        for name in ("filename", *NUMBERS):
            if name not in (labels.dtype.names or ()):
                raise InputError(f"has no {name} in {LABELS}", where=path, do=f"give filename, {', '.join(NUMBERS)}")
        names = labels["filename"].astype(str).tolist()
        numbers = np.stack([labels[name].astype(np.float64) for name in NUMBERS], -1).tolist()
    for name, (*t, x, y, z, w, time) in zip(names, numbers, strict=True):
        yield PoseEntry(filename=name, q_cam_body=(w, x, y, z), t_cam_body=t, time=time / TICKS)


SPADES_POSES = PoseFormat(
    name="SPADES",
    recognises=lambda path, head: head[1:].startswith(HDF5),
    read=read_poses,
    lists=files_like("*.h5", "h5/*.h5"),
    rotation=SCALAR_LAST,
)
