"""Tar files have the bytes of their members, and no others that could differ."""

import os
import tarfile

from spin_usd.files.folder import FileIn, Folder
from spin_usd.formats.tar_file import Member, write_tar


def test_it_holds_its_members_in_order(tmp_path) -> None:
    names = ["b.png", "a.json", "n" * 150 + ".exr"]  # the last is too long for the oldest header
    for number, name in enumerate(names):
        (tmp_path / name).write_bytes(bytes([number]) * 600 * number)
    write_tar(tmp_path / "t.tar", [Member(name=name, source=FileIn(Folder(tmp_path), name)) for name in names])
    with tarfile.open(tmp_path / "t.tar") as tar:
        assert tar.getnames() == names
        assert [tar.extractfile(name).read() for name in names] == [(tmp_path / name).read_bytes() for name in names]


def test_its_bytes_say_nothing_of_when_and_who(tmp_path) -> None:
    (tmp_path / "a").write_bytes(b"same")
    write_tar(tmp_path / "one.tar", [Member(name="a", source=FileIn(Folder(tmp_path), "a"))])
    os.utime(tmp_path / "a", (1, 1))
    (tmp_path / "a").chmod(0o600)
    write_tar(tmp_path / "two.tar", [Member(name="a", source=FileIn(Folder(tmp_path), "a"))])
    assert (tmp_path / "one.tar").read_bytes() == (tmp_path / "two.tar").read_bytes()
    with tarfile.open(tmp_path / "one.tar") as tar:
        (found,) = tar.getmembers()
    assert (found.mtime, found.uid, found.gid, found.uname, found.mode) == (0, 0, 0, "", 0o644)
