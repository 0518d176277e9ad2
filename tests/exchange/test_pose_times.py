"""Times of pose lists as other programs write them: units by name or by size, to the nanosecond."""

import pytest

from spin_usd.errors import InputError
from spin_usd.exchange.read_pose_list import read_pose_list

NS = [1403715273262140160, 1403715273312140161, 1403715273362140162]  # 50,000,001 ns apart
SECONDS = [0.0, 0.050000001, 0.100000002]
NANOSECOND = 1e-12  # of rounding; a float64 of nanoseconds since 1970 is off by 1e-7 s
HEAD = "qw,qx,qy,qz,x,y,z"


def listed(path, *lines):
    path.write_text("".join(f"{line}\n" for line in lines))
    return read_pose_list(path)


def tum(path, stamps, *head, x=0.1):
    return listed(path / "poses.txt", *head, *(f"{each} {x} 0 -6 0 0 0 1" for each in stamps))


def table(path, heading, cells):
    return listed(path / "poses.csv", f"{heading},{HEAD}", *(f"{each},1,0,0,0,0,0,6" for each in cells))


@pytest.mark.parametrize(("scale", "unit"), [(1, "nanoseconds"), (10**3, "microseconds"), (10**6, "milliseconds")])
def test_stamps_too_large_for_seconds_are_of_a_smaller_unit(tmp_path, scale, unit) -> None:
    poses = tum(tmp_path, [each // scale for each in NS])
    assert poses.times == pytest.approx(SECONDS, abs=NANOSECOND + scale * 1e-9 * (scale > 1))
    assert any(note.endswith(f"they are taken for {unit}") for note in poses.notes)


def test_a_heading_of_tum_gives_the_unit(tmp_path) -> None:
    poses = tum(tmp_path, [0, 50_000, 100_000], "# timestamp(us) tx ty tz qx qy qz qw")
    assert poses.times == pytest.approx([0, 0.05, 0.1])
    assert not any("taken for micro" in note for note in poses.notes)


def test_times_too_far_apart_or_too_near_are_told(tmp_path) -> None:
    assert "times are 1e+08 s apart: check their unit" in tum(tmp_path, [0, 10**8, 2 * 10**8]).notes[-1]
    assert "times are 1e-09 s apart: check their unit" in tum(tmp_path, ["0", "1e-9", "2e-9"]).notes[-1]


@pytest.mark.parametrize(
    ("heading", "divisor"),
    [
        *((each, 10**9) for each in ("timestamp", "t", "stamp", "timestamp [s]", "time_s", "Time", "%time (sec)")),
        *((each, 1) for each in ("time_ns", "timestamp [ns]", "timestamp", "time", "%time", "field.header.stamp")),
        *((each, 10**3) for each in ("time_us", "stamp (us)")),
        *((each, 10**6) for each in ("time (ms)", "timestamp_ms")),
    ],
)
def test_columns_of_times_are_read_by_name_and_unit(tmp_path, heading, divisor) -> None:
    cells = [f"{each // divisor}.{each % divisor:09d}" if divisor == 10**9 else each // divisor for each in NS]
    off = NANOSECOND if divisor in (1, 10**9) else divisor * 1e-9
    assert table(tmp_path, heading, cells).times == pytest.approx(SECONDS, abs=off)


def test_times_from_a_start_stay(tmp_path) -> None:
    assert table(tmp_path, "t", [5, 6, 8]).times.tolist() == [5, 6, 8]


@pytest.mark.parametrize("heading", ["date", "datetime", "utc", "stamp"])
def test_dates_are_utc(tmp_path, heading) -> None:
    poses = table(tmp_path, heading, ["2026-11-26 12:00:00", "2026-11-26T12:00:00.5Z"])
    assert (poses.times.tolist(), poses.epoch) == ([0, 0.5], "2026-11-26T12:00:00Z")


def test_a_column_of_times_that_is_not_read_is_told(tmp_path) -> None:
    poses = table(tmp_path, "time_min", [1, 2])
    assert poses.times is None
    assert "has columns of times that are not read, 'time_min'" in poses.notes[0]
    assert "'time': the column 'stamp' is the time" in table(tmp_path, "time,stamp", ["1,5", "2,6"]).notes[0]
    assert not listed(tmp_path / "t.csv", "name,qw,qx,qy,qz,t_x,t_y,t_z", "a,1,0,0,0,0,0,6").notes


@pytest.mark.parametrize(
    ("heading", "cell", "found"),
    [
        ("time [min]", 1, "has a time in min; give it in s, ms, us or ns"),
        ("date", "26/11/2026", "has the time '26/11/2026' in the column date; give UTC"),
        ("time", "1e-99999999", None),
        ("time", "1e99999999", "has the time '1e99999999'"),
        ("time", "nan", "has the time 'nan'"),
        ("time", "later", "has the time 'later'"),
    ],
)
def test_other_times_are_refused_by_name(tmp_path, heading, cell, found) -> None:
    if found is None:
        assert table(tmp_path, heading, [cell]).times.tolist() == [0]
        return
    with pytest.raises(InputError) as refused:
        table(tmp_path, heading, [cell])
    assert f"poses.csv, line 2: {found}" in str(refused.value)


POSE = [f"position.{axis}" for axis in "xyz"] + [f"orientation.{axis}" for axis in "xyzw"]


@pytest.mark.parametrize(
    ("heads", "begin"),
    [
        (["%time", "field.header.stamp", "field.header.frame_id", *(f"field.pose.{each}" for each in POSE)], "{0},{0}"),
        (["%time", "field.header.stamp", "field.header.frame_id", *(f"field.pose.pose.{e}" for e in POSE)], "{0},{0}"),
        (["header.stamp.secs", "header.stamp.nsecs", "header.frame_id", *(f"pose.{each}" for each in POSE)], "{1},{2}"),
        (["header.stamp.sec", "header.stamp.nanosec", "header.frame_id", *(f"pose.{e}" for e in POSE)], "{1},{2}"),
    ],
)
def test_tables_of_ros_are_read_and_named(tmp_path, heads, begin) -> None:
    rows = [f"{begin.format(each, each // 10**9, each % 10**9)},map,0.1,0,6,0,0,0.6,0.8" for each in NS]
    poses = listed(tmp_path / "ros.csv", ",".join(heads), *rows)
    assert poses.times == pytest.approx(SECONDS, abs=NANOSECOND)
    assert poses.q_cam_body[0] == pytest.approx([0.8, 0, 0, 0.6])
    assert poses.t_cam_body[0] == pytest.approx([0.1, 0, 6])
    assert "is ROS's CSV: its poses in 'map' are taken for the target's" in poses.notes[0]


def test_heads_like_eurocs_are_a_trajectory(tmp_path) -> None:
    rows = [f"{each // 1000},0.1,0,-6,1,0,0,0" for each in NS]
    poses = listed(tmp_path / "own.csv", "#time(us),px,py,pz,qw,qx,qy,qz", *rows)
    assert poses.times == pytest.approx([0, 0.05, 0.1], abs=1e-6)
    assert poses.t_cam_body[0] == pytest.approx([-0.1, 0, 6])
    rows = ["0.5,0.1,0,-6,1,0,0,0", "1.0,0.1,0,-6,1,0,0,0"]  # a fraction, so seconds
    assert listed(tmp_path / "own.csv", "#time,px,py,pz,qw,qx,qy,qz", *rows).times.tolist() == [0, 0.5]


def test_stamps_that_count_from_1970_keep_their_utc(tmp_path) -> None:
    poses = tum(tmp_path, ["1764316800.5", "1764316801"])
    assert (poses.epoch, poses.times.tolist()) == ("2025-11-28T08:00:00.5Z", [0, 0.5])
    assert "second 0 is 2025-11-28T08:00:00.5Z" in poses.notes[-1]
    assert tum(tmp_path, ["17.5", "18"]).epoch == ""


def test_of_two_poses_of_one_time_the_first_is_used(tmp_path) -> None:
    """TUM's own groundtruth.txt has such."""
    poses = tum(tmp_path, ["1.0", "2.0", "2.0", "2.00", "3.0"])
    assert (poses.names, poses.times.tolist()) == (("1.0", "2.0", "3.0"), [0, 1, 2])
    assert "2 of its poses have the time of the one above, and are left out" in poses.notes[-1]
    with pytest.raises(InputError, match=r"line 3 \('1.0'\): has the time of line 1 again; keep one of the two"):
        tum(tmp_path, ["1.0", "2.0", "1.0"])


def test_a_far_world_is_told(tmp_path) -> None:
    assert "is 5450 km or more from the camera in all poses" in tum(tmp_path, [0, 1], x=5450e3).notes[-1]
