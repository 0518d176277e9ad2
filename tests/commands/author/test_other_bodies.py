"""Bodies beside the first target, as a user adds them: each in its layer, at the poses that were given."""

import json

import numpy as np
import pytest
import trimesh
from pxr import Sdf

from spin_usd import author
from spin_usd.commands.author.in_child import author_stage
from spin_usd.errors import InputError
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.read.stage_reader import StageReader

CAMERA = {"Nu": 64, "Nv": 48, "ppx": 1e-5, "ppy": 1e-5, "cameraMatrix": [[90, 0, 32], [0, 90, 24], [0, 0, 1]]}
Q = [[1, 0, 0, 0], [0.6, 0, 0.8, 0], [0, 0.6, 0, 0.8], [0.6, 0, 0, -0.8]]
ROUNDED = 1e-12  # of a pose that went through the world


def pose_list(folder, name, poses):
    """Write a pose list of (q, t)."""
    entries = [
        {"filename": f"p{i}.png", "q_vbs2tango_true": q, "r_Vo2To_vbs_true": list(t)} for i, (q, t) in enumerate(poses)
    ]
    (folder / f"{name}.json").write_text(json.dumps(entries))
    return folder / f"{name}.json"


@pytest.fixture
def inputs(tmp_path):
    """What author needs: a box, four poses of it and a camera; and an arm."""
    trimesh.creation.box((1.0, 0.8, 0.6)).export(tmp_path / "craft.stl")
    trimesh.creation.box((0.6, 0.1, 0.1)).export(tmp_path / "arm.stl")
    (tmp_path / "camera.json").write_text(json.dumps(CAMERA))
    poses = pose_list(tmp_path, "poses", [(q, (0, 0, 6 + i)) for i, q in enumerate(Q)])
    files = {"poses": poses, "camera": tmp_path / "camera.json", "target": tmp_path / "craft.stl"}
    return {**files, "out": tmp_path / "stage", "units_per_metre": 1}


def scenes(report):
    reader = StageReader(report.root)
    return [reader.scene(frame) for frame in reader.frames]


def test_a_second_target_has_the_poses_of_its_own_list(inputs, tmp_path) -> None:
    given = [(q, (1, -0.5, 5 + i)) for i, q in enumerate(reversed(Q))]
    report = author(**inputs, also=f"cubesat:{pose_list(tmp_path, 'second', given)}")
    for scene, (q, t) in zip(scenes(report), given, strict=True):
        _, second = scene.targets
        assert (second.id, second.target.name, second.target.path) == (2, "cubesat", "/World/Cubesat")
        np.testing.assert_allclose(second.T_cam_body.translation, t, atol=ROUNDED)
        np.testing.assert_allclose(second.T_cam_body.rotation, matrix_from_quaternion(q), atol=ROUNDED)
        assert second.target.keypoint_names
    assert not check_stage(report.root)
    inputs_of = Sdf.Layer.FindOrOpen(report.root).customLayerData["spin"]["inputs"]
    assert {"also_1", "also_1_poses"} <= set(inputs_of)


def test_frames_choose_the_poses_of_all_targets_alike(inputs, tmp_path) -> None:
    second = pose_list(tmp_path, "second", [(q, (0, 0, 20 + i)) for i, q in enumerate(Q)])
    found = scenes(author_stage(**inputs, also=[f"cubesat:{second}"], frames="1:4:2"))
    places = [[body.T_cam_body.translation[2] for body in scene.targets] for scene in found]
    np.testing.assert_allclose(places, [[7, 21], [9, 23]], atol=ROUNDED)


def test_a_target_without_poses_moves_with_the_first(inputs) -> None:
    for scene in scenes(author_stage(**inputs, also=["cubesat", "cubesat"])):
        first, *others = scene.targets
        assert [body.target.path for body in others] == ["/World/Cubesat", "/World/Cubesat_2"]
        for body in others:
            np.testing.assert_allclose(body.T_cam_body.matrix, first.T_cam_body.matrix, atol=ROUNDED)


def test_an_occluder_is_a_layer_below_the_camera(inputs, tmp_path) -> None:
    report = author(**inputs, occluder=[str(tmp_path / "arm.stl")])
    assert (tmp_path / "stage" / "layers" / "arm.usda").is_file()
    found = scenes(report)
    for scene in found:
        (arm,) = scene.bodies[1:]
        assert (arm.id, arm.target.path) == (0, "/World/Camera")
        box = np.sort(arm.T_cam_body.points(arm.target.mesh.box), axis=0)
        np.testing.assert_allclose(box, [(-0.3, -0.05, -0.05), (0.3, 0.05, 0.05)], atol=1e-7)
    assert not check_stage(report.root)


@pytest.mark.parametrize("count", [1, 4])
def test_an_occluder_stands_where_its_poses_say(inputs, tmp_path, count) -> None:
    given = [([0.6, 0, 0, 0.8], (0.3, -0.1, 1.5 + i)) for i in range(count)]
    arm = f"{tmp_path / 'arm.stl'}:{pose_list(tmp_path, 'arm', given)}"
    for number, scene in enumerate(scenes(author_stage(**inputs, occluder=[arm]))):
        (body,) = scene.bodies[1:]
        q, t = given[number % count]
        centre = body.T_cam_body.points(body.target.mesh.centre)
        np.testing.assert_allclose(centre, t, atol=ROUNDED)
        corner = np.array([0.3, 0.05, 0.05])
        box = body.T_cam_body.points(body.target.mesh.points)
        assert np.linalg.norm(box - (matrix_from_quaternion(q) @ corner + t), axis=1).min() < 1e-7


def test_a_list_is_as_long_as_that_of_which_frames_chooses(inputs, tmp_path) -> None:
    short = pose_list(tmp_path, "short", [(Q[0], (0, 0, 5)), (Q[1], (0, 0, 6))])
    with pytest.raises(InputError, match=r"has 2 poses for the 4 pictures that frames '1:3' chooses from"):
        author_stage(**inputs, also=[f"cubesat:{short}"], frames="1:3")


def test_poses_come_from_the_folder_of_a_data_set_too(inputs, tmp_path) -> None:
    (tmp_path / "set").mkdir()
    pose_list(tmp_path / "set", "train", [(q, (0, 0, 20 + i)) for i, q in enumerate(Q)])
    report = author_stage(**inputs, also=[f"cubesat:{tmp_path / 'set'}"])
    assert [scene.targets[1].T_cam_body.translation[2] for scene in scenes(report)] == pytest.approx([20, 21, 22, 23])


def test_what_does_not_fit_is_refused(inputs, tmp_path) -> None:
    short = pose_list(tmp_path, "short", [(Q[0], (0, 0, 5))])
    with pytest.raises(InputError, match=r"short.json: has 1 pose for 4 pictures; give a pose for each picture"):
        author_stage(**inputs, also=[f"cubesat:{short}"])
    with pytest.raises(
        InputError, match=r"nowhere.json: is not there; write MODEL, MODEL:POSES or MODEL:distance=1..5"
    ):
        author_stage(**inputs, also=["cubesat:nowhere.json"])
    with pytest.raises(InputError, match="voyager"):
        author_stage(**inputs, occluder=["voyager"])
    assert not (tmp_path / "stage").exists()


def test_the_axes_of_each_model_are_said(inputs, tmp_path) -> None:
    """Once each, and not of what travels with spin_usd."""
    own = "axes are the file's own x, y and z, and it does not state an up axis"
    arm, beside = tmp_path / "arm.stl", tmp_path / "other.stl"
    beside.write_bytes(arm.read_bytes())
    placed = f"{arm}:{pose_list(tmp_path, 'arm', [(Q[0], (0, 0, 2))])}"
    also = [str(beside), f"{beside}:{pose_list(tmp_path, 'other', [(Q[0], (0, 0, 30))] * 4)}", "cubesat"]
    notes = author_stage(**inputs, also=also, occluder=[str(arm), placed]).notes
    assert [note for note in notes if "axes are" in note] == [
        f"body {own}: poses are meant in these",
        f"other.stl: its {own}: they are the first target's, with which it moves",
        f"other.stl: its {own}: its poses are meant in these",
        f"arm.stl: its {own}: they are the camera's, x right, y down, z forward",
        f"arm.stl: its {own}: its poses are meant in these",
    ]
