"""The tasks of stages/benchmarks: each can be authored, of its craft or another, with what it promises."""

from pathlib import Path

import numpy as np
import pytest
from pxr import UsdLux

from spin_usd.basics.resources import stages
from spin_usd.commands.author.in_child import author_stage
from spin_usd.stage.read.stage_reader import StageReader

TASKS = sorted((stages() / "benchmarks" / "unknown_target").glob("*.toml"))
EARTH = "tumble_earth"


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
    towards = np.array([next(light.direction_cam for light in scene.lights) for scene in scenes])
    in_body = np.array([body.T_cam_body.rotation.T @ sun for body, sun in zip(bodies, towards, strict=True)])
    assert np.ptp(in_body, axis=0).max() > 0.05 or task.stem == "fly_around"
    assert reader.stage.GetPrimAtPath("/World/Lights").IsValid()
    assert any(prim.IsA(UsdLux.DistantLight) for prim in reader.stage.Traverse())


def test_there_are_four_tasks_and_three_have_times() -> None:
    assert [task.stem for task in TASKS] == ["fly_around", "still", "tumble", EARTH]
    assert [("step_s" in task.read_text()) for task in TASKS] == [True, False, True, True]
