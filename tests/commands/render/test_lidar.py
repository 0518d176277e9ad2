"""LiDAR labels of a dataset: the same bytes however they are made, kept up to date, and read as the stage says."""

import json

import numpy as np
import pytest

from spin_usd import Dataset
from tests.conftest import REPOSITORY, speedplus_camera

LABELS = "lidar,lidar_ply,depth,segmentation"


@pytest.fixture(scope="module")
def stage(tmp_path_factory, spin_usd):
    """Two small pictures of Tango, with a LiDAR."""
    folder = tmp_path_factory.mktemp("lidar")
    poses = json.loads((REPOSITORY / "stages" / "examples" / "tango_speedplus_poses.json").read_text())
    (folder / "poses.json").write_text(json.dumps(poses[:2]))
    (folder / "camera.json").write_text(json.dumps(speedplus_camera(divide=8)))
    given = ("--poses", folder / "poses.json", "--camera", folder / "camera.json", "--target", "tango")
    spin_usd("author", *given, "--lidar", "flash", "--out", folder / "stage")
    return folder / "stage"


@pytest.fixture(scope="module")
def render(spin_usd):
    def made(stage, out, *more, labels=LABELS, code=0):
        return spin_usd(
            "render",
            stage,
            "--out",
            out,
            "--renderer",
            "raycast",
            "--labels",
            labels,
            "--labels-only",
            *more,
            code=code,
        )

    return made


@pytest.fixture(scope="module")
def dataset(stage, render):
    render(stage, stage.parent / "dataset", "--workers", "1")
    return stage.parent / "dataset"


def clouds(dataset):
    """The bytes of its clouds by path."""
    found = [path for kind in ("lidar", "lidar_ply") for path in (dataset / kind).rglob("*.*")]
    return {str(path.relative_to(dataset)): path.read_bytes() for path in found}


@pytest.mark.slow
def test_workers_and_resuming_change_no_byte(stage, dataset, render, tmp_path) -> None:
    render(stage, tmp_path, "--workers", "2", "--no-cache")
    (tmp_path / "lidar" / "nominal" / "img000002.npz").unlink()
    assert "1 picture made, 1 already there" in render(stage, tmp_path).stdout
    assert clouds(tmp_path) == clouds(dataset)


@pytest.mark.slow
def test_check_finds_nothing_and_a_changed_record(dataset, spin_usd) -> None:
    spin_usd("check", dataset)
    path = dataset / "records" / "nominal" / "img000001.json"
    text = path.read_text()
    record = json.loads(text)
    record["lidar"]["t_cam_lidar"] = [0.0, 0.0, 0.0]
    path.write_text(json.dumps(record))
    assert "of the points of lidar disagree with depth" in spin_usd("check", dataset, code=1).stdout
    path.write_text(text)


def test_a_picture_gives_its_points(dataset) -> None:
    picture = Dataset(dataset)[0]
    cloud = picture.lidar
    assert len(cloud) > 1000
    assert cloud.points.shape == cloud.points_cam.shape == (len(cloud), 3)
    assert set(cloud.parts.tolist()) <= set(picture.parts)
    assert set(cloud.targets.tolist()) == {1}
    np.testing.assert_allclose(np.linalg.norm(cloud.points, axis=1), cloud.ranges, rtol=1e-6)
    np.testing.assert_allclose(cloud.T_cam_lidar[:3, 3], (0.15, 0, 0), atol=1e-12)
    np.testing.assert_array_equal(picture.label("lidar"), picture.label("lidar_ply"))
    distance = np.linalg.norm(cloud.points_cam - picture.t_cam_body, axis=1)
    assert np.quantile(distance, 0.99) < 1.0  # Tango's size and a little noise


@pytest.mark.slow
def test_a_stage_that_loses_its_lidar_loses_its_points(stage, render, tmp_path) -> None:
    render(stage, tmp_path, "--frames", "0:1")
    layer = tmp_path / "stage" / "layers" / "lidar.usda"
    layer.write_text(layer.read_text().replace('prepend apiSchemas = ["SpinLidarAPI"]', "active = false"))
    done = render(tmp_path / "stage", tmp_path, "--frames", "0:1", labels="depth")
    assert "1 picture made" in done.stdout
    assert [path.parent.parent.name for path in tmp_path.rglob("img000001.*") if path.is_file()].count("lidar") == 0
    (picture,) = Dataset(tmp_path)
    assert sorted(picture.files) == ["depth", "segmentation"]


def test_a_stage_without_lidar_refuses_its_label(render, spin_usd, tmp_path) -> None:
    spin_usd("author", "--minimal", "--out", tmp_path / "plain")
    refused = render(tmp_path / "plain", tmp_path / "dataset", labels="lidar", code=2).stderr
    assert "has no LiDAR, which the label lidar needs; author it with --lidar" in refused
    assert not (tmp_path / "dataset").exists()
