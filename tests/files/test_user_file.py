"""Files that a user names: what is none, or too large, is refused at once and in one sentence."""

import os
import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from spin_usd.errors import InputError
from spin_usd.exchange.cameras.speed_camera import read_camera_file
from spin_usd.exchange.read_pose_list import read_pose_list
from spin_usd.files.user_file import open_file, path_of, read_bytes, read_text
from spin_usd.formats.array_file import read_point_cloud
from spin_usd.formats.image_file import read_image
from spin_usd.formats.lidar_file import read_lidar_file
from spin_usd.formats.mesh.mesh_file import read_mesh_file
from spin_usd.formats.table_file import read_keypoints_file
from spin_usd.specifications.augmentation_spec import read_augmentation_spec
from spin_usd.specifications.sampling_text import read_sampling_file


def pipe(folder: Path) -> Path:
    os.mkfifo(folder / "pipe")
    return folder / "pipe"


def listening(folder: Path) -> Path:
    with socket.socket(socket.AF_UNIX) as bound:
        bound.bind(os.path.relpath(folder / "socket"))  # a socket's path is short
    return folder / "socket"


NO_FILES = {
    "a folder": lambda folder: folder,
    "a named pipe": pipe,
    "a device": lambda folder: Path("/dev/zero"),
    "No such device": listening,  # Linux's own words for opening a socket
    "No such file": lambda folder: folder / "missing",
    "File name too long": lambda folder: folder / ("a" * 256),
    "cannot be the path": lambda folder: folder / "a\0b",
}


@pytest.mark.parametrize("reason", NO_FILES)
def test_what_is_no_file_is_refused_at_once(tmp_path: Path, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        read_bytes(NO_FILES[reason](tmp_path), 100)


def test_a_link_of_the_user_is_followed(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to("file")
    (tmp_path / "file").write_bytes(b"text")
    assert read_bytes(tmp_path / "link", 4) == b"text"


def test_a_link_to_a_device_is_refused(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to("/dev/urandom")
    with pytest.raises(InputError, match="a device"):
        read_bytes(tmp_path / "link", 100)


def test_size_is_bounded_before_anything_is_read(tmp_path: Path) -> None:
    with (tmp_path / "sparse").open("wb") as file:
        file.truncate(2**42)
    with pytest.raises(InputError, match="more than 1000 bytes"):
        read_bytes(tmp_path / "sparse", 1000)


def test_a_file_that_hides_its_size_is_refused() -> None:
    with pytest.raises(InputError, match="grows"):
        read_bytes("/proc/self/status", 2**20)


def test_text_is_utf_8_with_or_without_its_mark(tmp_path: Path) -> None:
    for data in (b"\xef\xbb\xbf\xc3\xa9", b"\xc3\xa9"):
        (tmp_path / "file").write_bytes(data)
        assert read_text(tmp_path / "file", 100) == "é"
    (tmp_path / "file").write_bytes(b"\xe9")
    with pytest.raises(InputError, match="is not a text file"):
        read_text(tmp_path / "file", 100)


def test_its_path_leads_to_the_open_file_whatever_its_name_has_become(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"first")
    with open_file(tmp_path / "file", 100) as file:
        (tmp_path / "file").unlink()
        (tmp_path / "file").write_bytes(b"second")
        assert Path(path_of(file)).read_bytes() == b"first"


def test_no_descriptor_stays_open_after_a_refusal(tmp_path: Path) -> None:
    before = sorted(os.listdir("/dev/fd"))
    with pytest.raises(InputError):
        read_bytes(tmp_path, 100)
    assert sorted(os.listdir("/dev/fd")) == before


READERS: dict[str, Callable[[Path], object]] = {
    "poses": read_pose_list,
    "camera": read_camera_file,
    "lidar": read_lidar_file,
    "specification": read_augmentation_spec,
    "sampling": read_sampling_file,
    "keypoints": read_keypoints_file,
    "image": read_image,
    "points": read_point_cloud,
    "obj": lambda path: read_mesh_file(path, 1),
    "ply": lambda path: read_mesh_file(path, 1),
    "stl": lambda path: read_mesh_file(path, 1),
    "gltf": read_mesh_file,
    "glb": read_mesh_file,
}
SUFFIXES = {"keypoints": "json", "points": "npz"}


@pytest.mark.parametrize("target", ["pipe", "/dev/zero", "/dev/urandom"])
@pytest.mark.parametrize("reader", READERS)
def test_every_reader_refuses_pipes_and_devices_at_once(tmp_path: Path, reader: str, target: str) -> None:
    """What once hung or filled the memory: a named pipe, a device or a link to one, where a file is expected."""
    pipe(tmp_path)
    given = tmp_path / f"given.{SUFFIXES.get(reader, reader)}"
    given.symlink_to(target)
    with pytest.raises(InputError, match="cannot be read: it is a"):
        READERS[reader](given)
