"""What lies below a folder: nothing is reached over a link, whatever data say."""

import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from spin_usd.basics.resources import schemas
from spin_usd.errors import InputError
from spin_usd.files.changes import link, put, remove_emptied, remove_file, remove_tree, write_bytes
from spin_usd.files.folder import MAX_DEPTH, FileIn, Folder
from spin_usd.files.name import PATTERN
from spin_usd.files.node import Node, NodeType


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    """A folder with a file, and links in it to what lies beside it."""
    (tmp_path / "outside" / "inner").mkdir(parents=True)
    (tmp_path / "outside" / "secret").write_bytes(b"secret")
    (tmp_path / "outside" / "inner" / "secret").write_bytes(b"secret")
    root = tmp_path / "root"
    (root / "a" / "b").mkdir(parents=True)
    (root / "a" / "b" / "file").write_bytes(b"bytes")
    (root / "to_folder").symlink_to(tmp_path / "outside")
    (root / "to_file").symlink_to(tmp_path / "outside" / "secret")
    (root / "a" / "up").symlink_to("../..")
    os.mkfifo(root / "pipe")
    return Folder(root)


OUTSIDE = (
    "../outside/secret",
    "a/../../outside/secret",
    "to_folder/secret",
    "to_file",
    "a/up/outside/secret",
    "/etc/hostname",
    "a//b/file",
    "./a/b/file",
    "a/b/file/",
    "",
    ".",
    "..",
    "a\0b",
    "\ud800",
    "pipe",
    "a",
    "a/b/file/deeper",
    "a" * 300,
    "a/" * 3000 + "a",
    "b" * 5000,
)
READINGS: dict[str, Callable[[Folder, str], object]] = {
    "open": lambda folder, name: folder.open(name, 100),
    "read": lambda folder, name: folder.read(name, 100),
    "sha256": lambda folder, name: folder.sha256(name),
    "path": lambda folder, name: folder.path(name),
    "inode": lambda folder, name: folder.inode(name),
    "link": lambda folder, name: link(FileIn(folder, name), folder.root / "new"),
}


@pytest.mark.parametrize("reading", READINGS)
@pytest.mark.parametrize("name", OUTSIDE)
def test_nothing_outside_is_read_and_nothing_but_files(folder: Folder, name: str, reading: str) -> None:
    with pytest.raises(InputError):
        READINGS[reading](folder, name)
    assert not os.path.lexists(folder.root / "new")


@pytest.mark.parametrize("reading", sorted(READINGS.keys() - {"link"}))
@pytest.mark.parametrize("name", OUTSIDE)
def test_nor_where_nothing_is_opened_relative_to_a_folder(folder, name, reading, monkeypatch) -> None:
    monkeypatch.setattr("spin_usd.files.folder.BY_DESCRIPTOR", False)
    with pytest.raises(InputError):
        READINGS[reading](folder, name)


def test_folders_are_listed_alike_where_nothing_is_opened_relative_to_one(folder, monkeypatch) -> None:
    found = [*folder.walk()]
    types = [folder.type_of(node.name) for node in found]
    monkeypatch.setattr("spin_usd.files.folder.BY_DESCRIPTOR", False)
    assert [*folder.walk()] == found
    assert [folder.type_of(node.name) for node in found] == types
    assert folder.read("a/b/file", 5) == b"bytes"
    assert [*folder.walk("to_folder")] == [*folder.walk("none")] == []


@pytest.mark.parametrize("name", OUTSIDE)
def test_nothing_outside_is_written_or_removed(folder: Folder, name: str, tmp_path: Path) -> None:
    (tmp_path / "new").write_bytes(b"new")
    for change in (
        lambda: put(folder, tmp_path / "new", name),
        lambda: write_bytes(folder, name, b"new"),
        lambda: remove_file(folder, name),
        lambda: remove_emptied(folder, name),
        lambda: remove_tree(folder, name) if name != "a" else None,
    ):
        try:
            change()
        except (InputError, OSError):
            continue
    assert (tmp_path / "outside" / "secret").read_bytes() == b"secret"
    assert sorted(os.listdir(tmp_path / "outside")) == ["inner", "secret"]
    assert (folder.root / "a" / "b" / "file").read_bytes() == b"bytes"


def test_a_file_is_read_as_it_is(folder: Folder) -> None:
    assert folder.read("a/b/file", 5) == b"bytes"
    with folder.open("a/b/file", 5) as file:
        assert file.read() == b"bytes"
    with pytest.raises(InputError, match="more than 4 bytes"):
        folder.read("a/b/file", 4)


def test_the_folder_itself_may_be_a_link(folder: Folder, tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(folder.root)
    assert Folder(tmp_path / "link").read("a/b/file", 5) == b"bytes"


def test_a_list_names_links_and_goes_into_none(folder: Folder) -> None:
    assert list(folder.walk()) == [
        Node("a", NodeType.FOLDER),
        Node("a/b", NodeType.FOLDER),
        Node("a/b/file", NodeType.FILE),
        Node("a/up", NodeType.LINK),
        Node("pipe", NodeType.OTHER),
        Node("to_file", NodeType.LINK),
        Node("to_folder", NodeType.LINK),
    ]
    assert list(folder.files("a")) == ["a/b/file"]
    assert list(folder.walk("to_folder")) == list(folder.walk("none")) == []
    assert [node.name for node in folder.special_files(["a", "pipe", "none"])] == ["a/up", "pipe"]


def test_a_list_ends_where_folders_are_nested_too_deep(tmp_path: Path) -> None:
    holder = os.open(tmp_path, os.O_RDONLY)
    for _ in range(MAX_DEPTH + 2):
        os.mkdir("d", dir_fd=holder)
        inner = os.open("d", os.O_RDONLY, dir_fd=holder)
        os.close(holder)
        holder = inner
    os.close(holder)
    with pytest.raises(InputError, match="folders in one another"):
        list(Folder(tmp_path).walk())


def test_what_is_put_into_place_makes_its_folders(folder: Folder, tmp_path: Path) -> None:
    (tmp_path / "new").write_bytes(b"new")
    put(folder, tmp_path / "new", "c/d/file")
    assert folder.read("c/d/file", 3) == b"new"
    remove_file(folder, "c/d/file")
    remove_file(folder, "c/d/file")  # is gone: nothing to do
    remove_emptied(folder, "c/d/file")
    assert folder.type_of("c") is None


@pytest.mark.parametrize("make", [lambda path: path.symlink_to("gone"), os.mkfifo])
def test_a_link_is_not_replaced(folder: Folder, tmp_path: Path, make: Callable[[Path], object]) -> None:
    (tmp_path / "made").write_text("made")
    make(folder.root / "mine")
    with pytest.raises(FileExistsError, match=r"there is a (link|pipe)"):
        put(folder, tmp_path / "made", "mine")
    assert (tmp_path / "made").read_text() == "made"


def test_a_tree_is_removed_with_its_links_and_not_what_they_lead_to(folder: Folder, tmp_path: Path) -> None:
    remove_tree(folder, "a")
    assert folder.type_of("a") is None
    assert (tmp_path / "outside" / "inner" / "secret").exists()


@pytest.mark.parametrize("schema", ["record-1", "dataset-1"])
def test_schemas_hold_the_same_pattern_of_names(schema: str) -> None:
    text = (schemas() / f"{schema}.schema.json").read_text(encoding="utf-8")
    assert json.dumps(PATTERN) in text
