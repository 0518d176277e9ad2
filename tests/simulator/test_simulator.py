"""`Simulator`: the pictures of `render`, in memory; and others, that are what a stage authored so would show."""

import pickle
import subprocess
import sys

import numpy as np
import psutil
import pytest

from spin_usd import Dataset, Simulator, SpinError

KINDS = ("image", "radiance", "depth", "segmentation", "dense_pose")
LIT = (0.3, -0.5, -0.8)  # to the Sun, camera axes


@pytest.fixture(scope="module")
def simulator(small_stage):
    with Simulator(small_stage, renderer="raycast", labels="default") as found:
        yield found


@pytest.mark.children
def test_frames_are_those_of_render(small_stage, rendered) -> None:
    with Simulator(small_stage, renderer="raycast", labels="default") as simulator:
        for stored, made in zip(Dataset(rendered), simulator.pictures(range(3)), strict=True):
            for kind in KINDS:
                np.testing.assert_array_equal(made.label(kind), stored.label(kind), kind)
            for name in ("targets", "camera", "pose", "appearance", "tones", "sun"):
                assert made.record[name] == stored.record[name], name
            assert made.record["provenance"]["keys"] == stored.record["provenance"]["keys"]
            assert (made.frame, made.variant, made.index) == (stored.frame, stored.variant, stored.index)
            np.testing.assert_array_equal(made.T_cam_body, stored.T_cam_body)
            np.testing.assert_array_equal(made.crop(size=64).image, stored.crop(size=64).image)
            np.testing.assert_array_equal(made.mask(1), stored.mask(1))


@pytest.fixture(scope="module")
def by_blender(small_stage, spin_usd, tmp_path_factory):
    """Two frames that Blender made in this process: as all that is shared, before a test asks for children."""
    out = tmp_path_factory.mktemp("blender") / "dataset"
    spin_usd("render", small_stage, "--out", out, "--frames", "0:2", "--samples", "2", "--labels", "none")
    return Dataset(out)


@pytest.mark.children
def test_frames_are_those_of_blender_too(small_stage, by_blender) -> None:
    with Simulator(small_stage, samples=2) as simulator:
        for stored, made in zip(by_blender, simulator.pictures(simulator.frames[:2]), strict=True):
            np.testing.assert_array_equal(made.image, stored.image)


def test_equal_requests_give_equal_pictures_whatever_came_before(simulator) -> None:
    pose = simulator.picture(0).T_cam_body.copy()
    pose[:3, 3] *= 1.1

    def asked():
        return simulator.picture(1, pose=pose, sun=LIT, exposure=0.02, lights={"Sun": 0.5}, seed=3)

    first = asked()
    simulator.picture(2, pose=simulator.picture(2).T_cam_body, sun=(0, -1, -1), exposure=0.1, lights={"Sun": 2.0})
    simulator.picture(values={"sensor.read_noise": 50.0})
    again = asked()
    for kind in KINDS:
        np.testing.assert_array_equal(again.label(kind), first.label(kind), kind)
    assert again.record == first.record
    np.testing.assert_allclose(first.T_cam_body, pose, atol=1e-15)


def test_what_is_edited_is_as_if_it_were_authored(small_stage, spin_usd, tmp_path) -> None:
    """By an augmentation with the same values. Radiance has no noise of a detector, which every variant has its own."""
    spec = tmp_path / "spec.toml"
    spec.write_text(f"""schema = "augment-1"
[[augmentation]]
name = "edited"
[augmentation.sample]
"sun.direction" = {{ distribution = "fixed", value = {list(LIT)} }}
"sun.factor" = {{ distribution = "fixed", value = 0.25 }}
"exposure.time" = {{ distribution = "fixed", value = 0.01, unit = "s" }}
"material.*.roughness" = {{ distribution = "fixed", value = 0.9 }}
""")
    stage = small_stage.with_name("edited.usda")
    if not stage.exists():
        spin_usd("augment", small_stage, "--spec", spec, "--out", stage)
    spin_usd("render", stage, "--out", tmp_path / "dataset", "--renderer", "raycast", "--variants", "edited",
             "--frames", "0:2", "--radiance")  # fmt: skip
    values = {"sun.factor": 0.25, "material.*.roughness": 0.9}
    with Simulator(small_stage, renderer="raycast") as simulator:
        for stored in Dataset(tmp_path / "dataset"):
            made = simulator.picture(stored.frame, sun=LIT, exposure=0.01, values=values)
            np.testing.assert_array_equal(made.label("radiance"), stored.label("radiance"))
            assert made.record["appearance"] == stored.record["appearance"]


def test_a_pose_is_shown_as_the_frame_of_that_pose(simulator) -> None:
    for number in range(3):
        frame = simulator.picture(number)
        posed = simulator.picture(pose=(frame.q_cam_body, frame.t_cam_body), name=frame.frame)
        np.testing.assert_allclose(posed.depth, frame.depth, rtol=1e-5)
        np.testing.assert_array_equal(posed.segmentation, frame.segmentation)
        assert (posed.image != frame.image).mean() < 0.01  # rounding, at the edges of full numbers


def test_part_moves_in_the_axes_of_its_target(simulator) -> None:
    frame = simulator.picture(0)
    part = next(part for part in frame.parts.values() if (frame.segmentation == part.id).sum() > 100)
    still = simulator.picture(0, parts={part.name: np.eye(4)})
    np.testing.assert_array_equal(still.segmentation, frame.segmentation)
    away = np.eye(4)
    away[:3, 3] = frame.T_cam_body[:3, :3].T @ (0, 0, -0.5)  # towards the camera
    moved = simulator.picture(0, parts={part.name: away})
    both = (moved.segmentation == part.id) & (frame.segmentation == part.id)
    assert both.sum() > 20
    np.testing.assert_allclose(moved.dense_pose[both] @ frame.T_cam_body[2, :3] + frame.T_cam_body[2, 3],
                               moved.depth[both], rtol=1e-5)  # fmt: skip
    assert moved.depth[both].max() < frame.depth[both].max() - 0.3
    assert (simulator.picture(0).segmentation == frame.segmentation).all()


@pytest.mark.children
def test_workers_give_the_same_pictures_in_order_also_where_they_are_killed(small_stage) -> None:
    with Simulator(small_stage, renderer="raycast", workers=2) as simulator:
        requests = [{"frame": number % 8, "exposure": 0.01 * (1 + number)} for number in range(12)]
        whole = [picture.image for picture in simulator.pictures(requests)]
        found = []
        for number, picture in enumerate(simulator.pictures(requests)):
            found.append(picture.image)
            if number in (2, 7):
                for child in psutil.Process().children():
                    child.kill()
        np.testing.assert_array_equal(found, whole)
        assert len({image.tobytes() for image in whole}) == len(whole)


def test_pictures_that_nobody_takes_disturb_nothing(simulator) -> None:
    wanted = simulator.picture(5).image
    for _ in simulator.pictures(range(8)):
        break
    np.testing.assert_array_equal(simulator.picture(5).image, wanted)
    assert not simulator.workers._waiting.tasks
    assert not simulator.workers._waiting


def test_a_pickled_picture_has_what_it_had(simulator) -> None:
    picture = simulator.picture(0)
    other = pickle.loads(pickle.dumps(picture))
    np.testing.assert_array_equal(other.image, picture.image)
    np.testing.assert_array_equal(other.targets[0].box_visible, picture.targets[0].box_visible)
    with pytest.raises(SpinError, match="has no normals_cam"):
        other.label("normals_cam")


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"frame": "img9"}, "has no frame 'img9'"),
        ({"frame": 0, "variant": "rich"}, "has no variant 'rich'"),
        ({"pose": np.diag([1.0, 1, -1, 1])}, "the pose of the target is not a pose"),
        ({"pose": np.eye(3)}, "the pose of the target is not a pose"),
        ({"pose": {"soyuz": np.eye(4)}}, "there is no target 'soyuz'"),
        ({"parts": {"wing": np.eye(4)}}, "there is no part 'wing' that can be moved"),
        ({"lights": {"moon": 2}}, "there is no light 'moon'"),
        ({"values": {"sun.colour": 2}}, "is not a parameter"),
        ({"values": {"sensor.gain": "high"}}, "does not take 'high'"),
        ({"exposure": -1.0}, "could be -1 s"),
        ({"sun": (0, 0, 0)}, "does not take"),
        ({"frame": 0, "time": 1.0}, "a frame and a time are both given"),
        ({"name": "a/b"}, "cannot name a picture"),
        ({"name": 5}, "5 is not a name"),
        ({"seed": 1.5}, "the seed is 1.5"),
        ({"seed": True}, "the seed is True"),
        ({"time": float("nan")}, "the time is nan"),
        ({"exposure": np.array([0.1])}, "the exposure is array"),
        ({"exposure": "0.1"}, "the exposure is '0.1'"),
        ({"sun": (float("nan"), 0, 0)}, "is nan"),
        ({"sun": (0, 0, -1e-200)}, "does not take"),
        ({"lights": {"Sun": True}}, "the factor of Sun is True"),
        ({"lights": {"Sun": -1}}, "the factor of Sun is -1; give 0 or more"),
        ({"lights": ["Sun"]}, "lights are"),
        ({"values": {"sensor.read_noise": object()}}, "sensor.read_noise is <object"),
        ({"values": {"sensor.read_noise": [3]}}, "sensor.read_noise"),
        ({"pose": np.full((4, 4), np.nan)}, "its last row is nan"),
        ({"pose": ((1, 0, 0, 0), (0, 0, 1e99))}, "more than"),
    ],
)
def test_what_cannot_be_shown_is_said_and_the_next_picture_is_made(simulator, asked, said) -> None:
    with pytest.raises(SpinError, match=said):
        simulator.picture(**asked)
    assert simulator.picture(0).image.any()


def test_options_are_those_of_render(small_stage) -> None:
    with pytest.raises(SpinError, match="there is no label 'x'"):
        Simulator(small_stage, labels="x")
    with pytest.raises(SpinError, match="there cannot be 0 workers"):
        Simulator(small_stage, workers=0)
    with pytest.raises(SpinError, match="does not exist"):
        Simulator(small_stage.parent / "none")


@pytest.mark.children
def test_neither_usd_nor_blender_is_loaded_into_the_callers_process(small_stage) -> None:
    code = (
        "import sys, spin_usd\n"
        f"with spin_usd.Simulator({str(small_stage)!r}, renderer='raycast') as s: s.picture(0).targets\n"
        "print({'pxr', 'bpy', 'embreex'} & {*sys.modules})"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


@pytest.mark.children
def test_times_between_frames_are_the_stages(spin_usd, tmp_path) -> None:
    """A constant velocity: the place at a time between two pictures is on the line between theirs."""
    rows = ["name,qw,qx,qy,qz,x,y,z,time"] + [f"p{i},1,0,0,0,{0.1 * i},0,{5 - 0.2 * i},{2 * i}" for i in range(4)]
    (tmp_path / "poses.csv").write_text("\n".join(rows))
    spin_usd("author", "--poses", tmp_path / "poses.csv", "--target", "cubesat", "--camera", "speedplus",
             "--resolution", "96", "--out", tmp_path / "stage")  # fmt: skip
    with Simulator(tmp_path / "stage", renderer="raycast") as simulator:
        np.testing.assert_allclose(simulator.picture(time=3.0).t_cam_body, (0.15, 0, 4.7), atol=1e-9)
        assert simulator.picture(time=3.0).time_s == 3.0
        with pytest.raises(SpinError, match=r"has no time 6.5 s: its pictures are from 0 to 6 s; give a time between"):
            simulator.picture(time=6.5)
        np.testing.assert_array_equal(simulator.picture(time=4.0).T_cam_body, simulator.picture(2).T_cam_body)


def test_a_request_is_a_picture_again(simulator) -> None:
    picture = simulator.picture(2, exposure=0.03, seed=np.int64(4))
    for again in (simulator.picture(picture.request), *simulator.pictures([picture.request])):
        np.testing.assert_array_equal(again.image, picture.image)
    with pytest.raises(SpinError, match="is one request"):
        next(simulator.pictures({"frame": 0}))


def test_a_closed_simulator_says_so(small_stage) -> None:
    with Simulator(small_stage, renderer="raycast", samples=1) as simulator:
        picture = simulator.picture(0)
    for asked in (lambda: simulator.picture(0), lambda: picture.depth):
        with pytest.raises(SpinError, match="the simulator is closed"):
            asked()


@pytest.mark.children
def test_another_process_is_told_to_open_its_own(small_stage) -> None:
    code = (
        "import os, spin_usd\n"
        f"with spin_usd.Simulator({str(small_stage)!r}, renderer='raycast', samples=1) as s:\n"
        "    first = s.picture(0).image\n"
        "    if not os.fork():\n"
        "        try: s.picture(1)\n"
        "        except spin_usd.SpinError as error: print(error, flush=True)\n"
        "        os._exit(0)\n"
        "    os.wait()\n"
        "    assert (s.picture(0).image == first).all()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "belongs to another process" in done.stdout
