"""The poses of a WebDataset whose samples hold records of spin_usd, or tables of them: KEY.json in tar files."""

import tarfile
from collections.abc import Iterator
from io import BufferedReader
from pathlib import Path

from spin_usd.errors import InputError
from spin_usd.exchange.pose_format import PoseEntry, PoseFormat, files_like
from spin_usd.exchange.record_poses import pose_of_record
from spin_usd.faults import decoding
from spin_usd.files.size_limits import MAX_RECORD, MAX_SHARD
from spin_usd.files.user_file import open_file
from spin_usd.nesting import parsed_json

SUFFIX = ".json"


def read(path: Path) -> Iterator[PoseEntry]:
    """Read the records of the shard, and the shard to its end. Raises InputError that names the member."""
    with decoding(path), open_file(path, MAX_SHARD) as shard, _opened(shard, path) as tar:
        for member in tar:
            key, dot, kind = member.name.rpartition("/")[2].partition(".")
            if member.isfile() and dot + kind == SUFFIX:
                file, where = tar.extractfile(member), f"{path}, {member.name[:200]}"
                text = file.read(MAX_RECORD) if file else b""
                yield pose_of_record(_parsed(text, where), where, name=key.replace("%2E", "."))
        _read_to_end(tar, path)


def _opened(shard: BufferedReader, path: Path) -> tarfile.TarFile:
    with decoding(path):
        try:
            return tarfile.open(fileobj=shard)
        except tarfile.ReadError:  # it says so of every kind of compression, in a line each
            raise InputError("is not a tar file", where=path, do="export it again") from None


def _read_to_end(tar: tarfile.TarFile, path: Path) -> None:
    """Raise InputError where no block of zeros follows the last member: `tarfile` takes anything for the end. Raises
    EOFError where the end of what is compressed is not there."""
    file = tar.fileobj
    assert file is not None
    file.seek(tar.offset)
    if file.read(tarfile.BLOCKSIZE) != tarfile.NUL * tarfile.BLOCKSIZE:
        raise InputError("is not a whole tar file", where=path, do="export it again")
    file.seek(MAX_SHARD)  # of what is compressed, this reads all


def _parsed(text: bytes, where: str) -> object:
    try:
        return parsed_json(text)
    except ValueError:
        raise InputError("is not JSON", where=where) from None


WEBDATASET = PoseFormat(
    name="WebDataset",
    recognises=lambda path, head: path.suffix.lower() == ".tar",
    read=read,
    lists=files_like("*.tar", "*/*.tar"),
)
