"""Datasets of several bodies, from author to the oracle: what is made, and what is made anew when one of them moves."""

import json
import shutil
import subprocess
import sys

import numpy as np
import pytest
import trimesh
from pxr import Sdf, Usd

from spin_usd import Dataset
from spin_usd.errors import InputError
from spin_usd.labels.table import DEFAULT_LABELS

CAMERA = {"Nu": 96, "Nv": 72, "ppx": 1e-5, "ppy": 1e-5, "cameraMatrix": [[130, 0, 48], [0, 130, 36], [0, 0, 1]]}
SECOND_OUT = (9, 0, 6)  # metres: beside the frame
FRAMES = 4


def pose_list(path, places):
    entries = [
        {"filename": f"p{i}.png", "q_vbs2tango_true": [0.8, 0.36, 0.48, 0], "r_Vo2To_vbs_true": list(place)}
        for i, place in enumerate(places)
    ]
    path.write_text(json.dumps(entries))
    return path


@pytest.fixture(scope="module")
def stage(tmp_path_factory, spin_usd):
    """A box, a smaller one that leaves the frame after two pictures, and an arm."""
    folder = tmp_path_factory.mktemp("bodies")
    for name, size in (("craft", (1, 0.8, 0.6)), ("debris", (0.4, 0.4, 0.4)), ("arm", (1.2, 0.05, 0.05))):
        trimesh.creation.box(size).export(folder / f"{name}.stl")
    (folder / "camera.json").write_text(json.dumps(CAMERA))
    poses = pose_list(folder / "poses.json", [(0, 0.1 * i, 6) for i in range(FRAMES)])
    second = pose_list(folder / "second.json", [(0.4, 0, 5), (0.3, 0.1, 5), SECOND_OUT, SECOND_OUT])
    arm = pose_list(folder / "arm_pose.json", [(0, 0.2, 2)])
    spin_usd(
        "author", "--poses", poses, "--target", folder / "craft.stl", "--camera", folder / "camera.json",
        "--units-per-metre", 1, "--also", f"{folder / 'debris.stl'}:{second}",
        "--occluder", f"{folder / 'arm.stl'}:{arm}", "--out", folder / "stage",
    )  # fmt: skip
    return folder / "stage"


@pytest.fixture(scope="module")
def rendered(stage, tmp_path_factory, spin_usd):
    out = tmp_path_factory.mktemp("rendered") / "dataset"
    spin_usd("render", stage, "--out", out, "--renderer", "raycast", "--samples", "1")
    return out


def test_the_independent_oracle_accepts_two_targets_and_an_arm(rendered, shared) -> None:
    oracle = [sys.executable, shared / "check" / "oracle.py", rendered]
    done = subprocess.run(oracle, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_it_says_which_body_each_pixel_is_of(rendered) -> None:
    dataset = Dataset(rendered)
    assert [(target.id, target.name) for target in dataset.targets] == [(1, "craft"), (2, "debris")]
    assert [part.target for part in dataset.parts.values()] == [1, 2, 0]
    first, _, third, _ = dataset
    assert set(np.unique(first.label("instance"))) == {0, 1, 2}
    assert first.mask(1).any()
    assert first.mask(2).any()
    assert not third.mask(2).any()
    assert third.targets[1].t_cam_body == pytest.approx(SECOND_OUT)
    of_part = np.array([0, *(part.target for part in dataset.parts.values())])
    for picture in dataset:
        np.testing.assert_array_equal(of_part[picture.segmentation], picture.label("instance"))
    with pytest.raises(InputError, match="there is no target 3; choose among 1 'craft', 2 'debris'"):
        first.mask(3)


def test_targets_are_reached_by_name(rendered) -> None:
    dataset = Dataset(rendered)
    picture = dataset[0]
    assert dataset.targets["debris"].id == picture.targets["debris"].id == 2
    assert picture.targets["craft"] is picture.targets[0]
    np.testing.assert_array_equal(picture.mask("debris"), picture.mask(2))
    for targets in (dataset.targets, picture.targets):
        with pytest.raises(InputError, match="no target is named 'arm'; choose among 1 'craft', 2 'debris'"):
            targets["arm"]


MATERIALS = """schema = "augment-1"
[[augmentation]]
name = "worn"
[augmentation.sample]
"material.*.roughness" = { distribution = "uniform", low = 0.1, high = 0.9 }
"""


def test_a_variant_of_materials_renumbers_no_target(stage, tmp_path, spin_usd) -> None:
    """Its layer names the second target first. Labels are those of the stage without it, to the byte."""
    copy, out = shutil.copytree(stage, tmp_path / "stage"), tmp_path / "dataset"
    (tmp_path / "spec.toml").write_text(MATERIALS)
    spin_usd("augment", copy, "--spec", tmp_path / "spec.toml")
    composed = Usd.Stage.Open(str(copy / "dataset.usda"))
    composed.GetPrimAtPath("/World").GetVariantSet("augmentation").SetVariantSelection("worn")
    names = [prim.GetName() for prim in composed.GetPrimAtPath("/World").GetChildren()]
    assert names.index("Debris") < names.index("Target"), "USD's own order has the second target first"
    spin_usd(
        "render", copy, "--out", out, "--renderer", "raycast", "--samples", "1", "--variants", "all", "--frames", "0:1"
    )
    nominal, worn = (Dataset(out).picture("p0", variant) for variant in ("nominal", "worn"))
    assert worn.record["targets"] == nominal.record["targets"]
    for kind in ("segmentation", "instance", "depth", "dense_pose"):
        assert worn.record["files"][kind]["sha256"] == nominal.record["files"][kind]["sha256"]
    assert json.loads(spin_usd("check", out, "--json").stdout)["findings"] == []


def test_check_says_where_a_record_numbers_its_targets_otherwise(rendered, tmp_path, spin_usd) -> None:
    """As records of versions did that numbered each variant by itself."""
    out = shutil.copytree(rendered, tmp_path / "dataset")
    path = out / "records" / "nominal" / "p0.json"
    record = json.loads(path.read_text())
    first, second = record["targets"]
    first["name"], second["name"] = second["name"], first["name"]
    path.write_text(json.dumps(record))
    found = json.loads(spin_usd("check", out, "--json", code=1).stdout)["findings"]
    (swapped,) = (finding for finding in found if finding["code"] == "target-ids")
    assert swapped["message"].startswith(
        "its targets are 1 'debris', 2 'craft', but dataset.json has 1 'craft', 2 'debris'"
    )


def test_check_finds_nothing_wrong(rendered, stage, spin_usd) -> None:
    for path in (rendered, stage):
        assert json.loads(spin_usd("check", path, "--json").stdout)["findings"] == []


def moved(stage, folder, times):
    """A copy of the stage in which the second target is elsewhere at the time codes."""
    copy = shutil.copytree(stage, folder / "stage")
    layer = Sdf.Layer.FindOrOpen(str(copy / "layers" / "debris_poses.usdc"))
    made = Usd.Stage.Open(layer)
    translate = made.GetPrimAtPath("/World/Debris").GetAttribute("xformOp:translate")
    for time in times:
        translate.Set(translate.Get(time) * 1.05, time)
    layer.Save()
    return copy


def test_labels_are_made_anew_only_where_the_body_that_moved_shows(rendered, stage, tmp_path, spin_usd) -> None:
    """It leaves the frame after two pictures. Light is new in all: it may cast a shadow. So are the records, which have
    its pose."""
    out = shutil.copytree(rendered, tmp_path / "dataset")
    before = [picture.targets[1].t_cam_body for picture in Dataset(out)]
    changed = moved(stage, tmp_path, range(FRAMES))
    options = ("--out", out, "--renderer", "raycast", "--samples", "1")
    planned = json.loads(spin_usd("plan", changed, *options, "--json").stdout)
    assert (planned["label_passes"], planned["renders"]) == (2, FRAMES)
    done = spin_usd("render", changed, *options)
    assert f"{FRAMES} pictures made" in done.stdout
    assert f"2 label passes made, 2 shared; {FRAMES} renders made" in done.stdout
    after = [picture.targets[1].t_cam_body for picture in Dataset(out)]
    np.testing.assert_allclose(after, np.multiply(before, 1.05), atol=1e-12)


@pytest.mark.slow
def test_records_of_labels_alone_follow_a_target_that_nobody_sees(stage, tmp_path, spin_usd) -> None:
    options = ("--out", tmp_path / "dataset", "--renderer", "raycast", "--labels-only", "--frames", "2:3")
    spin_usd("render", stage, *options)
    (before,) = Dataset(tmp_path / "dataset")
    done = spin_usd("render", moved(stage, tmp_path, (2,)), *options)
    (after,) = Dataset(tmp_path / "dataset")
    assert "0 label passes made, 1 shared" in done.stdout
    assert after.targets[1].t_cam_body == pytest.approx(before.targets[1].t_cam_body * 1.05)
    assert after.record["files"] == before.record["files"]


def test_one_target_alone_has_the_instance_that_is_asked_for(small_stage, tmp_path, spin_usd) -> None:
    options = ("--renderer", "raycast", "--labels-only", "--frames", "0:1", "--labels", "default,instance")
    spin_usd("render", small_stage, "--out", tmp_path / "dataset", *options)
    (picture,) = Dataset(tmp_path / "dataset")
    np.testing.assert_array_equal(picture.label("instance") == 1, picture.segmentation > 0)
    assert "instance" not in DEFAULT_LABELS
