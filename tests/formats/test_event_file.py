"""Event files: what was appended is read, by slices of time; equal events are equal bytes; faults are one sentence."""

import resource
import signal
import time

import h5py
import numpy as np
import pytest

from spin_usd.errors import InputError, MissingPackageError
from spin_usd.files.folder import FileIn, Folder
from spin_usd.formats.event_file import LONGEST, EventFile, EventFileWriter
from spin_usd.formats.hdf5 import CHUNK
from tests.cases.events import DURATION_US, POSE_TIMES, START_US, make_events, make_poses, write_events

MANY = 2 * CHUNK + 77


def opened(path) -> EventFile:
    return EventFile(FileIn(Folder(path.parent), path.name))


@pytest.mark.parametrize("labelled", [False, True])
@pytest.mark.parametrize("count", [0, 1, CHUNK, MANY])
def test_what_was_written_is_read(tmp_path, count, labelled) -> None:
    events = make_events(count, labelled=labelled)
    file = opened(write_events(tmp_path / "a.h5", events, labelled=labelled))
    np.testing.assert_array_equal(file.piece(0, count + 5), events)
    assert len(file) == count
    assert (file.width, file.height, file.variant, file.names) == (64, 48, "nominal", ("craft", "debris"))
    assert (file.start_us, file.duration_us) == (START_US, DURATION_US)
    np.testing.assert_array_equal(file.pose_times, POSE_TIMES)
    np.testing.assert_array_equal(file.poses[:], make_poses())


def test_names_may_be_of_any_letters(tmp_path) -> None:
    assert opened(write_events(tmp_path / "a.h5", make_events(1), variant="höhe_高")).variant == "höhe_高"


def test_labels_that_nobody_asked_for_are_left_out(tmp_path) -> None:
    labelled = write_events(tmp_path / "a.h5", make_events(1000, labelled=True))
    assert labelled.read_bytes() == write_events(tmp_path / "b.h5", make_events(1000)).read_bytes()


def test_the_same_events_are_the_same_bytes_however_they_are_cut_and_whenever(tmp_path) -> None:
    events = make_events(MANY, labelled=True)
    whole = write_events(tmp_path / "whole.h5", events, labelled=True).read_bytes()
    time.sleep(1.01 - time.time() % 1)  # into the next second, which is what HDF5 counts in
    for cuts in ([CHUNK], [CHUNK - 1, CHUNK, CHUNK + 1], range(1, MANY, 997), [5, 5, 5]):
        assert write_events(tmp_path / "cut.h5", events, cuts=cuts, labelled=True).read_bytes() == whole


@pytest.mark.parametrize("duration_us", [DURATION_US, DURATION_US - 300, DURATION_US + 5_001])
def test_the_index_is_as_loaders_of_dsec_take_it(tmp_path, duration_us) -> None:
    """t[ms_to_idx[ms]] is the first that is not before ms; loaders round the end of a slice up to whole ms."""
    with h5py.File(write_events(tmp_path / "a.h5", make_events(MANY), duration_us=duration_us), "r") as file:
        t, index = file["events/t"][:], file["ms_to_idx"][:]
        assert file["t_offset"][()] == START_US
        assert {file[f"events/{name}"].dtype.name for name in "xy"} == {"uint16"}
        assert (t.dtype, file["events/p"].dtype, index.dtype) == (np.uint32, np.uint8, np.uint64)
        assert set(np.unique(file["events/p"])) == {0, 1}
    np.testing.assert_array_equal(index, np.searchsorted(t, 1000 * np.arange(len(index))))
    assert len(index) == -(-max(duration_us, int(t[-1])) // 1000) + 1


def test_a_slice_has_what_lies_between_its_times(tmp_path) -> None:
    events = make_events(MANY)
    events["t"][-3:] = START_US + DURATION_US  # the last that an index reaches
    file = opened(write_events(tmp_path / "a.h5", events))
    rng = np.random.default_rng(1)
    times = [-5, 0, 1, 999, 1000, DURATION_US, DURATION_US + 1, DURATION_US + 10**9, *rng.integers(0, DURATION_US, 40)]
    for start in times:
        for end in times:
            inside = (events["t"] >= START_US + start) & (events["t"] < START_US + end)
            np.testing.assert_array_equal(file.between(START_US + int(start), START_US + int(end)), events[inside])


def test_times_that_a_file_cannot_hold_are_refused(tmp_path) -> None:
    def appended(*times):
        events = make_events(len(times))
        events["t"] = START_US + np.array(times)
        write_events(tmp_path / "a.h5", events, cuts=range(1, len(times), 2), duration_us=0)

    appended(0, 0, 5, LONGEST)
    for wrong in ((3, 2), (0, 3, 2), (-1, 3)):
        with pytest.raises(InputError, match="not in the order of their times"):
            appended(*wrong)
    with pytest.raises(InputError, match="a stream of 4295 s is longer than the 4295 s that its file holds"):
        appended(0, LONGEST + 1)
    with pytest.raises(InputError, match="a stream of 5000 s is longer"):
        write_events(tmp_path / "a.h5", make_events(0), duration_us=5_000_000_000)


def test_a_full_disk_is_an_error_of_the_system_and_the_process_lives(tmp_path) -> None:
    """HDF5 that cannot write ends the process when that ends."""
    before, handler = resource.getrlimit(resource.RLIMIT_FSIZE), signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, before[1]))
    try:
        for count in (MANY, CHUNK - 1):  # met by `append`, and when the file is closed
            with pytest.raises(OSError, match="File too large"):
                write_events(tmp_path / "a.h5", make_events(count))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)


def test_without_h5py_there_is_a_sentence(tmp_path, monkeypatch) -> None:
    path = write_events(tmp_path / "a.h5", make_events(10))
    monkeypatch.setitem(__import__("sys").modules, "h5py", None)
    for act in (lambda: opened(path), lambda: write_events(tmp_path / "b.h5", make_events(10))):
        with pytest.raises(MissingPackageError, match=r"h5py is not installed; run .*pip install 'h5py>=3\.14'"):
            act()


def linked_out(file) -> None:
    del file["events/x"]
    file["events/x"] = h5py.ExternalLink("other.h5", "/events/x")


def kept_elsewhere(file) -> None:
    count = len(file["events/x"])
    del file["events/x"]
    file.create_dataset("events/x", (count,), "<u2", external=[("/etc/hostname", 0, h5py.h5f.UNLIMITED)])


def of_other_type(file) -> None:
    p = file["events/p"][:].astype(float)
    del file["events/p"]
    file["events/p"] = p


def shorter(file) -> None:
    file["events/y"].resize((3,))


def index_beyond(file) -> None:
    file["ms_to_idx"][-1] = 10**9


def poses_of_others(file) -> None:
    file["poses"].attrs["names"] = np.array([b"craft"])


def of_no_size(file) -> None:
    file.attrs["width"] = 0


def named_in_a_heap(file) -> None:
    """Texts of any length lie in a heap, over which HDF5 may never end."""
    file.attrs["variant"] = "nominal"


DAMAGES = (
    of_no_size,
    named_in_a_heap,
    linked_out,
    kept_elsewhere,
    of_other_type,
    shorter,
    index_beyond,
    poses_of_others,
)


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda each: each.__name__)
def test_what_is_no_event_file_is_one_sentence(tmp_path, damage) -> None:
    path = write_events(tmp_path / "a.h5", make_events(1000))
    with h5py.File(path, "r+") as file:
        damage(file)
    with pytest.raises(InputError, match=r"a\.h5: is damaged"):
        opened(path)


def test_an_event_beyond_the_sensor_is_one_sentence(tmp_path) -> None:
    events = make_events(10)
    events["y"][7] = 48
    file = opened(write_events(tmp_path / "a.h5", events))
    assert len(file.piece(0, 7)) == 7
    with pytest.raises(InputError, match=r"a\.h5: is damaged \(an event is beyond the sensor\)"):
        file.piece(0, 8)


def test_a_file_that_is_cut_short_is_one_sentence(tmp_path) -> None:
    path = write_events(tmp_path / "a.h5", make_events(1000))
    whole = path.read_bytes()
    for size in (0, 100, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:size])
        with pytest.raises(InputError, match=r"a\.h5: is damaged"):
            opened(path)


def test_a_file_that_was_not_finished_is_one_sentence(tmp_path) -> None:
    with EventFileWriter(tmp_path / "a.h5", width=64, height=48, variant="a", start_us=0, labelled=False):
        pass
    with pytest.raises(InputError, match=r"a\.h5: is damaged"):
        opened(tmp_path / "a.h5")
