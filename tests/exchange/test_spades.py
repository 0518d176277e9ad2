"""SPADES: what its description says of its files, read as its loader does; and its labels as a pose list."""

import json

import h5py
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spin_usd.errors import InputError, UnsupportedError
from spin_usd.exchange.read_pose_list import read_pose_list
from spin_usd.exchange.spades import POSITION, QUATERNION
from spin_usd.reading.dataset import Dataset
from tests.cases.events import START_US, make_events, write_events
from tests.exchange.conftest import PLAIN, clone, write_export

HALF = 0.5**0.5
TURNED, AT = [HALF, 0.0, 0.0, HALF], [0.1, -0.2, 5.0]  # a quarter turn about z, scalar first
TIMES = (5.0, 5.1, 7.0)  # seconds on the stage's clock, on which the stream starts at 5
VARIANTS = ("nominal", "dim")


@pytest.fixture(scope="module")
def exported(rendered, tmp_path_factory):
    """The dataset, and its export."""
    folder = tmp_path_factory.mktemp("spades")
    pictures = [
        {"frame": f"f{i}", "variant": variant, "camera": PLAIN, "time": time, "q": TURNED, "t": AT}
        for variant in VARIANTS
        for i, time in enumerate(TIMES)
    ]
    dataset = clone(rendered, folder / "dataset", pictures)
    for number, variant in enumerate(VARIANTS):
        write_events(dataset / "events" / f"{variant}.h5", make_events(5000, seed=number), variant=variant)
    write_export(dataset, "spades", folder / "out")
    return dataset, folder / "out"


@pytest.mark.parametrize(("number", "variant"), list(enumerate(VARIANTS)))
def test_a_file_has_the_events_in_ticks_of_100_microseconds(exported, number, variant) -> None:
    dataset, out = exported
    wanted = Dataset(dataset).events(variant).between(0, 100)
    with h5py.File(out / "h5" / f"RT{number:03}.h5") as file:
        found = {name: file["events"][name][()] for name in ("xs", "ys", "ts", "ps")}
    np.testing.assert_array_equal(found["ts"], (wanted["t"] - START_US) // 100)
    for name in "xyp":
        np.testing.assert_array_equal(found[f"{name}s"], wanted[name])


def test_labels_are_poses_on_the_events_clock(exported) -> None:
    """A quarter turn about z takes (1, 0, 0) to (0, 1, 0): u = 120 + 640 * 0.1 / 5, v = 75 + 640 * (1 - 0.2) / 5."""
    _, out = exported
    with h5py.File(out / "h5" / "RT001.h5") as file:
        labels = file["labels"]["data"][()]
    assert labels["filename"].astype(str).tolist() == [f"img00{i}_RT001.png" for i in range(3)]
    assert labels["timestamp"].tolist() == [0, 1000, 20_000]
    camera = json.loads((out / "camera.json").read_text())
    turn = Rotation.from_quat([labels[0][name] for name in ("Qx", "Qy", "Qz", "Qw")])
    point = turn.apply([1, 0, 0]) + [labels[0][name] for name in ("Tx", "Ty", "Tz")]
    u, v, w = np.array(camera["cameraMatrix"]) @ point
    assert (u / w, v / w) == pytest.approx((132.8, 177.4), abs=1e-12)
    assert (camera["Nu"], camera["Nv"]) == (240, 150)
    assert all((out / "images" / "RT001" / f"img00{i}_RT001.png").is_file() for i in range(3))


def test_a_trajectory_is_a_pose_list_with_times(exported) -> None:
    poses = read_pose_list(exported[1] / "h5" / "RT000.h5")
    assert poses.names == ("img000_RT000", "img001_RT000", "img002_RT000")
    np.testing.assert_allclose(poses.times, [0, 0.1, 2])
    np.testing.assert_allclose(poses.q_cam_body, [TURNED] * 3)
    np.testing.assert_allclose(poses.t_cam_body, [AT] * 3)


def test_a_picture_without_a_time_is_refused(rendered, tmp_path) -> None:
    dataset = clone(rendered, tmp_path / "dataset", [{"frame": "a", "camera": PLAIN}])
    write_events(dataset / "events" / "nominal.h5", make_events(10))
    with pytest.raises(UnsupportedError, match="a: has no time, which a label has; export to spark"):
        write_export(dataset, "spades", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_picture_that_is_not_in_the_time_of_its_events_is_refused(rendered, tmp_path) -> None:
    pictures = [{"frame": f"f{i}", "camera": PLAIN, "time": time} for i, time in enumerate((5.0, 7.001))]
    dataset = clone(rendered, tmp_path / "dataset", pictures)
    write_events(dataset / "events" / "nominal.h5", make_events(10))
    with pytest.raises(UnsupportedError, match=r"f1: is of 7\.001 s, and its events from 5 to 7 s; choose pictures"):
        write_export(dataset, "spades", tmp_path / "out")
    assert not (tmp_path / "out").exists()
    write_export(dataset, "spades", tmp_path / "out", frames="0:1")


@pytest.mark.parametrize("count", [0, 600, 5000])
def test_files_without_labels_and_damaged_ones_are_refused(exported, tmp_path, count) -> None:
    """The first are those of the set's real half."""
    path = tmp_path / "RT901.h5"
    whole = (exported[1] / "h5" / "RT000.h5").read_bytes()
    if count:
        path.write_bytes(whole[:count] + bytes(len(whole) - count))
    else:
        with h5py.File(path, "w") as file:
            file["events/ts"] = np.arange(3)
    with pytest.raises(InputError, match="has no labels/data, as files of SPADES have" if not count else "is damaged"):
        read_pose_list(path)


COLUMNS = [("filename", "S9"), *((name, "<f8") for name in (*POSITION, *QUATERNION)), ("timestamp", "<i4")]


def table(**types):
    """Two labels, of the names a and b, with columns of other types."""
    made = np.zeros(2, [(name, types.get(name, type)) for name, type in COLUMNS])
    made["filename"], made["Qw"], made["timestamp"] = ["a", "b"], 1, [0, 10]
    return made


@pytest.mark.parametrize(
    ("labels", "words"),
    [
        (table()[["filename", "Tx"]], "has no table of poses in labels/data; give filename and the numbers Tx, Ty"),
        (np.stack([table(), table()]), "has no table of poses in labels/data"),
        (table()[0], "has no table of poses in labels/data"),
        (table(Tx="<c16"), "has no table of poses in labels/data"),
        (np.zeros((2, 9)), "has no table of poses in labels/data"),
    ],
)
def test_labels_that_are_no_table_of_poses_are_refused(tmp_path, labels, words) -> None:
    with h5py.File(tmp_path / "RT000.h5", "w") as file:
        file["labels/data"] = labels
    with pytest.raises(InputError, match=words):
        read_pose_list(tmp_path / "RT000.h5")


def test_a_label_that_is_no_number_is_refused(tmp_path) -> None:
    labels = table(timestamp="<f4")
    labels["timestamp"][1] = np.nan
    with h5py.File(tmp_path / "RT000.h5", "w") as file:
        file["labels/data"] = labels
    with pytest.raises(InputError, match=r"RT000\.h5, entry 1 \('b'\): has the timestamp nan; give a number"):
        read_pose_list(tmp_path / "RT000.h5")


@pytest.mark.parametrize("type", ["S9", h5py.string_dtype()])
def test_names_are_utf_8_of_any_length(tmp_path, type) -> None:
    labels = table(filename=type)
    labels["filename"] = ["bé.png".encode(), b"b.png"]
    with h5py.File(tmp_path / "RT000.h5", "w") as file:
        file["labels/data"] = labels
    assert read_pose_list(tmp_path / "RT000.h5").files == ("bé.png", "b.png")
