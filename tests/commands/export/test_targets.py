"""Of several targets a format of one holds the first, or the one that is asked for: its poses, its masks, its boxes."""

import csv
import json
import shutil

import numpy as np
import pytest
import trimesh
from PIL import Image

from spin_usd import Dataset
from spin_usd.errors import InputError
from spin_usd.exchange.events import EVENT_FORMATS
from spin_usd.exchange.read_pose_list import read_pose_list
from spin_usd.exchange.table import EXPORT_FORMATS
from tests.exchange.conftest import write_export

CAMERA = {"Nu": 96, "Nv": 72, "ppx": 1e-5, "ppy": 1e-5, "cameraMatrix": [[130, 0, 48], [0, 130, 36], [0, 0, 1]]}
OUT = (9, 0, 6)  # metres: beside the frame
PLACES: dict[str, list[tuple[float, float, float]]] = {"craft": [(0, 0, 6), (0, 0.1, 6)], "debris": [(0.4, 0, 5), OUT]}


@pytest.fixture(scope="module")
def two(tmp_path_factory, spin_usd):
    """A box, and a smaller one before it, which the second picture does not show."""
    folder = tmp_path_factory.mktemp("two_targets")
    (folder / "camera.json").write_text(json.dumps(CAMERA))
    for name, places in PLACES.items():
        trimesh.creation.box((1, 0.8, 0.6) if name == "craft" else (0.4, 0.4, 0.4)).export(folder / f"{name}.stl")
        entries = [
            {"filename": f"p{i}.png", "q_vbs2tango_true": [0.8, 0.36, 0.48, 0], "r_Vo2To_vbs_true": list(place)}
            for i, place in enumerate(places)
        ]
        (folder / f"{name}.json").write_text(json.dumps(entries))
    models = ("--target", folder / "craft.stl", "--also", f"{folder / 'debris.stl'}:{folder / 'debris.json'}")
    chosen = ("--poses", folder / "craft.json", *models, "--camera", folder / "camera.json", "--units-per-metre", 1)
    spin_usd("author", *chosen, "--out", folder / "stage")
    spin_usd("render", folder / "stage", "--out", folder / "dataset", "--renderer", "raycast", "--samples", 1)
    return folder / "dataset"


@pytest.mark.parametrize("target", PLACES)
def test_poses_and_masks_are_of_the_target_asked_for(two, tmp_path, target) -> None:
    write_export(two, "speedplus", tmp_path / "out", target=target)
    entries = json.loads((tmp_path / "out" / "synthetic" / "train.json").read_text())
    assert np.allclose([entry["r_Vo2To_vbs_true"] for entry in entries], PLACES[target], atol=1e-9)
    for picture in Dataset(two):
        mask = np.asarray(Image.open(tmp_path / "out" / "synthetic" / "masks" / f"{picture.frame}.png"))
        number = {each.name: each.id for each in picture.targets}[target]
        assert np.array_equal(mask > 0, picture.label("instance") == number)


def test_the_first_is_taken_if_none_is_named(two, tmp_path) -> None:
    write_export(two, "speedplus", tmp_path / "out")
    assert json.loads((tmp_path / "out" / "export.json").read_text())["target"] == "craft"
    with pytest.raises(InputError, match="has no target 'moon'; choose among craft, debris"):
        write_export(two, "speedplus", tmp_path / "other", target="moon")


def test_pictures_without_the_target_have_no_box(two, tmp_path) -> None:
    report = write_export(
        two, "spark", tmp_path / "out", target="debris", options={"layout": "2022-stream1", "depth": "none"}
    )
    assert (report.pictures, report.left_out) == (1, 1)
    with (tmp_path / "out" / "train.csv").open() as file:
        (row,) = csv.DictReader(file)
    x0, y0, x1, y1 = Dataset(two).picture("p0").targets[1].box_visible.astype(int).tolist()
    assert row == {"filename": "p0.png", "class": "debris", "bbox": f"[{y0}, {x0}, {y1}, {x1}]"}


def test_a_record_without_the_target_is_one_sentence(two, tmp_path) -> None:
    """A record that names another target than dataset.json ended in a traceback."""
    dataset = shutil.copytree(two, tmp_path / "dataset")
    path = dataset / "records" / "nominal" / "p1.json"
    path.write_text(path.read_text().replace('"craft"', '"stranger"'))
    with pytest.raises(InputError, match=r"records/nominal/p1\.json: has the targets 1 'stranger', 2 'debris', and"):
        write_export(dataset, "speedplus", tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_every_format_reads_targets_that_a_variant_lists_first(two, tmp_path, spin_usd) -> None:
    """The least case of ids that swapped between variants, exported: the same poses for both variants, by name."""
    stage = shutil.copytree(two.parent / "stage", tmp_path / "stage")
    spec = '[[augmentation]]\nname = "worn"\n[augmentation.sample]\n"material.*.roughness" = '
    (tmp_path / "spec.toml").write_text(
        f'schema = "augment-1"\n{spec}{{ distribution = "uniform", low = 0.1, high = 0.9 }}\n'
    )
    spin_usd("augment", stage, "--spec", tmp_path / "spec.toml")
    out = tmp_path / "dataset"
    spin_usd(
        "render", stage, "--out", out, "--renderer", "raycast", "--samples", 1, "--variants", "all", "--labels", "all"
    )
    for to in sorted(
        EXPORT_FORMATS.keys()
        - {"shirt", "tum", "video", "kitti", "spades", "rosbag2", "unknown_target"}
        - {each.name for each in EVENT_FORMATS}
    ):  # these have one variant, poses that are not read, or events
        write_export(out, to, tmp_path / to)
        poses = read_pose_list(tmp_path / to)
        found = np.sort(poses.t_cam_body, axis=0)
        np.testing.assert_allclose(found, np.sort(np.repeat(PLACES["craft"], 2, axis=0), axis=0), atol=1e-9)
