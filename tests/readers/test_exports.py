"""What users read exports with finds in them what the dataset says: pycocotools and webdataset."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

from spin_usd.dataset.read.dataset import Dataset
from tests.conftest import REPOSITORY

PYTHON = REPOSITORY / ".venv-readers" / "bin" / "python"
PICTURES = 3


@pytest.fixture(scope="module")
def readers():
    """The Python that has them."""
    if not PYTHON.is_file():
        pytest.skip("no .venv-readers; tools/readers_environment makes it")
    return PYTHON


@pytest.fixture(scope="module")
def dataset(small_stage, tmp_path_factory, spin_usd):
    out = tmp_path_factory.mktemp("exports") / "dataset"
    spin_usd("render", small_stage, "--out", out, "--renderer", "raycast", "--frames", f"0:{PICTURES}")
    return out


@pytest.fixture
def read(readers, dataset, tmp_path, spin_usd):
    """What a reader makes of the dataset, exported to the format of its name."""

    def reader(name, *options):
        spin_usd("export", dataset, "--to", name, "--out", tmp_path / name, *options)
        script, out = Path(__file__).with_name("read_exports.py"), tmp_path / "found.json"
        subprocess.run([readers, script, name, tmp_path / name, out], check=True, capture_output=True, text=True)
        return json.loads(out.read_text())

    return reader


def test_pycocotools_finds_the_masks_and_scores_them(read, dataset) -> None:
    found = read("coco")
    assert found["precision"] == {"bbox": 1.0, "segm": 1.0, "keypoints": 1.0}
    assert len(found["annotations"]) == PICTURES
    for each in found["annotations"]:
        mask = Dataset(dataset).picture(each["file_name"].removesuffix(".png")).mask(1)
        np.testing.assert_array_equal(each["pixels"], np.flatnonzero(mask))
        assert {"area": each["area"], "bbox": each["bbox"]} == each["said"]
        assert each["category"] == "tango"


def test_webdataset_gives_each_picture_whole(read, dataset) -> None:
    found = read("webdataset", "--option", "pictures=2")
    assert [key for key, _ in found] == [frame for frame, _ in Dataset(dataset).names]
    for (_, files), picture in zip(found, Dataset(dataset), strict=True):
        files.pop("json")
        recorded = picture.record["files"]
        assert files == {f"{kind}{Path(file['path']).suffix}": file["sha256"] for kind, file in recorded.items()}
