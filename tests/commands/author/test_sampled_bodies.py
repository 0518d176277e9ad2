"""Bodies beside the first target whose poses are sampled: apart from one another, each from the seed and its name."""

import json
from itertools import combinations

import numpy as np
import pytest
import trimesh
from pxr import Sdf

from spin_usd.commands.author.in_child import author_stage
from spin_usd.errors import InputError
from spin_usd.geometry.framing import Framing, framings
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.stage.read.stage_reader import StageReader

CAMERA = {"Nu": 64, "Nv": 48, "ppx": 1e-5, "ppy": 1e-5, "cameraMatrix": [[90, 0, 32], [0, 90, 24], [0, 0, 1]]}
SAMPLE = "range=4..6 inside=1"
READ_BACK = 1e-9  # metres, and of a rotation's elements
CROWD = ("debris.stl:distance=0.9..1.6 count=2", "debris.stl")


@pytest.fixture(scope="module")
def given(tmp_path_factory):
    """What author needs beside poses: a box and a camera; beside these is debris, off the origin of its own axes."""
    folder = tmp_path_factory.mktemp("bodies")
    trimesh.creation.box((1.0, 0.8, 0.6)).export(folder / "craft.stl")
    debris = trimesh.creation.box((0.5, 0.2, 0.2))
    debris.apply_translation((0.3, 0.1, 0))
    debris.export(folder / "debris.stl")
    (folder / "camera.json").write_text(json.dumps(CAMERA))
    return {"target": folder / "craft.stl", "camera": folder / "camera.json", "units_per_metre": 1}


def scenes_of(report):
    reader = StageReader(report.root)
    return [reader.scene(frame) for frame in reader.frames]


def sampled(given, folder, *also, count=2, sample=SAMPLE, **options):
    """Author into the `folder`, and read, a stage with debris and the like, of which the models lie beside the box."""
    bodies = [str(given["target"].parent / each) if each.startswith("debris") else each for each in also]
    return scenes_of(author_stage(**given, sample=sample, count=count, out=folder / "stage", also=bodies, **options))


@pytest.fixture(scope="module")
def crowd(given, tmp_path_factory):
    return sampled(given, tmp_path_factory.mktemp("crowd"), *CROWD, count=30)


def poses(scenes, number):
    return np.array([scene.targets[number].T_cam_body.matrix for scene in scenes])


def test_no_two_balls_around_bodies_meet_in_any_picture_and_none_holds_the_camera(crowd) -> None:
    for scene in crowd:
        assert len(scene.targets) == 4
        balls = [(body.T_cam_body.points(body.target.mesh.centre), body.target.mesh.radius) for body in scene.bodies]
        for (middle, radius), (other, other_radius) in combinations([*balls, (np.zeros(3), 0.0)], 2):
            assert np.linalg.norm(middle - other) > radius + other_radius


def test_a_pose_is_of_the_seed_and_the_picture_alone(crowd, given, tmp_path) -> None:
    few, others = (sampled(given, tmp_path / name, *CROWD, seed=seed) for seed, name in enumerate(("few", "others")))
    for number in range(4):
        np.testing.assert_array_equal(poses(few, number), poses(crowd[:2], number))
        assert not np.isclose(poses(few, number), poses(others, number)).all((1, 2)).any()
        assert len(np.unique(poses(crowd, number).round(6), axis=0)) == len(crowd)


def test_one_more_body_changes_no_other(crowd, given, tmp_path) -> None:
    fewer = sampled(given, tmp_path, *CROWD[:1])
    for number in range(3):
        np.testing.assert_array_equal(poses(fewer, number), poses(crowd[:2], number))


def test_what_a_line_says_is_read_back(given, tmp_path) -> None:
    scenes = sampled(given, tmp_path, "debris.stl:distance=1.5 attitude=0.6,0,0.8,0 inside=0.5..1", "cubesat")
    for scene in scenes:
        first, debris, cubesat = scene.targets
        T_first, T_debris = first.T_cam_body, debris.T_cam_body
        assert np.linalg.norm(T_debris.translation - T_first.translation) == pytest.approx(1.5, abs=READ_BACK)
        np.testing.assert_allclose(T_debris.rotation, matrix_from_quaternion([0.6, 0, 0.8, 0]), atol=READ_BACK)
        assert 4 <= np.linalg.norm(cubesat.T_cam_body.translation) <= 6  # as the target's own
        hull, T = cubesat.target.mesh.hull, cubesat.T_cam_body
        assert framings(scene.camera, hull, T.rotation[None], T.translation[None]) == [Framing.WHOLE]


def test_copies_share_a_model_and_have_names_of_their_own(given, tmp_path) -> None:
    (scene, *_) = sampled(given, tmp_path, "debris.stl:distance=2..4 count=2", "debris.stl")
    assert [body.target.name for body in scene.targets] == ["craft", "debris", "debris_2", "debris_3"]
    files = (tmp_path / "stage" / "targets").rglob("geometry.usdc")
    assert sorted(each.parent.name for each in files) == ["craft", "debris"]
    options = Sdf.Layer.FindOrOpen(str(tmp_path / "stage" / "dataset.usda")).customLayerData["spin"]["options"]
    assert options["also_1_poses"] == "distance=2..4 count=2"


def test_an_attached_body_moves_with_the_first_target(given, tmp_path) -> None:
    scenes = sampled(given, tmp_path, "cubesat:attached")
    np.testing.assert_allclose(poses(scenes, 1), poses(scenes, 0), atol=READ_BACK)


def test_bodies_are_sampled_about_the_poses_of_a_list_too(given, tmp_path) -> None:
    entries = [
        {"filename": f"p{i}.png", "q_vbs2tango_true": [1, 0, 0, 0], "r_Vo2To_vbs_true": [0, 0, 5 + i]} for i in (0, 1)
    ]
    (tmp_path / "poses.json").write_text(json.dumps(entries))
    given = {**given, "poses": tmp_path / "poses.json"}
    for scene in scenes_of(author_stage(**given, out=tmp_path / "listed", also=["cubesat:distance=2"])):
        first, second = scene.targets
        between = second.T_cam_body.translation - first.T_cam_body.translation
        assert np.linalg.norm(between) == pytest.approx(2, abs=READ_BACK)
    with pytest.raises(InputError, match=r"attitude=uniform: has no distance of the body; add distance=1"):
        author_stage(**given, out=tmp_path / "far", also=["cubesat:attitude=uniform"])


@pytest.mark.parametrize(
    ("also", "sample", "message"),
    [
        ("debris.stl:distance=0.2", SAMPLE, r"debris, picture img000001: none of \d+ poses keeps apart from the other"),
        (
            "debris.stl",
            "fly_around",
            "debris: poses along a trajectory are sampled for the target alone; give it a pose",
        ),
        ("debris.stl:distance=1 range=2", SAMPLE, "sample 'range': is given beside distance; keep one of them"),
        ("debris.stl:near=1", SAMPLE, "sample 'near': does not state where a body is; use count, distance, range"),
        ("debris.stl:count=0", SAMPLE, "sample 'count': 0 is not from 1 to 100"),
        ("debris.stl:nowhere", SAMPLE, "nowhere: is not there; write MODEL, MODEL:POSES or MODEL:distance=1..5"),
    ],
)
def test_what_cannot_be_is_refused(given, tmp_path, also, sample, message) -> None:
    with pytest.raises(InputError, match=message):
        sampled(given, tmp_path, also, sample=sample, count=2)
    assert not [*tmp_path.iterdir()]
