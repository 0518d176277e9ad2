"""Streams of events as those who train read them: slices, arrays of closed forms, poses between those stored."""

import json
import multiprocessing
import os
import pickle
import shutil
import subprocess
import sys

import numpy as np
import pytest

from spin_usd.errors import InputError
from spin_usd.files.folder import FileIn, Folder
from spin_usd.formats.event_file import EventFile
from spin_usd.formats.hdf5 import CHUNK
from spin_usd.reading.dataset import Dataset
from spin_usd.reading.events import EventStream
from tests.cases.events import DURATION_US, HEIGHT, POSE_TIMES, START_US, WIDTH, make_events, make_poses, write_events
from tests.conftest import REPOSITORY

START, END = START_US / 1e6, (START_US + DURATION_US) / 1e6
EXACT = 1e-12


def stream_of(folder, events, **how) -> EventStream:
    write_events(folder / "a.h5", events, **how)
    return EventStream(FileIn(Folder(folder), "a.h5"))


def few(*rows):
    """Events of these (microseconds since the start, x, y, brighter)."""
    events = make_events(len(rows))
    for name, column in zip("txyp", zip(*rows, strict=True), strict=True):
        events[name] = column
    events["t"] += START_US
    return events


def test_a_stream_says_what_it_is_and_has_all_events(tmp_path) -> None:
    events = make_events(3000, labelled=True)
    stream = stream_of(tmp_path, events, labelled=True)
    assert (len(stream), stream.start, stream.duration) == (3000, START, DURATION_US / 1e6)
    assert (stream.width, stream.height, stream.variant) == (WIDTH, HEIGHT, "nominal")
    assert stream.targets == ("craft", "debris")
    np.testing.assert_array_equal(stream.between(START, END), events)
    np.testing.assert_array_equal(np.concatenate(list(stream.packets(701))), events)
    assert [len(packet) for packet in stream.packets(1024)] == [1024, 1024, 952]


def test_seconds_are_the_microseconds_that_they_are_meant_to_be(tmp_path) -> None:
    """5.000003 s is less than 5,000,003 us as a binary number, and 5.0000041 s lies between two."""
    stream = stream_of(tmp_path, few((3, 0, 0, True), (4, 1, 0, True), (5, 2, 0, True)))
    assert stream.between(5.000003, 5.000005)["x"].tolist() == [0, 1]
    assert stream.between(5.0000031, 5.0000051)["x"].tolist() == [1, 2]


def test_windows_side_by_side_have_each_event_once(tmp_path) -> None:
    events = make_events(5000)
    stream = stream_of(tmp_path, events)
    for seconds in (0.1, 1 / 3, 0.007, 2.0):
        windows = list(stream.windows(seconds))
        assert len(windows) == int(2.0 / seconds + 1e-9)
        joined = np.concatenate([stream.between(*window) for window in windows])
        np.testing.assert_array_equal(joined, events[: len(joined)])
    assert [start for start, _ in stream.windows(1.0, 0.25)] == pytest.approx([5, 5.25, 5.5, 5.75, 6])
    assert list(stream.windows(2.1)) == []
    with pytest.raises(InputError, match=r"there are no windows of 1 s each 0 s; give numbers above 0"):
        stream.windows(1, 0)


def test_a_loop_over_windows_reads_no_more_than_they_hold(tmp_path, monkeypatch) -> None:
    read = []
    piece = EventFile.piece

    def noted(file, first, last):
        read.append(last - first)
        return piece(file, first, last)

    monkeypatch.setattr(EventFile, "piece", noted)
    stream = stream_of(tmp_path, make_events(2 * CHUNK))
    for window in stream.windows(0.01):
        stream.frame(*window)
    assert len(read) == 200
    assert max(read) < 2 * CHUNK / 100


def test_a_frame_counts_brighter_events_first(tmp_path) -> None:
    stream = stream_of(tmp_path, few((0, 1, 2, True), (5, 1, 2, True), (7, 63, 47, False), (2000, 1, 2, True)))
    frame = stream.frame(START, START + 0.001)
    assert frame.shape == (2, HEIGHT, WIDTH)
    assert [frame[0, 2, 1], frame[1, 47, 63], frame.sum()] == [2, 1, 3]
    events = make_events(4000)
    stream = stream_of(tmp_path, events)
    wanted = np.zeros((2, HEIGHT, WIDTH), int)
    np.add.at(wanted, (1 - events["p"].astype(int), events["y"], events["x"]), 1)
    np.testing.assert_array_equal(stream.frame(START, END), wanted)


def test_a_voxel_grid_shares_events_between_the_nearest_bins(tmp_path) -> None:
    stream = stream_of(tmp_path, few((0, 0, 0, True), (250, 1, 0, True), (500, 2, 0, False), (900, 3, 0, True)))
    grid = stream.voxel_grid(START, START + 0.001, 3)
    assert grid.dtype == np.float32
    np.testing.assert_allclose(grid[:, 0, :4].T, [[1, 0, 0], [0.5, 0.5, 0], [0, -1, 0], [0, 0.2, 0.8]], atol=1e-6)
    assert np.count_nonzero(np.abs(grid) > 1e-6) == 6
    for bins in (1, 2, 7):  # whatever the bins, they share one event as a whole
        events = make_events(4000)
        all_bins = stream_of(tmp_path, events).voxel_grid(START, END, bins)
        np.testing.assert_allclose(all_bins.sum(), np.where(events["p"], 1, -1).sum(), atol=1e-3)
        assert all_bins.shape == (bins, HEIGHT, WIDTH)
    with pytest.raises(InputError, match="there is no grid of 0 bins from 5 to 6 s"):
        stream.voxel_grid(5, 6, 0)
    with pytest.raises(InputError, match="there is no grid of 3 bins from 6 to 6 s"):
        stream.voxel_grid(6, 6, 3)


def test_a_time_surface_decays_from_the_last_event(tmp_path) -> None:
    stream = stream_of(tmp_path, few((0, 1, 0, True), (400, 1, 0, True), (700, 1, 0, False), (1500, 2, 0, True)))
    surface = stream.time_surface(START, START + 0.001, 0.0005)
    np.testing.assert_allclose(surface[:, 0, 1], np.exp([-0.6 / 0.5, -0.3 / 0.5]), rtol=1e-6)
    assert np.count_nonzero(surface) == 2
    events = make_events(20_000)
    last = np.full((2, HEIGHT, WIDTH), -np.inf)
    np.maximum.at(last, (1 - events["p"].astype(int), events["y"], events["x"]), events["t"] / 1e6)
    found = stream_of(tmp_path, events).time_surface(START, END, 0.3)
    np.testing.assert_allclose(found, np.exp((last - END) / 0.3), rtol=1e-6)
    with pytest.raises(InputError, match="events cannot decay in 0 s"):
        stream.time_surface(5, 6, 0)


def test_poses_between_those_stored_turn_and_move_at_a_steady_rate(tmp_path) -> None:
    stream = stream_of(tmp_path, make_events(10))
    for time, stored in zip(POSE_TIMES / 1e6, make_poses(), strict=True):
        np.testing.assert_allclose(stream.pose(time), stored[0], atol=EXACT)
        np.testing.assert_allclose(stream.pose(time, "debris"), stored[1], atol=EXACT)
    turned = stream.pose(5.25)
    np.testing.assert_allclose(turned[:2, :2], [[np.cos(0.2), -np.sin(0.2)], [np.sin(0.2), np.cos(0.2)]], atol=EXACT)
    assert stream.pose(5.5 + 1.5 / 4, "debris")[0, 3] == pytest.approx(1.25)
    with pytest.raises(InputError, match=r"has no target 'moon'; choose among craft, debris"):
        stream.pose(5, "moon")
    for time in (4.9, 7.1):
        with pytest.raises(InputError, match=rf"has no pose at {time} s, but from 5.0 to 7.0 s"):
            stream.pose(time)


def count_in(stream, window) -> int:
    return len(stream.between(*window))


FORKED = """
import json, multiprocessing, os
from pathlib import Path
from spin_usd.files.folder import FileIn, Folder
from spin_usd.reading.events import EventStream
path = Path(os.environ["EVENTS"])
stream = EventStream(FileIn(Folder(path.parent), path.name))
windows = list(stream.windows(0.05))  # it is open now
def count(window): return len(stream.between(*window))
with multiprocessing.get_context("fork").Pool(2) as pool: print(json.dumps(pool.map(count, windows)))
"""


def test_a_stream_goes_to_other_processes_open_or_not(tmp_path) -> None:
    stream = stream_of(tmp_path, make_events(2 * CHUNK))
    windows = list(stream.windows(0.05))
    wanted = [count_in(stream, window) for window in windows]  # it is open now
    assert len(pickle.dumps(stream)) < 1000
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        assert pool.starmap(count_in, [(stream, window) for window in windows]) == wanted
    here = {"PYTHONPATH": str(REPOSITORY), "EVENTS": str(tmp_path / "a.h5")}
    done = subprocess.run([sys.executable, "-c", FORKED], env=os.environ | here, capture_output=True, text=True)
    assert json.loads(done.stdout) == wanted, done.stderr


def test_a_dataset_finds_its_events(rendered, tmp_path) -> None:
    folder = shutil.copytree(rendered, tmp_path / "dataset")
    with pytest.raises(InputError, match="dataset: has no events; render it with --events"):
        Dataset(folder).events()
    write_events(folder / "events" / "nominal.h5", make_events(7))
    assert len(Dataset(folder).events()) == len(Dataset(folder).events("nominal")) == 7
    with pytest.raises(InputError, match="has no events of variant 'noisy_1'; choose among nominal"):
        Dataset(folder).events("noisy_1")
    write_events(folder / "events" / "noisy_1.h5", make_events(8), variant="noisy_1")
    assert Dataset(folder).events("noisy_1").variant == "noisy_1"
    with pytest.raises(InputError, match=r"has events of several variants; choose among (nominal|noisy_1), "):
        Dataset(folder).events()
