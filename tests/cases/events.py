"""Events for tests: random ones, and files of them as a render writes them."""

import json

import numpy as np
from msgspec import to_builtins

from spin_usd.files.folder import Folder
from spin_usd.files.sha256 import sha256_of
from spin_usd.formats.event_file import EventFileWriter
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.records.event_record import EventRecord
from spin_usd.records.record import RecordedCamera
from spin_usd.scene.event_sensor import EventSensor
from spin_usd.store.names import event_record_of, events_of
from spin_usd.store.read_documents import read_dataset_json

START_US, DURATION_US = 5_000_000, 2_000_000
WIDTH, HEIGHT = 64, 48
POSE_TIMES = START_US + np.array([0, 500_000, 2_000_000])


def make_events(count, *, labelled=False, seed=0):
    """Events (count,) at random pixels and times of the stream, some at the same microsecond."""
    rng = np.random.default_rng(seed)
    labels = [("target", "<u2"), ("part", "<u2")] if labelled else []
    events = np.zeros(count, [("t", "<i8"), ("x", "<u2"), ("y", "<u2"), ("p", "?"), *labels])
    events["t"] = START_US + np.sort(rng.integers(0, DURATION_US, count))
    events["x"], events["y"] = rng.integers(0, WIDTH, count), rng.integers(0, HEIGHT, count)
    events["p"] = rng.random(count) < 0.5
    if labelled:
        events["target"], events["part"] = rng.integers(0, 3, count), rng.integers(0, 40, count)
    return events


def make_poses():
    """T_cam_body (3, 2, 4, 4) of two targets at POSE_TIMES: the first turns about z, the second moves along x."""
    poses = np.tile(np.eye(4), (3, 2, 1, 1))
    for number, angle in enumerate((0.0, 0.4, 1.0)):
        poses[number, 0, :3, :3] = matrix_from_quaternion([np.cos(angle / 2), 0, 0, np.sin(angle / 2)])
        poses[number, 1, 0, 3] = number
    return poses


def write_events(path, events, *, cuts=(), labelled=False, variant="nominal", duration_us=DURATION_US):
    """Write the events, appended in the pieces between the `cuts`, as the file at `path`, and return that."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with EventFileWriter(
        path, width=WIDTH, height=HEIGHT, variant=variant, start_us=START_US, labelled=labelled
    ) as writer:
        for piece in np.split(events, list(cuts)):
            writer.append(piece)
        writer.finish(duration_us, POSE_TIMES, make_poses(), ["craft", "debris"])
    return path


def put_events(dataset, made, *, variant="nominal", labelled=False, **said) -> None:
    """Write the events that were made of a dataset's variant, and their record, which says what a render would, but for
    what is `said`."""
    path = write_events(dataset / events_of(variant), made, labelled=labelled, variant=variant)
    record = EventRecord(
        variant=variant,
        file=events_of(variant),
        sha256=sha256_of(path),
        key="0" * 64,
        events=len(made),
        start=START_US / 1e6,
        duration=DURATION_US / 1e6,
        steps=3,
        renders=2,
        labelled=labelled,
        sensor=vars(EventSensor(latency=100e-6, jitter=30e-6)),
        exposure=1.0,
        camera=RecordedCamera(width=WIDTH, height=HEIGHT, fx=90, fy=90, cx=32, cy=24, distortion=[0] * 5),
        stage=read_dataset_json(Folder(dataset)).stage.hashes[variant],
        settings={},
        versions={},
    )
    (dataset / event_record_of(variant)).write_text(json.dumps({**to_builtins(record), **said}))
