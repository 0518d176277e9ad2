"""Times of pose lists: in the stage as USD's own seconds, in records, in exports; nothing is said of lists that say
none."""

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Gf, Usd
from scipy.spatial.transform import Rotation

from spin_usd import Dataset, export, render
from spin_usd.commands.author.in_child import author_stage
from spin_usd.errors import InputError, StageError
from spin_usd.exchange.read_pose_list import read_pose_list
from spin_usd.geometry.blur import rotation_angle
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.read.clock import Clock
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
    clock = Clock(stage)
    assert [clock.seconds(code) for code in (-0.5, 0.5, 1.5, 2.5)] == pytest.approx([-1, 1, 6, 14])
    assert [clock.time_code(time) for time in (-1, 1, 6, 14)] == pytest.approx([-0.5, 0.5, 1.5, 2.5])


@pytest.mark.parametrize("times", [("0", "10", "20"), ("0", "10", "30")], ids=["even", "uneven"])
def test_a_rolling_shutter_reads_out_in_seconds(tmp_path: Path, times: tuple[str, ...]) -> None:
    """From row to row the target moves at its speed, not at so much a picture."""
    root = authored(tmp_path, listed(tmp_path, "time", *times))
    stage = Usd.Stage.Open(str(root))
    camera = stage.GetPrimAtPath("/World/Camera")
    camera.ApplyAPI(schema.SHUTTER_API)
    camera.GetAttribute(schema.SHUTTER_READOUT_TIME).Set(0.02)
    exposure = camera.GetAttribute("exposure:time").Get()  # for which each row is open
    stage.GetRootLayer().Save()
    reader = StageReader(root)
    poses = reader.scene(reader.frames[0]).bodies[0].poses
    moved = poses[-1].translation[0] - poses[0].translation[0]
    # Three poses are too few for rates, so before the first and after the last the target rests, and half of the rows
    # see it move: 0.1 m in 10 s.
    open_for = 0.02 + exposure
    assert moved == pytest.approx(0.01 * open_for / 2, rel=1e-6)
    last = reader.scene(reader.frames[2]).bodies[0].poses
    moved = last[-1].translation[0] - last[0].translation[0]
    assert moved == pytest.approx(0.1 / (float(times[2]) - float(times[1])) * open_for / 2, rel=1e-6)


def moving(folder: Path, speed: float, turn_deg: float = 0.0, *, times: Sequence[float] = range(7)) -> Path:
    """The target at 6 m, moving across at `speed`, metres a second, and turning about the camera's axis."""
    rows = []
    for i, time in enumerate(times):
        half = np.radians(turn_deg * time) / 2
        rows.append(f"p{i},{np.cos(half)!r},0,0,{np.sin(half)!r},{speed * time!r},0,6,{time!r}")
    path = folder / "moving.csv"
    path.write_text("\n".join((f"{HEADS},time", *rows)).replace("np.float64(", "").replace(")", "") + "\n")
    return path


def test_the_shutter_is_open_for_the_exposure_and_blurs_by_the_rates(tmp_path: Path) -> None:
    speed, turn_deg = 0.5, 30.0
    root = authored(tmp_path, moving(tmp_path, speed, turn_deg))
    stage = Usd.Stage.Open(str(root))
    exposure = stage.GetPrimAtPath("/World/Camera").GetAttribute("exposure:time").Get()
    reader = StageReader(root)
    for frame in (reader.frames[0], reader.frames[3], reader.frames[-1]):  # the ends move on
        scene = reader.scene(frame)
        (body,) = scene.bodies
        assert scene.shutter is not None
        blur = (body.poses[-1].translation - body.poses[0].translation) / 6 * scene.camera.fx
        assert blur == pytest.approx([speed * exposure / 6 * scene.camera.fx, 0, 0], rel=0.01, abs=1e-9)
        assert rotation_angle(body.poses[0], body.poses[-1]) == pytest.approx(np.radians(turn_deg) * exposure, rel=1e-4)
        assert body.T_cam_body.translation[0] == pytest.approx(speed * (scene.frame.time_s or 0.0))
        assert body.motion is not None
        assert body.motion.velocity == pytest.approx([speed, 0, 0], abs=1e-9)
        assert body.motion.angular_velocity == pytest.approx([0, 0, np.radians(turn_deg)], abs=1e-9)


def test_what_hardly_moves_is_an_instant_and_so_is_what_a_layer_says(tmp_path: Path) -> None:
    slow = StageReader(authored(tmp_path, moving(tmp_path, 1e-4)))
    assert slow.scene(slow.frames[1]).shutter is None
    (tmp_path / "still").mkdir()
    root = authored(tmp_path / "still", moving(tmp_path, 0.5))
    stage = Usd.Stage.Open(str(root))
    for name in ("shutter:open", "shutter:close"):
        stage.GetPrimAtPath("/World/Camera").GetAttribute(name).Set(0.0)
    stage.GetRootLayer().Save()
    reader = StageReader(root)
    assert reader.scene(reader.frames[1]).shutter is None


def test_an_authored_shutter_is_open_for_the_seconds_of_its_time_codes(tmp_path: Path) -> None:
    root = authored(tmp_path, moving(tmp_path, 0.5, times=(0.0, 10, 25, 35, 45, 55, 65)))
    stage = Usd.Stage.Open(str(root))
    camera = stage.GetPrimAtPath("/World/Camera")
    for name, code in (("shutter:open", -0.5), ("shutter:close", 0.5)):
        camera.GetAttribute(name).Set(code)
    stage.GetRootLayer().Save()
    reader = StageReader(root)
    (body,) = reader.scene(reader.frames[1]).bodies
    ends = [pose.translation[0] / 0.5 for pose in (body.poses[0], body.T_cam_body, body.poses[-1])]
    assert ends == pytest.approx([5, (5 + 17.5) / 2, 17.5], abs=1e-6)  # seconds: half of 10 s before, of 15 s after
    assert body.motion is not None  # though no pose is given then
    assert body.motion.velocity == pytest.approx([0.5, 0, 0], abs=1e-6)


def test_a_target_beside_the_camera_costs_no_pixel(tmp_path: Path) -> None:
    rows = [f"p{i},1,0,0,0,{3 + 0.5 * i!r},0,0,{i}" for i in range(6)]
    (tmp_path / "list.csv").write_text("\n".join((f"{HEADS},time", *rows)) + "\n")
    reader = StageReader(authored(tmp_path, tmp_path / "list.csv", any_size=True))
    scene = reader.scene(reader.frames[2])
    assert scene.shutter is not None
    assert scene.picture_region.empty


def test_other_rates_are_another_record(tmp_path: Path) -> None:
    root = authored(tmp_path, moving(tmp_path, 1e-4))
    render(stage=root, out=tmp_path / "set", labels_only=True)
    stage = Usd.Stage.Open(str(root))
    attribute = stage.GetPrimAtPath("/World/Target").GetAttribute(schema.MOTION_VELOCITY)
    for code in attribute.GetTimeSamples():
        attribute.Set(Gf.Vec3d(2e-4, 0, 0), code)
    stage.GetRootLayer().Save()
    render(stage=root, out=tmp_path / "set", labels_only=True)
    assert Dataset(tmp_path / "set")[2].targets[0].velocity == pytest.approx([2e-4, 0, 0])


@pytest.mark.parametrize("count", [2, 3, 4])
def test_too_few_poses_have_no_rates(tmp_path: Path, count: int) -> None:
    reader = StageReader(authored(tmp_path, moving(tmp_path, 0.5, times=range(count))))
    assert reader.scene(reader.frames[0]).bodies[0].motion is None


def test_poses_that_do_not_follow_one_another_blur_nothing(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    turns = Rotation.random(9, random_state=3).as_quat(scalar_first=True)
    rows = [
        ",".join(map(str, (f"p{i}", *q.tolist(), *rng.uniform(-1, 1, 2).tolist(), 6, i))) for i, q in enumerate(turns)
    ]
    (tmp_path / "list.csv").write_text("\n".join((f"{HEADS},time", *rows)) + "\n")
    made = author_stage(poses=tmp_path / "list.csv", target="cubesat", camera="spin", out=tmp_path / "stage")
    assert any("do not follow one another smoothly" in note for note in made.notes)
    reader = StageReader(Path(made.root))
    scene = reader.scene(reader.frames[4])
    assert (scene.shutter, scene.bodies[0].motion) == (None, None)


def test_records_say_how_fast_the_target_moves(tmp_path: Path) -> None:
    root = authored(tmp_path, moving(tmp_path, 0.5, 30.0))
    render(stage=root, out=tmp_path / "set", labels_only=True)
    target = Dataset(tmp_path / "set")[2].targets[0]
    assert target.velocity == pytest.approx([0.5, 0, 0], abs=1e-9)
    assert target.angular_velocity == pytest.approx([0, 0, np.radians(30)], abs=1e-9)


def test_rates_that_are_not_at_the_poses_are_refused(tmp_path: Path) -> None:
    root = authored(tmp_path, moving(tmp_path, 0.5))
    stage = Usd.Stage.Open(str(root))
    stage.GetPrimAtPath("/World/Target").GetAttribute(schema.MOTION_VELOCITY).Set(Gf.Vec3d(1), 0.5)
    stage.GetRootLayer().Save()
    with pytest.raises(StageError, match="not at the samples of its pose"):
        StageReader(root)


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
        ("time [min]", ("0", "1", "2"), "a time in min; give it in s, ms"),
        ("time [m]", ("0", "1", "2"), "a time in m; give it in s, ms"),
        ("utc", ("5", "6", "7"), "the time '5' in the column utc; give UTC"),
    ],
)
def test_wrong_times_are_told(tmp_path: Path, column: str, times: tuple[str, ...], says: str) -> None:
    with pytest.raises(InputError, match=says):
        authored(tmp_path, listed(tmp_path, column, *times))
    assert not (tmp_path / "stage").exists()


@pytest.mark.parametrize(
    ("times", "says"),
    [
        (("0", "5", "5"), "line 4 .* has the same time as the entry above it"),
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
