"""A picture developed again from its radiance file: the bytes of a fresh render, without a render."""

import json
import shutil

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from spin_usd.dataset.render import RenderRequest, render
from spin_usd.dataset.schema import read_json
from spin_usd.dataset.store import Store
from spin_usd.formats.image_file import read_image
from spin_usd.stage import schema

TAKING = {
    "spin:sensor:gain": 4,
    "spin:sensor:readNoise": 8,
    "spin:sensor:prnu": 0.01,
    "spin:sensor:autoExposure": True,
    "spin:optics:psfSigma": 0.7,
    "spin:optics:glare": 0.05,
}


def make(stage, out, **request):
    request = {"samples": 2, "renderer": "raycast", "frames": "0:1", "radiance": True, **request}
    return render(RenderRequest(stage=stage, **request), out, workers=1, progress=lambda *_: None)


def records(dataset):
    return [read_json(path, "record-1") for path in Store(root=dataset).records()]


def digests(dataset):
    return {e["path"]: e["sha256"] for record in records(dataset) for e in record["files"].values()}


@pytest.fixture(scope="module")
def noisy_stage(small_stage, tmp_path_factory):
    """The same stage with optics and noise on its camera."""
    folder = tmp_path_factory.mktemp("noisy")
    shutil.copytree(small_stage.parent, folder, dirs_exist_ok=True)
    stage = Usd.Stage.Open(str(folder / small_stage.name))
    camera = next(prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Camera))
    camera.ApplyAPI(schema.SENSOR_API)
    camera.ApplyAPI(schema.OPTICS_API)
    for name, value in TAKING.items():
        camera.GetAttribute(name).Set(value)
    stage.GetRootLayer().Save()
    return folder / small_stage.name


@pytest.fixture(scope="module")
def fresh(noisy_stage, tmp_path_factory):
    out = tmp_path_factory.mktemp("fresh") / "dataset"
    assert "beauty pass" in make(noisy_stage, out).work
    return out


@pytest.fixture(scope="module")
def plain(small_stage, tmp_path_factory):
    """A dataset of the stage as it was, with its radiance."""
    out = tmp_path_factory.mktemp("plain") / "dataset"
    make(small_stage, out)
    return out


@pytest.fixture
def dataset(plain, tmp_path):
    return shutil.copytree(plain, tmp_path / "dataset")


def test_a_changed_sensor_needs_no_render(noisy_stage, fresh, dataset):
    before = digests(dataset)
    report = make(noisy_stage, dataset)
    assert (report.made, report.from_radiance, report.failed) == (1, 1, [])
    assert "sensor" in report.work
    assert "beauty pass" not in report.work
    assert digests(dataset) == digests(fresh)
    changed = {path.split("/")[0] for path, digest in digests(dataset).items() if before[path] != digest}
    assert changed == {"image"}


def test_a_run_says_how_many_pictures_came_from_their_radiance_files(noisy_stage, dataset, spin_usd):
    command = ["render", noisy_stage, "--out", dataset, "--samples", 2, "--renderer", "raycast", "--radiance"]
    line = spin_usd(*command, "--frames", "0:2").stdout
    assert "(2 pictures made (1 of them from their radiance files), 0 already there" in line
    report = json.loads(spin_usd(*command, "--frames", "0:2", "--json").stdout)
    assert (report["made"], report["from_radiance"], report["reused"]) == (0, 0, 2)


def test_what_auto_exposure_chose_is_recorded(fresh, dataset):
    assert all("auto_exposure" not in record["provenance"] for record in records(dataset))
    for record in records(fresh):
        factor = record["provenance"]["auto_exposure"]
        rgba, _ = read_image(fresh / record["files"]["radiance"]["path"])
        light = rgba[..., :3].astype(float) @ [0.2126, 0.7152, 0.0722]
        exposure = 0.9 * np.pi / 1361  # of every camera that travels with spin_usd
        assert factor * exposure * light.sum() / rgba[..., 3].sum() == pytest.approx(0.4, rel=1e-5)


def test_a_run_from_the_radiance_file_is_reproduced(noisy_stage, dataset, spin_usd):
    make(noisy_stage, dataset)
    made = json.loads(spin_usd("reproduce", dataset, "img000001", "--json").stdout)
    assert all(file["same"] for file in made["files"])


def flip(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def forget_the_key(path):
    record = json.loads(path.read_text())
    record["provenance"]["keys"]["radiance"] = "0" * 64
    path.write_text(json.dumps(record))


def other_software(path):
    record = json.loads(path.read_text())
    record["provenance"]["versions"]["embreex"] = "1.0"
    path.write_text(json.dumps(record))


@pytest.mark.parametrize(
    "spoil",
    [
        lambda root: flip(root / "radiance" / "nominal" / "img000001.exr"),
        lambda root: (root / "radiance" / "nominal" / "img000001.exr").unlink(),
        lambda root: forget_the_key(root / "records" / "nominal" / "img000001.json"),
        lambda root: other_software(root / "records" / "nominal" / "img000001.json"),
    ],
    ids=["a flipped bit", "a lost file", "another key", "other software"],
)
def test_a_file_that_does_not_hold_is_rendered_again(noisy_stage, fresh, dataset, spoil):
    spoil(dataset)
    report = make(noisy_stage, dataset)
    assert "beauty pass" in report.work
    assert report.from_radiance == 0
    assert digests(dataset) == digests(fresh)


def test_a_lost_image_needs_no_render(small_stage, dataset):
    before = digests(dataset)
    (dataset / "image" / "nominal" / "img000001.png").unlink()
    report = make(small_stage, dataset)
    assert report.made == 1
    assert "beauty pass" not in report.work
    assert digests(dataset) == before
