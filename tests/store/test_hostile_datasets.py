"""A dataset from someone else: whatever it holds in place of its files, a run refuses it at once."""

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from spin_usd.errors import InputError
from spin_usd.files.changes import remove_file
from spin_usd.reading.dataset import Dataset
from spin_usd.store.dataset_folder import Store
from spin_usd.store.read_documents import read_record
from tests.cases.records import record_files

RECORD = "records/nominal/a.json"
HOSTILE: dict[str, Callable[[Path, Path], object]] = {
    "record a pipe": lambda root, _: os.mkfifo(root / RECORD),
    "description a pipe": lambda root, _: os.mkfifo(root / "dataset.json"),
    "measured times a pipe": lambda root, _: os.mkfifo(root / "cache" / "measured.json"),
    "cached file a pipe": lambda root, _: os.mkfifo(root / "cache" / "depth.exr"),
    "record a link": lambda root, outside: (root / RECORD).symlink_to(outside / "private"),
    "description a link": lambda root, outside: (root / "dataset.json").symlink_to(outside / "private"),
    "records a link": lambda root, outside: _replaced(root / "records").symlink_to(outside),
    "image a link": lambda root, outside: (root / "image").symlink_to(outside),
    "stage a link": lambda root, outside: _replaced(root / "stage").symlink_to(outside),
    "cache a link": lambda root, outside: _replaced(root / "cache").symlink_to(outside),
    "image a file": lambda root, _: (root / "image").write_bytes(b""),
    "cache a file": lambda root, _: _replaced(root / "cache").write_bytes(b""),
    "stage a file": lambda root, _: _replaced(root / "stage").write_bytes(b""),
    "description a folder": lambda root, _: (root / "dataset.json").mkdir(),
}


def _replaced(folder: Path) -> Path:
    shutil.rmtree(folder)
    return folder


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    """What is the user's, beside the dataset."""
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside" / "private").write_bytes(b"private")
    return tmp_path / "outside"


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """The folders of a dataset."""
    for folder in ("stage", "records/nominal", "cache"):
        (tmp_path / "dataset" / folder).mkdir(parents=True)
    return tmp_path / "dataset"


@pytest.mark.parametrize("hostile", HOSTILE)
def test_a_run_refuses_it_and_nothing_outside_changes(root: Path, outside: Path, hostile: str) -> None:
    HOSTILE[hostile](root, outside)
    before = sorted(root.rglob("*"))
    for _ in range(2):  # a refusal leaves nothing that blocks the next run, or lets it in
        with pytest.raises(InputError):
            Store(root=root).prepare()
    assert sorted(root.rglob("*")) == before
    assert [path.read_bytes() for path in outside.iterdir()] == [b"private"]


@pytest.mark.parametrize("hostile", ["record a pipe", "record a link", "description a pipe", "description a link"])
def test_none_of_it_is_read(root: Path, outside: Path, hostile: str) -> None:
    HOSTILE[hostile](root, outside)
    with pytest.raises(InputError, match=r"named pipe|is not a file, or is reached over a link"):
        read_record(Store(root=root).folder, RECORD if hostile.startswith("record") else "dataset.json")


def test_a_record_that_is_a_folder_is_one_sentence(root: Path) -> None:
    (root / RECORD).mkdir()
    with pytest.raises(InputError, match="it is a folder"):
        read_record(Store(root=root).folder, RECORD)
    with pytest.raises(InputError, match="is not a file"):
        remove_file(Store(root=root).folder, RECORD)


@pytest.mark.parametrize("kind", ["file", "link", "pipe"])
def test_what_bears_the_name_of_a_killed_runs_work_blocks_one_run_at_most(
    tmp_path: Path, outside: Path, kind: str
) -> None:
    """The token in the lock is whoever's who wrote the dataset."""
    token, store = "0" * 32, Store(root=tmp_path / "dataset")
    store.root.mkdir()
    store.lock.write_text(f"spin_usd {token}\n")
    work = store.work(token)
    {"file": work.touch, "link": lambda: work.symlink_to(outside), "pipe": lambda: os.mkfifo(work)}[kind]()
    with pytest.raises(OSError, match="exists"), store.locked():
        pass
    with store.locked() as lease:
        assert lease.work.is_dir()
    assert (outside / "private").read_bytes() == b"private"


LEADING_OUT = ["../st/dataset.usda", "/etc/passwd", "stage/../../st.usda", "stage//x", "stage/\0", "a" * 5000, ""]


@pytest.mark.parametrize("name", LEADING_OUT)
def test_names_that_lead_out_are_refused_wherever_data_have_them(rendered: Path, tmp_path: Path, name: str) -> None:
    """The stage's root layer in dataset.json and in a record, its files in a record, and a picture's own file."""
    dataset = Path(shutil.copytree(rendered, tmp_path / "dataset"))
    path = record_files(dataset)[0]
    record, relative = json.loads(path.read_text()), path.relative_to(dataset).as_posix()
    stage = record["provenance"]["stage"]
    for spoiled in ({"root": name}, {"files": {name: "0" * 64}}):
        path.write_text(json.dumps({**record, "provenance": {**record["provenance"], "stage": {**stage, **spoiled}}}))
        with pytest.raises(InputError, match="breaks schema record-1"):
            read_record(Store(root=dataset).folder, relative)
    files = {kind: {**entry, "path": name} for kind, entry in record["files"].items()}
    path.write_text(json.dumps({**record, "files": files}))
    with pytest.raises(InputError, match="breaks schema record-1"):
        _ = Dataset(dataset)[0]
    description = json.loads((dataset / "dataset.json").read_text())
    description["stage"]["root"] = name
    (dataset / "dataset.json").write_text(json.dumps(description))
    with pytest.raises(InputError, match="breaks schema dataset-1"):
        Dataset(dataset)
