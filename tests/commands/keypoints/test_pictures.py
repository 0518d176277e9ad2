"""Keypoints in given pictures: they are where the labels have them, and hidden where those say so."""

import base64
import json
from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
import trimesh
from PIL import Image

from spin_usd.commands.keypoints.options import KeypointsOptions
from spin_usd.commands.keypoints.pictures import Pictures
from spin_usd.commands.keypoints.run import open_session
from spin_usd.errors import InputError
from spin_usd.processes.executor import Executor
from spin_usd.reading.dataset import Dataset

CAMERA = {
    "Nu": 96,
    "Nv": 72,
    "ppx": 1e-5,
    "ppy": 1e-5,
    "cameraMatrix": [[120, 0, 48], [0, 120, 36], [0, 0, 1]],
    "distCoeffs": [-0.2, 0.1, 0.001, -0.002, 0],
}
POSES = [
    {"filename": f"p{i}.png", "q_vbs2tango_true": q, "r_Vo2To_vbs_true": [0.1 * i, 0, 4 - i]}
    for i, q in enumerate([[1, 0, 0, 0], [0.6, 0, 0.8, 0], [0.5, 0.5, -0.5, 0.5]])
]
PIXEL = 1e-9


@pytest.fixture(scope="module")
def folder(tmp_path_factory, spin_usd):
    """A dataset of a box whose keypoints are its corners, picked as suggestions."""
    folder = tmp_path_factory.mktemp("pictures")
    trimesh.creation.box((1, 0.6, 0.4)).export(folder / "craft.glb")
    for name, content in (("poses", POSES), ("camera", CAMERA)):
        (folder / f"{name}.json").write_text(json.dumps(content))
    points = [
        [name, *place] for name, place in zip("abc", [(0.5, 0.3, 0.2), (-0.5, 0.3, -0.2), (9, 0, 0)], strict=True)
    ]
    (folder / "points.csv").write_text("\n".join(["name,x,y,z", *(",".join(map(str, row)) for row in points)]))
    files = [f"--{name}={folder / file}" for name, file in (("poses", "poses.json"), ("camera", "camera.json"))]
    own = ["--target", folder / "craft.glb", "--keypoints", folder / "points.csv", "--out", folder / "stage"]
    spin_usd("author", *files, *own)
    spin_usd("render", folder / "stage", "--out", folder / "made", "--renderer", "raycast", "--samples", "1")
    return folder


@pytest.fixture(scope="module")
def child():
    with Executor[None]() as child:
        yield child


@pytest.fixture(scope="module")
def target(folder, child):
    request = KeypointsOptions(target=str(folder / "craft.glb"), out=folder / "points.usda")
    return open_session(request, child, lambda line: None).target


@pytest.fixture(scope="module")
def pictures(folder, target, child):
    return Pictures(folder / "made", target, child)


def test_they_are_where_the_labels_have_them(folder, pictures) -> None:
    for number, picture in enumerate(Dataset(folder / "made")):
        pixels, states = pictures.places(number, picture.keypoints)
        assert pixels == pytest.approx(picture.targets[0].keypoints, abs=PIXEL, nan_ok=True)
        assert tuple(states) == picture.targets[0].keypoint_states
    assert {"visible", "self-occluded"} <= {
        state for p in Dataset(folder / "made") for state in p.targets[0].keypoint_states
    }


def test_the_part_around_the_target_is_shown(folder, pictures) -> None:
    for number, picture in enumerate(Dataset(folder / "made")):
        tile = pictures.tile(number)
        shown = np.asarray(Image.open(BytesIO(base64.b64decode(tile.jpeg))))
        assert shown.shape[:2] == tile.region.shape
        outside = picture.depth > 0
        outside[tile.region.slices] = False
        assert not outside.any()
        assert np.abs(shown[..., 0].astype(int) - picture.image[tile.region.slices]).mean() < 2


def test_another_target_is_noted_and_a_folder_without_pictures_refused(folder, pictures, target, tmp_path) -> None:
    assert pictures.note is None
    other = Pictures(folder / "made", replace(target, body=replace(target.body, name="other")), Executor[None]())
    assert other.note is not None
    assert "shows craft" in other.note
    with pytest.raises(InputError):
        Pictures(tmp_path, target, Executor[None]())
