"""The log of a simulator goes on with what it began with, and nothing that was logged is lost or changed."""

import os
import shutil
import time

import numpy as np
import psutil
import pytest
from pxr import Usd

from spin_usd import Dataset, Simulator, SpinError
from spin_usd.stage.augment.logged_stage import REQUESTS, SAVE_S

HOW = {"renderer": "raycast", "samples": 1}


@pytest.fixture(scope="module")
def part(small_stage):
    with Simulator(small_stage, **HOW) as simulator:
        picture = simulator.picture(0)
        return next(part.name for part in picture.parts.values() if (picture.segmentation == part.id).sum() > 100)


def made_again(log, spin_usd, folder):
    spin_usd("render", log, "--out", folder, "--renderer", "raycast", "--samples", "1", "--labels", "none")
    return {picture.frame: picture.image for picture in Dataset(folder)}


@pytest.mark.children  # a log's lock is a process's
def test_it_goes_on_with_its_own_seed_and_parts(small_stage, part, spin_usd, tmp_path) -> None:
    moved, images = np.eye(4), {}
    moved[2, 3] = 0.1
    with Simulator(small_stage, log=tmp_path / "log", log_parts=[part], seed=7, **HOW) as simulator:
        for place in range(2):
            picture = simulator.picture(place, parts={part: moved})
            images[picture.frame] = picture.image
    with pytest.raises(SpinError, match="is a log of the seed 7"):
        Simulator(small_stage, log=tmp_path / "log", seed=5, **HOW)
    with Simulator(small_stage, log=tmp_path / "log", **HOW) as simulator:
        assert simulator.seed == 7
        picture = simulator.picture(2, exposure=0.02, parts={part: moved})
        images[picture.frame] = picture.image
    again = made_again(tmp_path / "log", spin_usd, tmp_path / "dataset")
    assert again.keys() == images.keys()
    for name, image in images.items():
        np.testing.assert_array_equal(again[name], image)


@pytest.mark.children  # as above
def test_a_pose_has_no_time_of_a_frame_in_a_stage_with_times(spin_usd, tmp_path) -> None:
    lines = "a,1,0,0,0,0,0,5,0", "b,1,0,0,0,0,0,5,1", "c,1,0,0,0,0,0,5,3"
    (tmp_path / "poses.csv").write_text("\n".join(("name,qw,qx,qy,qz,x,y,z,time", *lines)))
    spin_usd("author", "--poses", tmp_path / "poses.csv", "--target", "cubesat", "--camera", "speedplus",
             "--resolution", 64, "--out", tmp_path / "stage")  # fmt: skip
    with Simulator(tmp_path / "stage", log=tmp_path / "log", **HOW) as simulator:
        made = [simulator.picture(pose=((1, 0, 0, 0), (0, 0, away))) for away in (4, 5)]
        with pytest.raises(SpinError, match="the pictures before have no times; give `time` with each request"):
            simulator.picture(1)
        assert [each.time_s for each in made] == [None, None]
    with Simulator(tmp_path / "stage", log=tmp_path / "log", **HOW) as simulator:  # whose targets have rates
        assert simulator.picture(pose=((1, 0, 0, 0), (0, 0, 6))).time_s is None
    spin_usd("render", tmp_path / "log", "--out", tmp_path / "dataset", "--renderer", "raycast", "--samples", 1)
    assert [each.time_s for each in Dataset(tmp_path / "dataset")] == [None] * 3
    with Simulator(tmp_path / "stage", log=tmp_path / "timed", **HOW) as simulator:
        assert simulator.picture(1).time_s == 1
        with pytest.raises(SpinError, match="it has no time, and the pictures before have; give `time`"):
            simulator.picture(pose=((1, 0, 0, 0), (0, 0, 4)))
        assert simulator.picture(pose=((1, 0, 0, 0), (0, 0, 4)), time=2).time_s == 2


def test_names_that_are_taken_are_refused_and_the_log_goes_on(small_stage, spin_usd, tmp_path) -> None:
    with Simulator(small_stage, log=tmp_path / "log", **HOW) as simulator:
        simulator.picture(0, name="mine")
        with pytest.raises(SpinError, match="is called 'Mine' already"):
            simulator.picture(0, name="Mine")
        with pytest.raises(SpinError, match="more than"):
            simulator.picture(name="far", pose=((1, 0, 0, 0), (0, 0, 1e99)))
        simulator.picture(0, name="far", exposure=0.05, values={"optics.psf_sigma": 1.0})
        with pytest.raises(SpinError, match="a log has one variant and one seed"):
            simulator.picture(0, seed=1)
    assert list(made_again(tmp_path / "log", spin_usd, tmp_path / "dataset")) == ["far", "mine"]


def test_a_time_that_cannot_be_shown_can_be_asked_for_again(small_stage, tmp_path) -> None:
    with Simulator(small_stage, log=tmp_path / "log", **HOW) as simulator:
        simulator.picture(time=0.5)
        with pytest.raises(SpinError, match="more than"):
            simulator.picture(time=1.0, pose=((1, 0, 0, 0), (0, 0, 1e99)))
        assert simulator.picture(time=1.0).index == 1
        with pytest.raises(SpinError, match="is not after 1 s, the time of the picture before"):
            simulator.picture(time=1.0)


@pytest.mark.children
def test_a_death_between_saving_and_answering_logs_nothing_twice(small_stage, spin_usd, tmp_path) -> None:
    log, others = tmp_path / "log", set(psutil.Process().children())
    with Simulator(small_stage, log=log, **HOW) as simulator:
        first = [simulator.picture(place) for place in range(2)]
        before = os.stat(log / REQUESTS).st_mtime_ns
        (child,) = set(psutil.Process().children()) - others
        time.sleep(SAVE_S)
        task = simulator.workers.ask(simulator.request(2), simulator.kinds)
        simulator.workers.step(within_s=0)  # it is sent, and its answer is not heard
        while os.stat(log / REQUESTS).st_mtime_ns == before:
            pass
        child.kill()
        made = simulator.workers.result(task)
        assert task.logged == 2
        last = simulator.picture(3)
        assert last.index == 3
        images = {each.frame: each.image for each in (*first, last)} | {made.frame: task.arrays["image"]}
    again = made_again(log, spin_usd, tmp_path / "dataset")
    assert again.keys() == images.keys()
    for name, image in images.items():
        np.testing.assert_array_equal(again[name], image)


@pytest.mark.children
def test_a_log_loses_nothing_where_its_worker_dies_before_it_is_saved(small_stage, tmp_path) -> None:
    log, others = tmp_path / "log", set(psutil.Process().children())
    with Simulator(small_stage, log=log, **HOW) as simulator:
        for place in range(2):
            simulator.picture(place)
        (child,) = set(psutil.Process().children()) - others
        child.kill()
    with Simulator(small_stage, log=log, **HOW) as simulator:
        assert simulator.workers.opened.logged == 2


def test_what_the_first_picture_changes_is_changed_in_the_next_too(small_stage, spin_usd, tmp_path) -> None:
    images = {}
    with Simulator(small_stage, log=tmp_path / "log", **HOW) as simulator:
        for place in range(3):
            values = {"sun.factor": 0.5 + place, "optics.psf_sigma": 0.3 + 0.3 * place}
            picture = simulator.picture(0, name=f"p{place}", sun=(0.1 * place, 0, -1), exposure=0.02, values=values)
            images[picture.frame] = picture.image
    assert images["p0"].mean() < images["p1"].mean() < images["p2"].mean()
    again = made_again(tmp_path / "log", spin_usd, tmp_path / "dataset")
    for name, image in images.items():
        np.testing.assert_array_equal(again[name], image)


def test_a_request_that_is_refused_changes_no_picture_before(small_tango_stage, spin_usd, tmp_path) -> None:
    with Simulator(small_tango_stage, log=tmp_path / "log", **HOW) as simulator:
        first = simulator.picture(1)
        for values in ({"material.*.roughness": 0.1}, {"sun.temperature": 4000.0}):
            with pytest.raises(SpinError, match="cannot be changed in a log"):
                simulator.picture(0, lights={"Sun": 3.0}, exposure=0.03, values={"sun.angle": 3.0, **values})
        second = simulator.picture(2, lights={"Sun": 2.0})
    again = made_again(tmp_path / "log", spin_usd, tmp_path / "dataset")
    for picture in (first, second):
        np.testing.assert_array_equal(again[picture.frame], picture.image)
    assert "xform-unread" not in spin_usd("check", tmp_path / "log").stdout


def test_a_stage_whose_target_moves_is_posed_and_logged(spin_usd, tmp_path) -> None:
    spin_usd("author", "--scenario", "inspection", "--target", "tango", "--camera", "speedplus", "--frames", "0:3",
             "--resolution", "96", "--out", tmp_path / "stage")  # fmt: skip
    stage = Usd.Stage.Open(str(tmp_path / "stage" / "dataset.usda"))
    assert "SpinMotionAPI" in stage.GetPrimAtPath("/World/Target").GetAppliedSchemas()
    pose = ((1, 0, 0, 0), (0, 0, 5))
    with Simulator(tmp_path / "stage", **HOW) as simulator:
        free = simulator.picture(1, pose=pose, name="free").image
        assert free.any()
    with Simulator(tmp_path / "stage", log=tmp_path / "log", **HOW) as simulator:
        images = {each.frame: each.image for each in (simulator.picture(1), simulator.picture(2, pose=pose, name="p"))}
    again = made_again(tmp_path / "log", spin_usd, tmp_path / "dataset")
    for name, image in images.items():
        np.testing.assert_array_equal(again[name], image)


@pytest.mark.children  # a log's lock is a process's
def test_one_simulator_at_a_time_has_it(small_stage, tmp_path) -> None:
    with Simulator(small_stage, log=tmp_path / "log", **HOW) as simulator:
        simulator.picture(0)
        with pytest.raises(SpinError, match="is the log of another simulator now"):
            Simulator(small_stage, log=tmp_path / "log", **HOW)
    with Simulator(small_stage, log=tmp_path / "log", **HOW) as simulator:
        assert simulator.picture(0).frame == "request_000001"


def test_what_is_no_log_of_the_stage_is_refused(small_stage, cubesat_stage, tmp_path) -> None:
    with Simulator(small_stage, log=tmp_path / "log", **HOW):
        pass
    with pytest.raises(SpinError, match="is a log of another stage"):
        Simulator(cubesat_stage, log=tmp_path / "log", **HOW)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "notes.txt").touch()
    with pytest.raises(SpinError, match="is not empty, and contains no log"):
        Simulator(small_stage, log=tmp_path / "full", **HOW)
    stage = shutil.copytree(small_stage.parent, tmp_path / "stage")
    with pytest.raises(SpinError, match="contains a stage, and no log"):
        Simulator(stage, log=stage, **HOW)
    with pytest.raises(SpinError, match="log_parts are given without a log"):
        Simulator(small_stage, log_parts=["x"], **HOW)
