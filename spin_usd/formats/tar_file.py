"""Tar files: equal members give equal bytes, for any user at any time."""

import io
import os
import tarfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from spin_usd.files.folder import FileIn


@dataclass(frozen=True, kw_only=True)
class Member:
    """A file in a tar file."""

    name: str
    """Its path there."""
    source: FileIn | bytes
    """The file that it is a copy of, or its bytes."""


def write_tar(path: Path, members: Iterable[Member]) -> None:
    """Write a tar file with these members in their order. Names too long for the oldest kind of tar file get a POSIX
    header. Raises OSError, and InputError for a source that is not a file."""
    with tarfile.open(path, "w", format=tarfile.PAX_FORMAT) as tar:
        for member in members:
            header = tarfile.TarInfo(member.name)  # no user, the year 1970
            if isinstance(member.source, bytes):
                header.size = len(member.source)
                tar.addfile(header, io.BytesIO(member.source))
                continue
            with member.source.open() as file:
                header.size = os.fstat(file.fileno()).st_size
                tar.addfile(header, file)
