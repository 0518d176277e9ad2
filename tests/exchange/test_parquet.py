"""Parquet: shards that are the same in every run, a card with YAML at its head, and what is wrong with a file."""

import io
import json
import sys

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest

from spin_usd.errors import InputError, MissingPackageError
from spin_usd.exchange.read_pose_list import read_pose_list
from spin_usd.formats.image_file import read_image, write_image
from spin_usd.reading.dataset import Dataset
from tests.exchange.conftest import clone, contents, write_export

ASKED = {"split": "train=0.7,validation=0.3", "options": {"pictures": "3"}}


@pytest.fixture(scope="module")
def parquet(two_variants, tmp_path_factory):
    out = tmp_path_factory.mktemp("parquet") / "out"
    write_export(two_variants, "parquet", out, **ASKED)
    return out


def test_shards_are_called_as_the_hub_calls_them_and_hold_all_pictures(parquet) -> None:
    files = sorted(path.name for path in (parquet / "data").iterdir())
    assert files == [
        *(f"train-0000{place}-of-00003.parquet" for place in range(3)),
        *(f"validation-0000{place}-of-00002.parquet" for place in range(2)),
    ]
    names = [name for file in files for name in pyarrow.parquet.read_table(parquet / "data" / file)["name"].to_pylist()]
    assert len(names) == len(set(names)) == 12


def test_the_card_begins_with_yaml_that_names_the_shards(parquet) -> None:
    _, head, text = (parquet / "README.md").read_text().split("---\n", 2)
    said = {name: json.loads(value) for name, value in (line.split(": ", 1) for line in head.splitlines())}
    (config,) = said["configs"]
    assert config["data_files"] == [
        {"split": split, "path": f"data/{split}-*.parquet"} for split in ("train", "validation")
    ]
    assert {"name": "image", "dtype": "image"} in said["dataset_info"]["features"]
    assert text.startswith("\n# tango, 12 pictures as parquet")


def test_images_are_the_datasets_bytes_and_those_of_sixteen_bits_are_made_eight(rendered, parquet, tmp_path) -> None:
    row = pyarrow.parquet.read_table(parquet / "data").to_pylist()[0]
    picture = Dataset(rendered)[row["index"] % 3]
    for kind in ("image", "segmentation"):
        assert row[kind]["bytes"] == picture.root.joinpath(picture.files[kind].path).read_bytes()
    deep = clone(rendered, tmp_path / "deep", [{"frame": "a"}])
    path = deep / "records" / "nominal" / "a.json"
    record = json.loads(path.read_text())
    record["files"]["image"]["dtype"] = "uint16"
    path.write_text(json.dumps(record))
    file = deep / record["files"]["image"]["path"]
    image, _ = read_image(file)
    file.unlink()  # another dataset has it too
    write_image(file, image.astype(np.uint16) * 257, channels=("Y",))
    write_export(deep, "parquet", tmp_path / "out")
    (row,) = pyarrow.parquet.read_table(tmp_path / "out" / "data").to_pylist()
    (tmp_path / row["image"]["path"]).write_bytes(row["image"]["bytes"])
    found, _ = read_image(tmp_path / row["image"]["path"])
    assert found.dtype == np.uint8
    np.testing.assert_array_equal(found, image)


def test_shards_are_the_same_in_every_run(parquet, two_variants, tmp_path) -> None:
    write_export(two_variants, "parquet", tmp_path / "again", **ASKED)
    assert contents(tmp_path / "again") == contents(parquet)


def test_without_pyarrow_one_sentence_says_what_to_install(rendered, parquet, tmp_path, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    words = r"needs pyarrow, which is not installed; run .*pip install 'pyarrow>=21'"
    with pytest.raises(MissingPackageError, match=words):
        write_export(rendered, "parquet", tmp_path / "out")
    assert not (tmp_path / "out").exists()
    with pytest.raises(MissingPackageError, match=words):
        read_pose_list(parquet)


def table_bytes(**columns) -> bytes:
    file = io.BytesIO()
    pyarrow.parquet.write_table(pyarrow.table(columns), file)
    return file.getvalue()


GOOD = {"name": ["a"], "q_cam_body": [[1.0, 0, 0, 0]], "t_cam_body": [[0.0, 0, 5]]}


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"PAR1 no", r"a\.parquet: is damaged"),
        (table_bytes(**GOOD)[:-9], r"a\.parquet: is damaged"),
        (table_bytes(name=["a"]), "has no column 'q_cam_body'; give name, q_cam_body, t_cam_body"),
        (table_bytes(**GOOD | {"q_cam_body": [[1.0]]}), "row 0: q_cam_body is not a list of 4"),
        (table_bytes(**GOOD | {"t_cam_body": ["far"]}), "row 0: t_cam_body is not a list of 3"),
        (table_bytes(**GOOD | {"name": [7]}), "row 0: name is not text"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(tmp_path, data, words) -> None:
    (tmp_path / "a.parquet").write_bytes(data)
    with pytest.raises(InputError, match=words):
        read_pose_list(tmp_path / "a.parquet")


def test_labels_that_pillow_does_not_read_whole_are_left_out(rendered, tmp_path) -> None:
    """As NOCS, of 16 bits in colour."""
    dataset = clone(rendered, tmp_path / "set", [{"frame": "a"}])
    path = dataset / "records" / "nominal" / "a.json"
    record = json.loads(path.read_text())
    nocs = dataset / "nocs" / "nominal" / "a.png"
    nocs.parent.mkdir(parents=True)
    write_image(nocs, np.zeros((150, 240, 3), np.uint16), channels=("R", "G", "B"))
    channels = {"path": "nocs/nominal/a.png", "channels": {"R": "x", "G": "y", "B": "z"}}
    record["files"]["nocs"] = record["files"]["segmentation"] | channels
    record["files"]["instance"] = record["files"]["segmentation"]
    path.write_text(json.dumps(record))
    write_export(dataset, "parquet", tmp_path / "out")
    columns = pyarrow.parquet.read_table(tmp_path / "out" / "data").column_names
    assert [name for name in columns if name in ("image", "instance", "nocs", "segmentation")] == [
        "image",
        "segmentation",
        "instance",
    ]
