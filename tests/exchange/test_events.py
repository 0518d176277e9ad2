"""Events in the formats of others: read by faery they are the same, and so are the bytes of a second export."""

import shutil

import faery
import h5py
import numpy as np
import pytest

from spin_usd.errors import InputError, UnsupportedError
from spin_usd.exchange.events import EVENT_FORMATS, write_evt3
from spin_usd.exchange.read_pose_list import read_pose_list
from spin_usd.reading.dataset import Dataset
from tests.cases.events import HEIGHT, START_US, WIDTH, make_events, write_events
from tests.exchange.conftest import contents, write_export

FORMATS = {each.name: each for each in EVENT_FORMATS}
KINDS = {"evt3": "evt", "aedat4": "aedat", "dat": "dat", "es": "es", "events_csv": "csv"}
WRAP = 2**24  # microseconds after which times of EVT 3.0 begin anew


def read(path, to):
    fallback = (WIDTH, HEIGHT) if to == "events_csv" else (1, 1)  # CSV has no field for it
    stream = faery.events_stream_from_file(path, file_type=KINDS[to], dimensions_fallback=fallback)
    return stream.dimensions(), stream.to_array()


def words_of(path):
    """Time, x, y and sign of each event, by one word of EVT 3.0 after the other: its specification as a loop."""
    head, _, body = path.read_bytes().partition(b"% end\n")
    assert head == f"% evt 3.0\n% format EVT3;height={HEIGHT};width={WIDTH}\n% geometry {WIDTH}x{HEIGHT}\n".encode()
    events, high, low, y, turns = [], -1, -1, -1, 0
    for word in np.frombuffer(body, "<u2").tolist():
        kind, value = word >> 12, word & 0xFFF
        if kind == 0x8:
            assert value == (high + 1) % 4096  # OpenEB takes no great step back for a turn
            turns += value < high
            high, low = value, -1
        elif kind == 0x6:
            low = value
        elif kind == 0x0:
            y = value
        else:
            assert kind == 0x2
            assert min(low, y) >= 0
            events.append((turns * WRAP + high * 4096 + low, value & 0x7FF, y, value >> 11))
    return np.array(events).reshape(-1, 4)


@pytest.fixture(scope="module")
def with_events(two_variants, tmp_path_factory):
    folder = shutil.copytree(two_variants, tmp_path_factory.mktemp("events") / "dataset")
    for number, variant in enumerate(("nominal", "noisy_1")):
        write_events(folder / "events" / f"{variant}.h5", make_events(5000, seed=number), variant=variant)
    return folder


@pytest.mark.parametrize("to", [to for to in FORMATS if to != "events_csv"])
def test_a_recording_is_no_pose_list(with_events, tmp_path, to) -> None:
    write_export(with_events, to, tmp_path / "out")
    with pytest.raises(InputError, match=r"is a recording of events, .* give the poses of its camera"):
        read_pose_list(next(tmp_path.glob("out/nominal.*")))


@pytest.mark.parametrize("name", ["events/t", "CD/events"])
def test_a_recording_in_hdf5_is_none_of_spades(tmp_path, name) -> None:
    with h5py.File(tmp_path / "one.h5", "w") as file:
        file[name] = np.arange(3)
    with pytest.raises(InputError, match="is a recording of events") as refused:
        read_pose_list(tmp_path / "one.h5")
    assert "SPADES" not in str(refused.value)


@pytest.mark.parametrize("to", FORMATS)
def test_every_variant_is_a_file_of_its_events(with_events, tmp_path, to) -> None:
    write_export(with_events, to, tmp_path / "out")
    for variant in ("nominal", "noisy_1"):
        (path,) = tmp_path.glob(f"out/{variant}.*")
        size, found = read(path, to)
        wanted = Dataset(with_events).events(variant).between(0, 100)
        assert size == (WIDTH, HEIGHT)
        np.testing.assert_array_equal(found["t"], wanted["t"] - START_US)
        for name in "xyp":
            np.testing.assert_array_equal(found[name], wanted[name])
    write_export(with_events, to, tmp_path / "again")
    assert contents(tmp_path / "again") == contents(tmp_path / "out")


def test_a_dataset_without_events_is_refused(rendered, tmp_path) -> None:
    with pytest.raises(InputError, match="has no events; render it with --events"):
        write_export(rendered, "evt3", tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("cuts", [[], [1], [2, 2, 3]])
def test_raw_keeps_times_over_pauses_of_any_length(tmp_path, cuts) -> None:
    """faery loses those that cross a multiple of 16.8 s, and readers those that cross one after a long pause."""
    events = make_events(7)
    events["t"] = [0, 4095, 4096, WRAP - 1, 3 * WRAP + 5, 3 * WRAP + 5, 2**32 - 1]
    events["y"][2:4] = 9
    write_evt3(np.split(events, cuts), tmp_path / "a.raw", (WIDTH, HEIGHT))
    np.testing.assert_array_equal(words_of(tmp_path / "a.raw"), np.stack([events[name] for name in "txyp"], -1))
    size, found = read(tmp_path / "a.raw", "evt3")
    assert size == (WIDTH, HEIGHT)
    np.testing.assert_array_equal(found["t"], events["t"])


def test_raw_without_events_has_its_head(tmp_path) -> None:
    write_evt3([make_events(0)], tmp_path / "a.raw", (WIDTH, HEIGHT))
    assert len(words_of(tmp_path / "a.raw")) == 0


def test_raw_refuses_sensors_that_eleven_bits_do_not_tell(tmp_path) -> None:
    with pytest.raises(UnsupportedError, match=r"has events of 4096 x 10 pixels, and EVT 3\.0 has 2048 a side at most"):
        write_evt3([], tmp_path / "a.raw", (4096, 10))
