"""The poses of a WebDataset whose samples hold records of spin_usd: KEY.json in tar files."""

import tarfile
from collections.abc import Iterator
from pathlib import Path

from spin_usd.errors import InputError
from spin_usd.files.given_file import open_file
from spin_usd.files.size_limits import MAX_RECORD, MAX_SHARD
from spin_usd.formats.poses.pose_format import PoseEntry, PoseFormat, files_like
from spin_usd.formats.poses.record import pose_of_record
from spin_usd.nesting import parsed_json

SUFFIX = ".json"


def read(path: Path) -> Iterator[PoseEntry]:
    """Read the records of the shard. Raises InputError that names the member."""
    try:
        with open_file(path, MAX_SHARD) as shard, tarfile.open(fileobj=shard) as tar:
            for member in tar:
                key, dot, kind = member.name.rpartition("/")[2].partition(".")
                if member.isfile() and dot + kind == SUFFIX:
                    file, where = tar.extractfile(member), f"{path}, {member.name[:200]}"
                    text = file.read(MAX_RECORD) if file else b""
                    yield pose_of_record(_parsed(text, where), where, name=key.replace("%2E", "."))
    except (OSError, tarfile.TarError) as error:
        raise InputError(f"is not a whole tar file ({error})", where=path, do="export it again") from None


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
