"""Times of pose lists: in the stage as USD's own seconds, in records, in exports; nothing is said of lists that say
none."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Usd

from spin_usd import Dataset, export, render
from spin_usd.commands.author.in_child import author_stage
from spin_usd.errors import InputError, StageError
from spin_usd.exchange.read_pose_list import read_pose_list
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.read.frames import time_codes_per_second
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.stage.usd import schema

HEADS = "name,qw,qx,qy,qz,x,y,z"
POSES = [f"p{i},0.8,0.36,0.48,0,{0.1 * i},0.1,6" for i in range(3)]
PRESET_STEP = 24.0  # time codes a second of a stage that says nothing of seconds


def listed(folder: Path, column: str = "", *times: str) -> Path:
    path = folder / "poses.csv"
    cells = [f"{pose},{time}" for pose, time in zip(POSES, times, strict=True)] if times else POSES
    path.write_text("\n".join((f"{HEADS},{column}" if times else HEADS, *cells)) + "\n")
    return path


def authored(folder: Path, poses: Path, **options: Any) -> Path:
    made = author_stage(poses=poses, target="cubesat", camera="spin", out=folder / "stage", resolution="64", **options)
    return Path(made.root)


def author_times(root: Path, *times: float) -> None:
    """Write times into a stage, as a user would who knows them."""
    stage = Usd.Stage.Open(str(root))
    attribute = stage.GetDefaultPrim().GetAttribute(schema.CAPTURE_TIME)
    for code, time in enumerate(times):
        attribute.Set(float(time), float(code))
    stage.GetRootLayer().Save()


def test_a_list_with_an_even_step_gives_the_stage_seconds(tmp_path: Path) -> None:
    root = authored(tmp_path, listed(tmp_path, "time [s]", "10", "15", "20"))
    stage = Usd.Stage.Open(str(root))
    assert stage.GetTimeCodesPerSecond() == pytest.approx(0.2)
    frames = StageReader(root).frames
    assert [(frame.time_s, frame.utc) for frame in frames] == [(10, ""), (15, ""), (20, "")]
    seconds = [(frame.time_code - frames[0].time_code) / stage.GetTimeCodesPerSecond() for frame in frames]
    assert seconds == pytest.approx([0, 5, 10])
    assert not [finding for finding in check_stage(root) if finding.code.startswith("layer")]


def test_an_uneven_step_has_its_seconds_beside_the_time_codes(tmp_path: Path) -> None:
    root = authored(tmp_path, listed(tmp_path, "time", "0", "2", "10"))
    stage = Usd.Stage.Open(str(root))
    assert stage.GetTimeCodesPerSecond() == PRESET_STEP
    assert [frame.time_s for frame in StageReader(root).frames] == [0, 2, 10]
    rates = [time_codes_per_second(stage, code) for code in (0.0, 1.0, 2.0)]
    assert rates == pytest.approx([1 / 2, 2 / 10, 1 / 8])


@pytest.mark.parametrize("times", [("0", "10", "20"), ("0", "10", "30")], ids=["even", "uneven"])
def test_a_rolling_shutter_reads_out_in_seconds(tmp_path: Path, times: tuple[str, ...]) -> None:
    """From row to row the target moves at its speed, not at so much a picture."""
    root = authored(tmp_path, listed(tmp_path, "time", *times))
    stage = Usd.Stage.Open(str(root))
    camera = stage.GetPrimAtPath("/World/Camera")
    camera.ApplyAPI(schema.SHUTTER_API)
    camera.GetAttribute(schema.SHUTTER_READOUT_TIME).Set(0.02)
    stage.GetRootLayer().Save()
    reader = StageReader(root)
    poses = reader.scene(reader.frames[0]).bodies[0].poses
    moved = poses[-1].translation[0] - poses[0].translation[0]
    # Before its first sample a trajectory rests, so half of the rows see it move: 0.1 m in 10 s.
    assert moved == pytest.approx(0.01 * 0.02 / 2, rel=1e-6)
    last = reader.scene(reader.frames[2]).bodies[0].poses
    moved = last[-1].translation[0] - last[0].translation[0]  # after the last one too: 0.1 m in the time before it
    step = float(times[2]) - float(times[1])
    assert moved == pytest.approx(0.1 / step * 0.02 / 2, rel=1e-6)


def test_utc_gives_the_start_and_reaches_records_and_exports(tmp_path: Path) -> None:
    utc = ("2026-11-26T23:59:59.5Z", "2026-11-27T00:00:01.5Z", "2026-11-27T00:00:03.5Z")
    root = authored(tmp_path, listed(tmp_path, "utc", *utc))
    render(stage=root, out=tmp_path / "set", renderer="raycast", samples=1)
    pictures = list(Dataset(tmp_path / "set"))
    assert [picture.time_s for picture in pictures] == [0, 2, 4]
    assert [picture.utc for picture in pictures] == list(utc)
    assert pictures[1].record["utc"] == utc[1]
    export(dataset=tmp_path / "set", to="kitti", out=tmp_path / "kitti")
    (file,) = (tmp_path / "kitti").rglob("image_0*/timestamps.txt")
    assert file.read_text().splitlines()[0] == "2026-11-26 23:59:59.500000000"
    export(dataset=tmp_path / "set", to="shirt", out=tmp_path / "shirt")
    assert json.loads((tmp_path / "shirt" / "metadata.json").read_text())["pSim"]["cam_step"] == 2


def test_nothing_is_said_of_a_list_without_times(tmp_path: Path) -> None:
    root = authored(tmp_path, listed(tmp_path))
    assert Usd.Stage.Open(str(root)).GetTimeCodesPerSecond() == PRESET_STEP
    assert [(frame.time_s, frame.utc) for frame in StageReader(root).frames] == [(None, "")] * 3
    render(stage=root, out=tmp_path / "set", labels_only=True)
    picture = Dataset(tmp_path / "set")[0]
    assert (picture.time_s, picture.utc) == (None, None)
    assert not {"time_s", "utc"} & picture.record.keys()


def test_a_resumed_dataset_learns_the_times(tmp_path: Path) -> None:
    """The pictures are the same: only their records are written again."""
    root = authored(tmp_path, listed(tmp_path))
    render(stage=root, out=tmp_path / "set", labels_only=True)
    author_times(root, 0, 5, 10)
    report = render(stage=root, out=tmp_path / "set", labels_only=True)
    assert report.made == 0
    assert [picture.time_s for picture in Dataset(tmp_path / "set")] == [0, 5, 10]


def test_a_sampled_trajectory_has_its_step(tmp_path: Path) -> None:
    asked: dict[str, Any] = {"sample": "fly_around", "target": "cubesat", "camera": "spin", "count": 4}
    made = author_stage(resolution="64", out=tmp_path / "stage", **asked)
    times = [frame.time_s for frame in StageReader(Path(made.root)).frames]
    assert None not in times
    assert np.ptp(np.diff(np.array(times, float))) == pytest.approx(0)
    assert times[0] == 0


def test_the_stamps_of_tum_are_seconds_since_the_first(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("1305031102.1758 0 0 -6 0 0 0 1\n1305031102.2258 0 0 -6 0 0 0 1\n")
    assert read_pose_list(tmp_path / "a.txt").times == pytest.approx([0, 0.05], abs=1e-12)


@pytest.mark.parametrize(
    ("column", "times", "says"),
    [
        ("time", ("0", "soon", "9"), "the time 'soon'; give seconds, or UTC"),
        ("time", ("0", "1_0", "20"), "the time '1_0'; give seconds, or UTC"),
        ("time [min]", ("0", "1", "2"), "a time in min; give it in seconds"),
        ("time [m]", ("0", "1", "2"), "a time in m; give it in seconds"),
        ("utc", ("5", "6", "7"), "the time '5'; give seconds, or UTC"),
    ],
)
def test_wrong_times_are_told(tmp_path: Path, column: str, times: tuple[str, ...], says: str) -> None:
    with pytest.raises(InputError, match=says):
        authored(tmp_path, listed(tmp_path, column, *times))
    assert not (tmp_path / "stage").exists()


@pytest.mark.parametrize(
    ("times", "says"),
    [
        (("0", "5", "5"), "line 4 .* is 0 s after the one before"),
        (("0", "", "5"), "not all poses have one"),
        (("0", "1", "2026-11-26T00:00:00Z"), "some are UTC and others seconds"),
    ],
)
def test_times_that_are_of_no_use_are_left_out_with_a_note(tmp_path: Path, times: tuple[str, ...], says: str) -> None:
    """The poses were good before there were times, and are so still."""
    poses = read_pose_list(listed(tmp_path, "time", *times))
    assert poses.times is None
    assert re.search(f"its times are left out: .*{says}", " ".join(poses.notes))


def test_stamps_that_are_rounded_are_even(tmp_path: Path) -> None:
    root = authored(tmp_path, listed(tmp_path, "time", "1700000000.0", "1700000000.0333", "1700000000.0667"))
    assert Usd.Stage.Open(str(root)).GetTimeCodesPerSecond() == pytest.approx(30, rel=1e-3)


def test_pictures_in_the_other_order_have_no_times(tmp_path: Path) -> None:
    poses = read_pose_list(listed(tmp_path, "time", "0", "5", "10"))
    assert poses[::-1].times is None
    assert poses[::2].times == pytest.approx([0, 10])


def test_an_epoch_that_is_no_date_is_refused(tmp_path: Path) -> None:
    root = authored(tmp_path, listed(tmp_path, "utc", "2026-11-26", "2026-11-27", "2026-11-28"))
    stage = Usd.Stage.Open(str(root))
    stage.GetDefaultPrim().GetAttribute(schema.CAPTURE_EPOCH).Set("2026-13-45T99:99:99Z")
    stage.GetRootLayer().Save()
    with pytest.raises(StageError, match="no UTC; write it as"):
        _ = StageReader(root).frames


def test_a_stage_whose_times_go_back_is_refused(tmp_path: Path) -> None:
    root = authored(tmp_path, listed(tmp_path))
    author_times(root, 0, 5, 4)
    with pytest.raises(StageError, match="not after the 5 s before it"):
        _ = StageReader(root).frames
