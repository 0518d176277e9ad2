"""The tasks of stages/benchmarks: each can be authored, of its craft or another, with what it promises."""

from pathlib import Path

import numpy as np
import pytest

from spin_usd.basics.resources import stages
from spin_usd.commands.author.in_child import author_stage
from spin_usd.scene.light import DistantLight
from spin_usd.scene.scene import Scene
from spin_usd.stage.read.stage_reader import StageReader

TASKS = sorted((stages() / "benchmarks" / "unknown_target").glob("*.toml"))
EARTH = "tumble_earth"
SWING = 0.01  # of the camera's x about the orbit's normal, where its craft swings 0.1 m across at 10 m


def sun_of(scene: Scene) -> DistantLight:
    (sun,) = (light for light in scene.lights if isinstance(light, DistantLight) and light.path.endswith("/Sun"))
    return sun


@pytest.mark.parametrize("task", TASKS, ids=lambda task: task.stem)
def test_a_task_shows_its_craft_in_other_attitudes(task: Path, tmp_path: Path) -> None:
    report = author_stage(sample=task, count=4, target="craft:15", out=tmp_path / "out")
    reader = StageReader(report.root, check_images=False)
    scenes = [reader.scene(frame) for frame in reader.frames]
    bodies = [scene.bodies[0] for scene in scenes]
    assert {body.target.name for body in bodies} == {"craft_15"}
    turns = [body.T_cam_body.rotation @ bodies[0].T_cam_body.rotation.T for body in bodies[1:]]
    assert all(np.trace(turn) < 3 - 1e-4 for turn in turns)
    assert [bool(scene.environment.planets) for scene in scenes] == [task.stem == EARTH] * 4
    suns = np.array([sun_of(scene).direction_cam for scene in scenes])  # the camera's x is about the orbit's normal
    assert (np.ptp(suns[:, 0]) < SWING) == task.stem.startswith("tumble")
    in_body = np.array([body.T_cam_body.rotation.T @ sun for body, sun in zip(bodies, suns, strict=True)])
    spread = np.linalg.svd(in_body - in_body.mean(axis=0), compute_uv=False)
    assert spread[0] > 0.05
    assert (spread[2] < 1e-6) == (task.stem == "fly_around")  # at rest in the orbit's axes the Sun goes around a circle
    if task.stem == "still":
        away = np.array([body.T_cam_body.translation for body in bodies])
        assert ((suns * away).sum(axis=1) >= np.cos(np.radians(80)) * np.linalg.norm(away, axis=1)).all()


def test_there_are_four_tasks_and_three_have_times() -> None:
    assert [task.stem for task in TASKS] == ["fly_around", "still", "tumble", EARTH]
    assert [("step_s" in task.read_text()) for task in TASKS] == [True, False, True, True]
